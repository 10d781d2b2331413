//! Iteration after iteration.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ndf_core::{Cancelled, Progress, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::sampling::AreaSampler;
use ndf_model::levels::check_size;
use ndf_model::{DisplacementField, Similarity};
use rayon::prelude::*;
use serde::Serialize;

use super::checkpoint::LevelCheckpoint;
use super::descent::Descent;
use super::options::LevelOptions;
use super::plan::Plan;
use super::price::Price;
use super::run::{KeptRun, Run, Sharpness, select};
use super::stop::Stop;
use super::{LevelFit, LevelFitError};
use crate::checkpoint::Keeper;
use crate::clock::Clock;
use crate::fit::{FitReport, Measured};

/// Steps of levels, as a multiple of those that λ suggests.
const STEP_FACTOR: f64 = 1.4;

/// The share of the area without a foot from which a surface is out of reach.
const MAX_MISSED: f64 = 0.9;

/// By what the objective may exceed the best one not to be clearly behind.
const MARGIN: f64 = 1.1;

/// Iterations at the end in which λ stays as it is.
const SETTLED: usize = 10;

/// Iterations at the end that project onto the true surface, where there was a cheaper one before.
const TRUE_ITERATIONS: usize = 2;

/// Iterations on the grid with which a run ends whose time is up before.
const LAST_ITERATIONS: usize = 4;

/// A run after an iteration, as the log tells it. Distances are those of the finest level's points, as shares of the
/// surface's diagonal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct LevelRecord {
    /// The iteration, counted from 0.
    pub iteration: usize,
    /// Which of the runs that are tried side by side at first.
    pub run: Sharpness,
    /// Mean distance.
    pub distance_mean: f64,
    /// Root mean square distance.
    pub distance_rms: f64,
    /// Bytes of base mesh and levels.
    pub bytes: usize,
    /// The price of a bit, in squares of a ten-thousandth of the surface's diagonal.
    pub price: f64,
    /// Wall seconds since learning began.
    pub seconds: f64,
}

/// Called with every record.
type OnRecord<'a> = Box<dyn FnMut(&LevelRecord) + 'a>;

/// The learning of levels from any surface. The result is a function of surface, base mesh and options: neither the number
/// of threads nor interruptions matter.
pub struct LevelTrainer<'a> {
    surface: &'a dyn Surface,
    truth: Option<&'a dyn Surface>,
    project_every: usize,
    similarity: Similarity,
    base: ManifoldMesh,
    sampler: AreaSampler,
    options: LevelOptions,
    plan: Plan,
    progress: &'a dyn Progress,
    stop: Arc<Stop<'a>>,
    runs: Vec<Run<'a>>,
    iteration: usize,
    clock: Clock,
    log: Option<OnRecord<'a>>,
    keeper: Option<Keeper<'a, LevelCheckpoint>>,
}

impl<'a> LevelTrainer<'a> {
    /// Everything ready for the first iteration on a base mesh in the box.
    ///
    /// # Errors
    /// If the observer asks to stop, or options, base mesh or surface are not usable.
    pub fn new(
        surface: &'a dyn Surface,
        similarity: Similarity,
        base: &ManifoldMesh,
        options: &LevelOptions,
        progress: &'a dyn Progress,
    ) -> Result<Self, LevelFitError> {
        let mut trainer = Self::without_runs(surface, similarity, base.clone(), options, progress)?;
        let mut price = None;
        for (sharpness, creases) in Sharpness::tried(base) {
            let (levels, stop) = (trainer.plan.levels[0], Arc::clone(&trainer.stop));
            let descent = Descent::new(surface, similarity, base, &creases, levels, stop);
            if trainer.stop.is_requested() {
                return Err(Cancelled.into());
            }
            if price.is_none() && descent.missed > MAX_MISSED {
                return Err(LevelFitError::OutOfReach);
            }
            let price = *price.get_or_insert_with(|| Price::new(options.budget, base, descent.rms));
            trainer.runs.push(Run::new(descent, base, sharpness, price));
        }
        Ok(trainer)
    }

    /// The run of a checkpoint, to go on where it ended.
    ///
    /// # Errors
    /// If base mesh or options are not usable.
    pub fn resumed(
        surface: &'a dyn Surface,
        checkpoint: LevelCheckpoint,
        progress: &'a dyn Progress,
    ) -> Result<Self, LevelFitError> {
        let LevelCheckpoint { options, similarity, base, iteration, runs, time, .. } = checkpoint;
        let mut trainer = Self::without_runs(surface, similarity, base, &options, progress)?;
        trainer.iteration = iteration;
        trainer.clock = Clock::resumed_after(time);
        trainer.take(runs);
        Ok(trainer)
    }

    fn without_runs(
        surface: &'a dyn Surface,
        similarity: Similarity,
        base: ManifoldMesh,
        options: &LevelOptions,
        progress: &'a dyn Progress,
    ) -> Result<Self, LevelFitError> {
        let clock = Clock::resumed_after(Duration::ZERO);
        let sampler = AreaSampler::new(&base).ok_or(LevelFitError::NoArea)?;
        options.budget.validate()?;
        let plan = Plan::new(options, &base);
        check_size(&base, plan.levels[1])?;
        Ok(Self {
            surface,
            truth: None,
            project_every: 1,
            similarity,
            base,
            sampler,
            options: *options,
            plan,
            progress,
            stop: Arc::new(Stop::new(progress)),
            runs: Vec::new(),
            iteration: 0,
            clock,
            log: None,
            keeper: None,
        })
    }

    /// Takes the surface of the trainer for an approximation of `truth` that is cheaper to project onto: the last iterations
    /// and the measurement at the end project onto the truth itself.
    #[must_use]
    pub fn finished_on(mut self, truth: &'a dyn Surface) -> Self {
        self.truth = Some(truth);
        let surface = self.surface_in(self.iteration);
        self.runs.iter_mut().for_each(|run| run.descent.surface = surface);
        self
    }

    /// Keeps feet for so many iterations: in between, the surface is taken as its tangent plane there. Projecting every time
    /// comes a little closer, and is dear on some surfaces.
    #[must_use]
    pub fn projecting_every(self, iterations: usize) -> Self {
        Self { project_every: iterations.max(1), ..self }
    }

    /// Calls this with every run at the end of an iteration.
    #[must_use]
    pub fn logging(self, log: impl FnMut(&LevelRecord) + 'a) -> Self {
        Self { log: Some(Box::new(log)), ..self }
    }

    /// Passes a checkpoint to `keep` at the first iteration that starts so long after the last one, which was at `last`.
    #[must_use]
    pub fn keeping(self, every: Duration, last: Instant, keep: impl FnMut(LevelCheckpoint) + 'a) -> Self {
        Self { keeper: Some(Keeper::new(every, last, keep)), ..self }
    }

    /// Learns to the end, the time limit or the cancellation, which ends with what is learned by then: a run whose time is
    /// up puts control vertices on their grid with a few more iterations, and one that is cancelled only rounds them, within
    /// a second, and is measured before that. The checkpoint is of the end, or of where the run was interrupted; a run
    /// that is resumed from it ends as if it had not been.
    ///
    /// # Errors
    /// If the levels are not usable.
    pub fn train(mut self) -> Result<(LevelFit, LevelCheckpoint), LevelFitError> {
        let mut last = Duration::ZERO;
        let mut interrupted = None;
        while self.iteration < self.plan.all {
            let kept = self.kept();
            if let Some(mut keeper) = self.keeper.take() {
                keeper.offer(|| Ok::<_, LevelFitError>(self.checkpoint(kept.clone())))?;
                self.keeper = Some(keeper);
            }
            let to_come =
                if self.iteration <= self.plan.gridded { last * LAST_ITERATIONS as u32 } else { last };
            let end = self.clock.elapsed().saturating_add(to_come);
            let out_of_time = self.options.time_limit.is_some_and(|limit| end >= limit);
            let begun = Instant::now();
            if out_of_time && !self.stop.is_requested() {
                self.end_early();
            } else if !self.stop.is_requested() {
                self.iterate();
            }
            if self.stop.is_requested() {
                self.take(kept.clone());
            }
            if out_of_time || self.stop.is_requested() {
                interrupted = Some(kept);
                break;
            }
            last = begun.elapsed();
            self.iteration += 1;
            self.tell();
        }
        select(&mut self.runs, 1.0);
        self.progress.report("levels", 1.0);
        let checkpoint = self.checkpoint(interrupted.clone().unwrap_or_else(|| self.kept()));
        let (epochs, seconds) = (self.iteration, self.clock.elapsed().as_secs_f64());
        let run = self.runs.swap_remove(0);
        let field = DisplacementField::levelled(&self.base, run.levels(run.price.lambda))?;
        let measured = if self.stop.is_requested() {
            run.descent.measured()
        } else {
            let truth = self.truth.unwrap_or(self.surface);
            Measured::of(truth, &self.similarity, &field, &self.sampler, self.options.seed)
        };
        let interrupted = interrupted.is_some();
        let report = FitReport { epochs, seconds, interrupted, ..measured.report() };
        let (mean, bytes) = (1e-4 * run.descent.mean, run.sizes.into_iter().sum());
        Ok((LevelFit { field, report, price: run.price.lambda, mean, bytes }, checkpoint))
    }

    fn iterate(&mut self) {
        let Self { plan, iteration, truth, project_every, base, runs, .. } = self;
        let (iteration, truth, every) = (*iteration, *truth, *project_every);
        if iteration == plan.trial {
            select(runs, MARGIN);
        }
        if iteration == plan.chosen {
            select(runs, 1.0);
        }
        let on_grid = iteration >= plan.gridded;
        runs.par_iter_mut().for_each(|run| {
            if iteration == plan.refined && plan.levels[0] < plan.levels[1] {
                run.refine(base);
            }
            if let Some(truth) = truth
                && iteration + TRUE_ITERATIONS == plan.all
            {
                run.descent.turn_to(truth);
            }
            if iteration >= plan.trial && iteration + SETTLED < plan.all {
                run.follow(on_grid);
            }
            let lambda = plan.annealed(run.price.lambda, iteration);
            if !on_grid {
                run.descent.set_steps(run.price.lambda, STEP_FACTOR);
            } else if iteration == plan.gridded {
                run.snap_to_grid(lambda, every == 1);
            }
            let made = iteration + 1;
            run.step(lambda, on_grid, made.is_multiple_of(every) || made == plan.all);
        });
    }

    /// Puts the best run on the grid, unless it is there, and lets it settle a little.
    fn end_early(&mut self) {
        select(&mut self.runs, 1.0);
        if self.iteration > self.plan.gridded {
            return;
        }
        let run = &mut self.runs[0];
        run.follow(false);
        run.descent.set_steps(run.price.lambda, STEP_FACTOR);
        run.snap_to_grid(run.price.lambda, self.project_every == 1);
        for made in 1..=LAST_ITERATIONS {
            run.follow(true);
            run.step(run.price.lambda, true, self.project_every == 1 || made == LAST_ITERATIONS);
        }
    }

    /// Reports an iteration that was made.
    fn tell(&mut self) {
        let (made, all) = (self.iteration, self.plan.all);
        if let Some(log) = &mut self.log {
            for run in &self.runs {
                log(&LevelRecord {
                    iteration: made - 1,
                    run: run.sharpness,
                    distance_mean: 1e-4 * run.descent.mean,
                    distance_rms: 1e-4 * run.descent.rms,
                    bytes: run.sizes.into_iter().sum(),
                    price: self.plan.annealed(run.price.lambda, made - 1),
                    seconds: self.clock.elapsed().as_secs_f64(),
                });
            }
        }
        let mean = self.runs[0].descent.mean / 100.0;
        self.progress.detail(&format!("distance {mean:.4} % of the diagonal"));
        self.progress.report("levels", made as f64 / all as f64);
    }

    fn kept(&self) -> Vec<KeptRun> {
        self.runs.iter().map(Run::kept).collect()
    }

    /// Takes runs that were kept in the place of those that there are.
    fn take(&mut self, kept: Vec<KeptRun>) {
        let (surface, base) = (self.surface_in(self.iteration), &self.base);
        let resumed = kept.into_iter().map(|KeptRun { sharpness, lambda, sizes, descent }| {
            let (creases, stop) = (sharpness.creases(base), Arc::clone(&self.stop));
            let descent = Descent::resumed(surface, self.similarity, base, &creases, descent, stop);
            let price = Price::new(self.options.budget, base, descent.rms).at(lambda);
            Run::with_sizes(descent, base, sharpness, price, sizes)
        });
        self.runs = resumed.collect();
    }

    /// The surface onto which the iteration before this one projected.
    fn surface_in(&self, iteration: usize) -> &'a dyn Surface {
        let is_true = iteration + TRUE_ITERATIONS > self.plan.all;
        self.truth.filter(|_| is_true).unwrap_or(self.surface)
    }

    fn checkpoint(&self, runs: Vec<KeptRun>) -> LevelCheckpoint {
        LevelCheckpoint {
            options: self.options,
            similarity: self.similarity,
            base: self.base.clone(),
            iteration: self.iteration,
            runs,
            time: self.clock.elapsed(),
            search: None,
        }
    }
}
