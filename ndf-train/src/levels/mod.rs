//! Learning the levels of a base mesh from any surface: rate–distortion optimisation of integers.
//!
//! The numbers of [`Levels`] are integers that a file codes in as many bits as they are surprising.
//! The descent looks for those of least `D + λ · bits`, where D is the mean squared distance from the
//! surface: it alternates between projecting the points of the finest level and coordinate descent on the linearised
//! distance, and lowers λ from a multiple to its own value, so that coarse levels and control vertices settle before
//! fine ones are paid for (Ortega & Ramchandran 1998 for the method, Khodakovsky, Schröder & Sweldens 2000 for
//! subdivision levels as a code of surfaces).

mod descent;
mod influence;
mod rate;
#[cfg(test)]
mod tests;

use std::f64::consts::PI;
use std::time::Instant;

use ndf_core::{Cancelled, Progress, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::subdivision::Creases;
use ndf_model::file::LevelCoder;
use ndf_model::levels::{Levels, LevelsError, MAX_FACES, check_size};
use ndf_model::{DisplacementField, Similarity};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::fit::{FitReport, Measured};
use descent::Descent;

/// What a user may decide about levels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LevelOptions {
    /// Levels with displacements; by the number of base faces where it is `None`.
    pub levels: Option<usize>,
    /// How many bytes there are.
    pub budget: Budget,
    /// Iterations before and after control vertices are on their grid.
    pub iterations: [usize; 2],
    /// Seed of the samples on which the result is measured: nothing else is random.
    pub seed: u64,
}

/// How many bytes base mesh and levels may take.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Budget {
    /// So many for every face of the base mesh, and no more than bring the distance below a hundred-thousandth of the
    /// diagonal.
    PerFace(f64),
    /// About so many.
    Bytes(usize),
    /// As many as are worth their price: the price of a bit, in squares of a ten-thousandth of the surface's diagonal.
    Price(f64),
}

impl Budget {
    /// How many faces of a base mesh go with it, where that can be told beforehand.
    pub fn base_faces(self) -> Option<usize> {
        match self {
            Self::Bytes(bytes) => Some(faces_for(bytes)),
            Self::PerFace(_) | Self::Price(_) => None,
        }
    }

    fn validate(self) -> Result<(), LevelFitError> {
        let is_valid = match self {
            Self::PerFace(x) | Self::Price(x) => x.is_finite() && x > 0.0,
            Self::Bytes(bytes) => bytes > 0,
        };
        is_valid.then_some(()).ok_or(LevelFitError::Option("the budget of levels must be positive"))
    }
}

/// Bytes for every base face where nothing else is asked for: what balances control vertices with displacements.
pub const BYTES_PER_FACE: f64 = 2.2;

/// The number of base faces that balances control vertices with displacements in so many bytes.
fn faces_for(bytes: usize) -> usize {
    ((bytes as f64 / BYTES_PER_FACE).round() as usize).clamp(MIN_BASE_FACES, MAX_FACES)
}

/// A base mesh with fewer faces hardly has a shape.
const MIN_BASE_FACES: usize = 100;

impl Default for LevelOptions {
    fn default() -> Self {
        Self { levels: None, budget: Budget::PerFace(BYTES_PER_FACE), iterations: [20, 40], seed: 0 }
    }
}

/// The smallest budget by faces: what a few faces are said to need.
const FEW_BYTES: f64 = 600.0;

/// Fewer base faces than this have a level more.
const FEW_FACES: usize = 2000;

/// By what λ is multiplied at first.
const ANNEALING: f64 = 14.0;

/// Steps of levels, as a multiple of those that λ suggests.
const STEP_FACTOR: f64 = 1.4;

/// The share of the area without a foot from which a surface is out of reach.
const MAX_MISSED: f64 = 0.9;

/// Share of the iterations before the grid that go without the finest level: as long as bits cost several times their
/// price, there is hardly anything on it.
const COARSE: f64 = 0.75;

/// Angles from which edges of the base mesh are creases, and creases and boundaries have corners.
const CREASE_ANGLE: f64 = 40.0 * PI / 180.0;
const CORNER_ANGLE: f64 = 50.0 * PI / 180.0;

/// Iterations after which it is seen whether creases pay: on what is made of planes and bent sheets they do, on bumps
/// they do not. What is clearly behind is given up then, and all but the best when the finest level is added.
const TRIAL: usize = 5;

/// By what the objective may exceed the best one not to be clearly behind.
const MARGIN: f64 = 1.1;

/// Finer grids that are tried where all is sharp, each with half the spacing of the one before.
const FINER_GRIDS: usize = 8;

/// Sweeps between two projections.
const SWEEPS: usize = 3;

/// Iterations at the end in which λ stays as it is.
const SETTLED: usize = 10;

/// Iterations at the end that project onto the true surface, where there was a cheaper one before.
const TRUE_ITERATIONS: usize = 2;

/// The least price of a bit: what is closer than a millionth of the diagonal needs no bits.
const MIN_PRICE: f64 = 1e-9;

/// Below this root mean square distance, in units, more bytes are not worth having where they are not asked for.
const CLOSE_ENOUGH: f64 = 0.1;

/// The spacing of control vertices for a price of bits, in units. It is finer than edges are long, in the mean, so that
/// faces keep their shape, and not so fine that positions exceed what a file holds.
fn spacing(lambda: f64, mean_edge: f64) -> f64 {
    (3000.0 * lambda.sqrt()).clamp(mean_edge / 4096.0, mean_edge / 4.0)
}

/// Why there are no levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LevelFitError {
    /// The observer asked to stop.
    #[error("interrupted before the levels were learned; nothing of them is kept")]
    Cancelled(#[from] Cancelled),
    /// An option is out of range.
    #[error("{0}")]
    Option(&'static str),
    /// The base mesh is too large for so many levels, or the result is not usable.
    #[error(transparent)]
    Levels(#[from] LevelsError),
    /// The base mesh has no area.
    #[error("the base mesh has no area")]
    NoArea,
    /// Hardly a point of the base mesh finds the surface.
    #[error("no part of the surface is within reach of the base mesh")]
    OutOfReach,
}

/// A field of levels that was learned.
#[derive(Clone, Debug)]
pub struct LevelFit {
    /// The field, in the box.
    pub field: DisplacementField,
    /// How good it is. Its epochs are iterations.
    pub report: FitReport,
    /// The price of a bit at the end, in squares of a ten-thousandth of the surface's diagonal.
    pub price: f64,
    /// Mean distance of the finest level's points from the surface, as a share of its diagonal.
    pub mean: f64,
    /// Bytes of base mesh and levels.
    pub bytes: usize,
}

/// Learns the levels of a base mesh in the box from `surface`, which may be an approximation of `truth` that is cheaper to
/// project onto; the result is measured against the latter. A function of its arguments alone: the number of threads
/// does not matter.
///
/// # Errors
/// If the observer asks to stop, or the base mesh is not usable.
pub fn fit_levels(
    surface: &dyn Surface,
    truth: &dyn Surface,
    similarity: Similarity,
    base: &ManifoldMesh,
    options: &LevelOptions,
    progress: &dyn Progress,
) -> Result<LevelFit, LevelFitError> {
    let started = Instant::now();
    let sampler = AreaSampler::new(base).ok_or(LevelFitError::NoArea)?;
    let levels = options.levels.unwrap_or(if base.face_count() < FEW_FACES { 3 } else { 2 });
    let [free, gridded] = options.iterations;
    options.budget.validate()?;
    check_size(base, levels)?;
    progress.check()?;
    let coarse = if levels > 1 { (COARSE * free as f64) as usize } else { 0 };
    let at_first = levels - usize::from(coarse > 0);
    let smooth = Creases::by_angle(base, PI, CORNER_ANGLE);
    let start = |creases: &Creases| Descent::new(surface, similarity, base, creases, at_first);
    let descent = start(&smooth);
    if descent.missed > MAX_MISSED {
        return Err(LevelFitError::OutOfReach);
    }
    let price = Price::new(options.budget, base, descent.rms);
    let mut runs = vec![Run::new(descent, base, false, price)];
    // Beside the smooth one, what is sharp where the base mesh clearly is, and what has all its edges.
    let everywhere = Creases::everywhere(base);
    let mut sharp = vec![Creases::by_angle(base, CREASE_ANGLE, CORNER_ANGLE), everywhere.clone()];
    sharp.dedup();
    sharp.retain(|creases| *creases != smooth);
    runs.extend(sharp.iter().map(|creases| Run::new(start(creases), base, *creases == everywhere, price)));
    let annealed = |lambda: f64, iteration: usize| {
        let rest = 1.0 - iteration as f64 / free as f64;
        if iteration < free { lambda * ANNEALING.powf(rest) } else { lambda }
    };
    let all = free + gridded;
    // When the finest level is added, or where that is there from the start, after the trial.
    let chosen = if coarse > 0 { coarse } else { TRIAL.min(free.max(1)) };
    let trial = TRIAL.min(chosen);
    for iteration in 0..all {
        progress.check()?;
        if iteration == trial {
            select(&mut runs, MARGIN);
        }
        if iteration == chosen {
            select(&mut runs, 1.0);
        }
        runs.par_iter_mut().for_each(|run| {
            if iteration == coarse && at_first < levels {
                run.refine(base);
            }
            if iteration + TRUE_ITERATIONS == all && !std::ptr::addr_eq(surface, truth) {
                run.descent.turn_to(truth);
            }
            let on_grid = iteration >= free;
            if iteration >= trial && iteration + SETTLED < all {
                run.follow(on_grid);
            }
            let lambda = annealed(run.price.lambda, iteration);
            if !on_grid {
                run.descent.set_steps(run.price.lambda, STEP_FACTOR);
            } else if iteration == free {
                run.snap_to_grid(lambda);
            }
            run.step(lambda, on_grid);
        });
        progress.detail(&format!("distance {:.4} % of the diagonal", runs[0].descent.mean / 100.0));
        progress.report("levels", (iteration + 1) as f64 / all as f64);
    }
    select(&mut runs, 1.0);
    let run = runs.swap_remove(0);
    let price = &run.price;
    let field = DisplacementField::levelled(base, run.levels(price.lambda))?;
    let measured = Measured::of(truth, &similarity, &field, &sampler, options.seed);
    let report =
        FitReport { epochs: free + gridded, seconds: started.elapsed().as_secs_f64(), ..measured.report() };
    let (mean, bytes) = (1e-4 * run.descent.mean, run.sizes.into_iter().sum());
    Ok(LevelFit { field, report, price: price.lambda, mean, bytes })
}

/// A descent and what its numbers take in a file.
struct Run<'a> {
    descent: Descent<'a>,
    coder: LevelCoder,
    /// Bytes of base mesh and levels.
    sizes: [usize; 2],
    /// Whether all edges are creases.
    is_polyhedral: bool,
    price: Price,
}

/// Keeps the runs whose objective is at most `margin` times the best, which comes first.
fn select(runs: &mut Vec<Run<'_>>, margin: f64) {
    let lambda = runs.iter().map(|run| run.price.lambda).fold(0.0, f64::max);
    let objective = |run: &Run<'_>| run.objective(lambda, true);
    runs.sort_by(|a, b| objective(a).total_cmp(&objective(b)));
    let worst = margin * objective(&runs[0]);
    runs.retain(|run| objective(run) <= worst);
}

impl<'a> Run<'a> {
    fn new(descent: Descent<'a>, base: &ManifoldMesh, is_polyhedral: bool, price: Price) -> Self {
        let coder = LevelCoder::new(base, descent.level_count());
        let sizes = coder.sizes(&descent.levels(descent.mean_edge / 4.0));
        Self { descent, coder, sizes, is_polyhedral, price }
    }

    /// Changes the price of a bit, so that the size comes nearer to what is wanted.
    fn follow(&mut self, on_grid: bool) {
        self.price.follow(self.sizes, on_grid, self.descent.rms);
    }

    /// Goes on with a level more.
    fn refine(&mut self, base: &ManifoldMesh) {
        self.descent.refine(base);
        self.coder = LevelCoder::new(base, self.descent.level_count());
    }

    /// The levels as they are now, their control vertices on a grid for this price of bits.
    fn levels(&self, lambda: f64) -> Levels {
        self.descent.levels(spacing(lambda, self.descent.mean_edge))
    }

    /// `D + λ · bits`; those of control vertices do not count as long as these are free.
    fn objective(&self, lambda: f64, on_grid: bool) -> f64 {
        let [base, levels] = self.sizes;
        let bytes = levels + if on_grid { base } else { 0 };
        self.descent.rms.powi(2) + self.descent.boundary_error + 8.0 * lambda * bytes as f64
    }

    /// Puts control vertices on the grid for this price of bits. What is sharp everywhere takes the best of that and
    /// finer ones, since there displacements do not make up for what rounding does.
    fn snap_to_grid(&mut self, lambda: f64) {
        let free = self.descent.state();
        let spacing = spacing(lambda, self.descent.mean_edge);
        let finer = if self.is_polyhedral { FINER_GRIDS } else { 0 };
        let mut snapped = |spacing: f64| {
            self.descent.restore(free.clone());
            self.descent.snap_to_grid(spacing);
            self.descent.project();
            self.sizes = self.coder.sizes(&self.descent.levels(spacing));
            self.objective(lambda, true)
        };
        // From the finest on, so that where there is but one it is the last.
        let mut best = (f64::INFINITY, spacing);
        let mut last = spacing;
        for k in (0..=finer).rev() {
            last = spacing / f64::from(1 << k);
            let objective = snapped(last);
            if objective <= best.0 {
                best = (objective, last);
            }
        }
        if best.1 != last {
            snapped(best.1);
        }
    }

    /// Sweeps over all numbers and projects anew.
    fn step(&mut self, lambda: f64, on_grid: bool) {
        let (state, sizes) = (self.descent.state(), self.sizes);
        let before = self.objective(lambda, on_grid);
        for sweep in 0..SWEEPS {
            self.descent.price(sweep == 0);
            if on_grid || sweep == 0 {
                self.descent.sweep_control(lambda);
            }
            self.descent.sweep(lambda);
        }
        if on_grid {
            self.descent.fit_steps();
        }
        let coded = self.levels(lambda);
        let (descent, coder) = (&mut self.descent, &self.coder);
        ((), self.sizes) = rayon::join(|| descent.project(), || coder.sizes(&coded));
        if !self.descent.trust(self.objective(lambda, on_grid), (state, before)) {
            self.sizes = sizes;
        }
    }
}

/// The price of a bit, which follows the size that is wanted.
#[derive(Clone, Copy, Debug)]
struct Price {
    lambda: f64,
    /// Bytes that are wanted.
    bytes: Option<f64>,
    /// The price does not fall any more below this distance.
    close_enough: f64,
}

impl Price {
    fn new(budget: Budget, base: &ManifoldMesh, rms: f64) -> Self {
        // Distances fall with the reciprocal of the size, D = c / bits², so that a bit is worth 2 D / bits; at first the
        // distance is several times what it will be.
        let guess = |bytes: f64| ((rms / 4.0).powi(2) / (4.0 * bytes)).max(MIN_PRICE);
        match budget {
            Budget::Price(lambda) => Self { lambda, bytes: None, close_enough: 0.0 },
            Budget::Bytes(bytes) => {
                let bytes = bytes as f64;
                Self { lambda: guess(bytes), bytes: Some(bytes), close_enough: 0.0 }
            }
            Budget::PerFace(bytes) => {
                let bytes = (bytes * base.face_count() as f64).max(FEW_BYTES);
                Self { lambda: guess(bytes), bytes: Some(bytes), close_enough: CLOSE_ENOUGH }
            }
        }
    }

    /// Changes λ so that the size comes nearer to what is wanted: as long as it is annealed to the price at which the
    /// law above has that size, from the distance and the size that there are; then by what the size is off, which is
    /// proportional to λ^(−1/3). Half of that correction is made, since the numbers follow slowly.
    fn follow(&mut self, sizes: [usize; 2], on_grid: bool, rms: f64) {
        let Some(bytes) = self.bytes else { return };
        let size = sizes.into_iter().sum::<usize>() as f64;
        let factor = if on_grid {
            (size / bytes).powf(1.5).clamp(0.6, 1.6)
        } else {
            let rms = rms.max(self.close_enough);
            let wanted = rms * rms * size * size / (4.0 * bytes.powi(3));
            (wanted / self.lambda).clamp(0.05, 20.0)
        };
        if !on_grid || rms > self.close_enough || factor > 1.0 {
            self.lambda = (self.lambda * factor).max(MIN_PRICE);
        }
    }
}
