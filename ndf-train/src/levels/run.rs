//! A descent with its size and price.

use std::f64::consts::PI;

use ndf_mesh::ManifoldMesh;
use ndf_mesh::subdivision::Creases;
use ndf_model::file::LevelCoder;
use ndf_model::levels::Levels;
use serde::{Deserialize, Serialize};

use super::descent::{Descent, Kept};
use super::price::Price;

/// Angles from which edges of the base mesh are creases, and creases and boundaries have corners.
const CREASE_ANGLE: f64 = 40.0 * PI / 180.0;
const CORNER_ANGLE: f64 = 50.0 * PI / 180.0;

/// Finer grids that are tried where all is sharp, each with half the spacing of the one before.
const FINER_GRIDS: usize = 8;

/// Sweeps between two projections.
const SWEEPS: usize = 3;

/// The spacing of control vertices for a price of bits, in units. It is finer than edges are long, in the mean, so that
/// faces keep their shape, and not so fine that positions exceed what a file holds.
fn spacing(lambda: f64, mean_edge: f64) -> f64 {
    (3000.0 * lambda.sqrt()).clamp(mean_edge / 4096.0, mean_edge / 4.0)
}

/// A descent and what its numbers take in a file.
pub(super) struct Run<'a> {
    pub(super) descent: Descent<'a>,
    coder: LevelCoder,
    /// Bytes of base mesh and levels.
    pub(super) sizes: [usize; 2],
    pub(super) sharpness: Sharpness,
    pub(super) price: Price,
}

/// Which edges of the base mesh are creases.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Sharpness {
    /// None.
    Smooth,
    /// Those that clearly are.
    Creases,
    /// All.
    Edges,
}

impl Sharpness {
    const ALL: [Self; 3] = [Self::Smooth, Self::Creases, Self::Edges];

    /// The creases of a base mesh.
    pub(super) fn creases(self, base: &ManifoldMesh) -> Creases {
        match self {
            Self::Smooth => Creases::by_angle(base, PI, CORNER_ANGLE),
            Self::Creases => Creases::by_angle(base, CREASE_ANGLE, CORNER_ANGLE),
            Self::Edges => Creases::everywhere(base),
        }
    }

    /// What is tried on a base mesh, each with its creases: what has the same is the last of them.
    pub(super) fn tried(base: &ManifoldMesh) -> Vec<(Self, Creases)> {
        let [smooth, creases, edges] = Self::ALL.map(|sharpness| (sharpness, sharpness.creases(base)));
        let mut tried = vec![smooth];
        for sharp in [edges, creases] {
            if tried.iter().all(|(_, creases)| *creases != sharp.1) {
                tried.insert(1, sharp);
            }
        }
        tried
    }
}

/// A run between two iterations, without what follows from it and the base mesh.
#[derive(Clone, Debug)]
pub(super) struct KeptRun {
    pub(super) sharpness: Sharpness,
    pub(super) lambda: f64,
    pub(super) sizes: [usize; 2],
    pub(super) descent: Kept,
}

/// Keeps the runs whose objective is at most `margin` times the best, which comes first.
pub(super) fn select(runs: &mut Vec<Run<'_>>, margin: f64) {
    let lambda = runs.iter().map(|run| run.price.lambda).fold(0.0, f64::max);
    let objective = |run: &Run<'_>| run.objective(lambda, true);
    runs.sort_by(|a, b| objective(a).total_cmp(&objective(b)));
    let worst = margin * objective(&runs[0]);
    runs.retain(|run| objective(run) <= worst);
}

impl<'a> Run<'a> {
    pub(super) fn new(descent: Descent<'a>, base: &ManifoldMesh, sharpness: Sharpness, price: Price) -> Self {
        let coder = LevelCoder::new(base, descent.level_count());
        let sizes = coder.sizes(&descent.levels(descent.mean_edge / 4.0));
        Self { descent, coder, sizes, sharpness, price }
    }

    /// The same, where sizes are known.
    pub(super) fn with_sizes(
        descent: Descent<'a>,
        base: &ManifoldMesh,
        sharpness: Sharpness,
        price: Price,
        sizes: [usize; 2],
    ) -> Self {
        let coder = LevelCoder::new(base, descent.level_count());
        Self { descent, coder, sizes, sharpness, price }
    }

    /// Enough to go on exactly from here.
    pub(super) fn kept(&self) -> KeptRun {
        let (sharpness, lambda, sizes) = (self.sharpness, self.price.lambda, self.sizes);
        KeptRun { sharpness, lambda, sizes, descent: self.descent.kept() }
    }

    /// Changes the price of a bit, so that the size comes nearer to what is wanted.
    pub(super) fn follow(&mut self, on_grid: bool) {
        self.price.follow(self.sizes, on_grid, self.descent.rms);
    }

    /// Goes on with a level more.
    pub(super) fn refine(&mut self, base: &ManifoldMesh) {
        self.descent.refine(base);
        self.coder = LevelCoder::new(base, self.descent.level_count());
    }

    /// The levels as they are now, their control vertices on a grid for this price of bits.
    pub(super) fn levels(&self, lambda: f64) -> Levels {
        self.descent.levels(spacing(lambda, self.descent.mean_edge))
    }

    /// `D + λ · bits`; those of control vertices do not count as long as these are free.
    pub(super) fn objective(&self, lambda: f64, on_grid: bool) -> f64 {
        let [base, levels] = self.sizes;
        let bytes = levels + if on_grid { base } else { 0 };
        self.descent.rms.powi(2) + self.descent.boundary_error + 8.0 * lambda * bytes as f64
    }

    /// Puts control vertices on the grid for this price of bits. What is sharp everywhere takes the best of that and
    /// finer ones, since there displacements do not make up for what rounding does.
    pub(super) fn snap_to_grid(&mut self, lambda: f64, anew: bool) {
        let free = self.descent.state();
        let spacing = spacing(lambda, self.descent.mean_edge);
        let finer = if self.sharpness == Sharpness::Edges { FINER_GRIDS } else { 0 };
        let mut snapped = |spacing: f64| {
            self.descent.restore(free.clone());
            self.descent.snap_to_grid(spacing);
            self.descent.look(anew);
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

    /// Sweeps over all numbers, and projects anew or keeps the feet that there are.
    pub(super) fn step(&mut self, lambda: f64, on_grid: bool, anew: bool) {
        let sizes = self.sizes;
        let before = self.descent.before(self.objective(lambda, on_grid));
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
        ((), self.sizes) = rayon::join(|| descent.look(anew), || coder.sizes(&coded));
        if !self.descent.trust(self.objective(lambda, on_grid), before) {
            self.sizes = sizes;
        }
    }
}
