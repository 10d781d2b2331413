//! A whole training run, and what came out of it.

use ndf_core::progress::Progress;
use ndf_core::projected;
use ndf_core::{Query, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::sampling::AreaSampler;
use ndf_model::{DisplacementField, Similarity};
use serde::Serialize;

use crate::error::TrainError;
use crate::settings::Settings;
use crate::state::{NetworkCheckpoint, State};
use crate::trainer::{EpochLosses, Trainer};

/// Samples on which the result is measured.
const MEASURED_SAMPLES: usize = 65_536;

/// Stream of random numbers of the measurement; batches count up from 0.
const MEASURING_STREAM: u64 = u64::MAX;

/// Batches between states to go back to when training diverges.
const BATCHES_KEPT: usize = 10;

/// How often training may go back before it gives up.
const MAX_RETREATS: usize = 8;

/// What came out, measured on fresh samples with true projections.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FitReport {
    /// Epochs made.
    pub epochs: usize,
    /// Wall seconds of training, those before a resumed checkpoint included.
    pub seconds: f64,
    /// Of these, spent on projecting, since the last resumption.
    pub seconds_projecting: f64,
    /// Mean distance to the surface, in the normalised box.
    pub projection_mean: f64,
    /// Root of the mean squared distance to the surface, in the normalised box.
    pub projection_rms: f64,
    /// Largest distance to the surface, in the normalised box.
    pub projection_max: f64,
    /// Cycle loss of the last epoch; `None` where no epoch was made, or without cycle loss.
    pub cycle_loss: Option<f64>,
    /// Share of the samples whose normal opposes the surface's.
    pub flipped_fraction: f64,
    /// Share of the samples that have no foot.
    pub missed_fraction: f64,
    /// How often training diverged and went on from an earlier state at half the rate.
    pub retreats: usize,
    /// Whether training ended before its last epoch.
    pub interrupted: bool,
}

/// A learned field, how to get to it from the user's units, and how good it is.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The field, in the normalised box.
    pub field: DisplacementField,
    /// From the surface's coordinates to the box.
    pub similarity: Similarity,
    /// How good it is.
    pub report: FitReport,
}

/// A line of the log: the state of training at the end of a batch.
#[derive(Clone, Debug)]
pub struct LogRecord<'a> {
    /// Epoch, rate, projection and cycle loss.
    pub losses: EpochLosses,
    /// Name and unweighted mean of every term.
    pub terms: &'a [(String, f64)],
    /// Share of the batch whose normal opposes the surface's.
    pub flipped_fraction: f64,
    /// Wall seconds since training began.
    pub seconds: f64,
    /// Of these, spent on projecting.
    pub seconds_projecting: f64,
}

/// Called at the end of every batch. Costs a tenth of an epoch.
pub type Log<'a> = &'a mut dyn FnMut(&LogRecord<'_>);

/// Learns the displacement field of `base` (in the surface's coordinates) that covers `surface`.
///
/// # Errors
/// If the settings or the base mesh are not usable, or training diverges again and again.
pub fn fit(
    surface: &dyn Surface,
    base: &ManifoldMesh,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Fit, TrainError> {
    let mut trainer = Trainer::new(surface, base, settings)?;
    train(&mut trainer, None, progress).map(|(fit, _)| fit)
}

/// Takes a trainer to its last epoch, its time limit or its cancellation, which is heeded at the end of a batch: a cancelled
/// run ends with what it has learned. The checkpoint is of the end; training
/// resumed from it goes on exactly as if it had not been interrupted.
///
/// Where a loss is not finite or absurd, training goes back to a state ten batches earlier with half the rate.
///
/// # Errors
/// If training diverges again and again, or the surface is out of reach.
pub fn train(
    trainer: &mut Trainer<'_>,
    mut log: Option<Log<'_>>,
    progress: &dyn Progress,
) -> Result<(Fit, NetworkCheckpoint), TrainError> {
    let mut last = None;
    let mut kept = [trainer.state.clone(), trainer.state.clone()];
    let mut batches = 0;
    let mut retreats = 0;
    let mut interrupted = false;
    while trainer.epoch() < trainer.epochs() {
        if trainer.at_batch_start() {
            report(trainer, last, progress);
            if let (Some(log), Some(losses)) = (&mut log, last) {
                log(&LogRecord {
                    losses,
                    terms: trainer.term_means(),
                    flipped_fraction: trainer.flipped_fraction()?,
                    seconds: trainer.clock.elapsed().as_secs_f64(),
                    seconds_projecting: trainer.clock.projecting.as_secs_f64(),
                });
            }
            if let Some(mut keeper) = trainer.keeper.take() {
                keeper.offer(|| trainer.checkpoint())?;
                trainer.keeper = Some(keeper);
            }
            let out_of_time = trainer.plan.settings.time_limit.is_some_and(|t| trainer.clock.elapsed() >= t);
            if out_of_time || progress.cancelled() {
                interrupted = true;
                break;
            }
            if trainer.at_stage_start() {
                // No way back into a stage that is over.
                kept = [trainer.state.clone(), trainer.state.clone()];
            } else if batches % BATCHES_KEPT == 0 {
                kept.swap(0, 1);
                kept[1] = trainer.state.clone();
            }
            batches += 1;
        }
        match trainer.run_epoch() {
            Ok(losses) => last = Some(losses),
            Err(TrainError::Diverged { .. }) if retreats < MAX_RETREATS => {
                retreats += 1;
                let earlier: &State = &kept[0];
                trainer.retreat(earlier);
                kept[1] = kept[0].clone();
            }
            Err(error) => return Err(error),
        }
    }
    progress.report("training", 1.0);
    let field = trainer.stored_field()?;
    let checkpoint = trainer.checkpoint()?;
    let measured = measure(trainer, &field);
    let cycle_loss = last.and_then(|losses| losses.cycle);
    let report = FitReport { cycle_loss, interrupted, retreats, ..measured };
    Ok((Fit { field, similarity: trainer.plan.similarity, report }, checkpoint))
}

fn report(trainer: &Trainer<'_>, last: Option<EpochLosses>, progress: &dyn Progress) {
    if let Some(EpochLosses { projection, .. }) = last {
        progress.detail(&format!("distance {:.2e}", projection.sqrt()));
    }
    progress.report("training", trainer.epoch() as f64 / trainer.epochs() as f64);
}

/// The result of a run, measured on fresh samples with true projections.
fn measure(trainer: &Trainer<'_>, field: &DisplacementField) -> FitReport {
    let plan = &trainer.plan;
    let measured = Measured::of(plan.truth(), &plan.similarity, field, &plan.sampler, plan.settings.seed);
    FitReport {
        epochs: trainer.epoch(),
        seconds: trainer.clock.elapsed().as_secs_f64(),
        seconds_projecting: trainer.clock.projecting.as_secs_f64(),
        ..measured.report()
    }
}

/// How far a field is from a surface.
pub(crate) struct Measured {
    /// Mean, root mean square and largest distance, in the box.
    pub(crate) mean: f64,
    pub(crate) rms: f64,
    pub(crate) max: f64,
    /// Shares.
    pub(crate) flipped: f64,
    pub(crate) missed: f64,
}

impl Measured {
    /// Measures a field on fresh samples, with true projections.
    pub(crate) fn of(
        surface: &dyn Surface,
        similarity: &Similarity,
        field: &DisplacementField,
        sampler: &AreaSampler,
        seed: u64,
    ) -> Self {
        let samples = sampler.sample(MEASURED_SAMPLES, seed, MEASURING_STREAM);
        let mapped = field.map_with_tangents(&samples);
        let queries: Vec<Query> = mapped.iter().map(|m| Query::at(similarity.to_world(m.point))).collect();
        let (mut sum, mut squares, mut largest, mut hits, mut flipped) = (0.0, 0.0, 0.0_f64, 0, 0);
        for (foot, mapped) in projected(surface, &queries).iter().zip(&mapped) {
            if let Ok(foot) = foot {
                let distance = similarity.to_normalised(foot.point).distance(mapped.point);
                sum += distance;
                squares += distance * distance;
                largest = largest.max(distance);
                hits += 1;
                flipped += usize::from(foot.normal.dot(mapped.normal()) < 0.0);
            }
        }
        let share = |n: usize, of: usize| n as f64 / of.max(1) as f64;
        Self {
            mean: sum / hits.max(1) as f64,
            rms: (squares / hits.max(1) as f64).sqrt(),
            max: largest,
            flipped: share(flipped, hits),
            missed: share(samples.len() - hits, samples.len()),
        }
    }

    /// The report of a run that made no epoch.
    pub(crate) fn report(&self) -> FitReport {
        FitReport {
            epochs: 0,
            seconds: 0.0,
            seconds_projecting: 0.0,
            projection_mean: self.mean,
            projection_rms: self.rms,
            projection_max: self.max,
            cycle_loss: None,
            flipped_fraction: self.flipped,
            missed_fraction: self.missed,
            retreats: 0,
            interrupted: false,
        }
    }
}
