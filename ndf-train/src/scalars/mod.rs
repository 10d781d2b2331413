//! Learning scalar fields on the base mesh of a model (supplement, §2.6 and Eq. 2).
//!
//! The fields are given at the vertices of a mesh near the learned surface, in the user's units. A sample x of the base mesh
//! goes to g_θ(x), and has the values of the closest point of that mesh (`values`). Samples are drawn once and used
//! again and again, so that an epoch (`trainer`, `step`) is nothing but the network's way there and back. Or integers on
//! levels of nodes are found from them ([`fit_levels`]), in fewer bytes.

mod error;
mod levels;
mod settings;
mod step;
#[cfg(test)]
mod tests;
mod trainer;
mod values;

use std::time::Instant;

use ndf_core::progress::Progress;
use ndf_mesh::TriangleMesh;
use ndf_mesh::io::VertexScalars;
use ndf_mesh::sampling::AreaSampler;
use ndf_model::scalars::NodeMesh;
use ndf_model::{Model, SurfaceScalars};
use serde::Serialize;

pub use error::ScalarError;
pub use levels::{ScalarBudget, ScalarLevelOptions};
pub use settings::ScalarSettings;

use levels::Levels;
use trainer::{Batch, Trainer};
use values::{Drawn, Values};

/// Samples on which the result is measured.
const MEASURED_SAMPLES: usize = 65_536;

/// Stream of random numbers of the measurement; batches count up from 0.
const MEASURING_STREAM: u64 = u64::MAX;

/// Samples that are drawn, at least one batch.
const DRAWN_SAMPLES: usize = 1 << 18;

/// Root of the mean squared distance to the mesh of the values, in the box of side 3, beyond which it is not a mesh of this
/// surface.
const FARTHEST: f64 = 0.15;

/// Epochs between reports.
const EPOCHS_REPORTED: usize = 16;

/// How far a learned field is from its values, as shares of the range of the values; 0 for a field that is constant
/// but for rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ChannelError {
    /// Root of the mean square.
    pub rms: f64,
    /// The largest.
    pub max: f64,
}

/// What came out, measured on fresh samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ScalarReport {
    /// Epochs made.
    pub epochs: usize,
    /// Wall seconds.
    pub seconds: f64,
    /// Of these, spent on drawing samples and looking their values up.
    pub seconds_sampling: f64,
    /// Errors of the channels, in order.
    pub channels: Vec<ChannelError>,
    /// Root of the mean squared distance from the surface to the mesh of the values, in the user's units.
    pub distance_rms: f64,
    /// The largest of these distances.
    pub distance_max: f64,
    /// Whether training ended before its last epoch.
    pub interrupted: bool,
}

impl ScalarReport {
    /// Root of the mean of the channels' squared errors, and the largest error of all.
    pub fn overall(&self) -> ChannelError {
        let squares: f64 = self.channels.iter().map(|c| c.rms * c.rms).sum();
        let rms = (squares / self.channels.len().max(1) as f64).sqrt();
        ChannelError { rms, max: self.channels.iter().fold(0.0, |max, c| max.max(c.max)) }
    }
}

/// Learned scalar fields, and how good they are.
#[derive(Clone, Debug)]
pub struct ScalarFit {
    /// The fields, over the base mesh of the model.
    pub fields: SurfaceScalars,
    /// How good they are.
    pub report: ScalarReport,
}

/// Learns the fields that `scalars` give at the vertices of `mesh`, all together, on the base mesh of `model`. The result
/// is a function of these and the settings alone: the number of threads does not matter. A cancelled run ends with
/// what it has learned.
///
/// # Errors
/// If the settings or values are not usable, the mesh is not one of the model's surface, or training diverges.
pub fn fit(
    model: &Model,
    mesh: &TriangleMesh,
    scalars: &[VertexScalars],
    settings: &ScalarSettings,
    progress: &dyn Progress,
) -> Result<ScalarFit, ScalarError> {
    let started = Instant::now();
    settings.validate()?;
    let values = Values::new(mesh, scalars)?;
    let base = model.field.base();
    let sampler = AreaSampler::new(base).ok_or(ScalarError::NoBaseArea)?;
    let draw = |count, stream| values.draw(model, &sampler.sample(count, settings.seed, stream));
    // Before hours of training: whether the values are there at all, and whether they can be stored.
    let measured = near(model, draw(MEASURED_SAMPLES, MEASURING_STREAM)?)?;
    let mut trainer = Trainer::new(base, values.channels.len(), settings);
    trainer.fields(&values.channels)?;
    let mut seconds_sampling = started.elapsed().as_secs_f64();

    let batches = (DRAWN_SAMPLES / settings.samples).clamp(1, settings.epochs);
    let mut drawn: Vec<Batch> = Vec::with_capacity(batches);
    let mut interrupted = false;
    while trainer.epoch() < settings.epochs {
        let epoch = trainer.epoch();
        if epoch.is_multiple_of(EPOCHS_REPORTED) {
            if progress.cancelled() {
                interrupted = true;
                break;
            }
            progress.report("learning scalar fields", epoch as f64 / settings.epochs as f64);
        }
        if drawn.len() < batches {
            let before = Instant::now();
            drawn.push(Batch::new(draw(settings.samples, epoch as u64)?, base.face_count()));
            seconds_sampling += before.elapsed().as_secs_f64();
        }
        let loss = trainer.run_epoch(&drawn[epoch % batches], &values);
        if !loss.is_finite() {
            return Err(ScalarError::Diverged { epoch });
        }
        if epoch.is_multiple_of(EPOCHS_REPORTED) {
            progress.detail(&format!("error {:.2e}", loss.sqrt()));
        }
    }
    progress.report("learning scalar fields", 1.0);
    let epochs = trainer.epoch();
    let fields = trainer.fields(&values.channels)?;
    let report = ScalarReport {
        epochs,
        channels: errors(&fields, model, &values, &measured),
        distance_rms: measured.distance_rms(),
        distance_max: measured.distance_max(),
        interrupted,
        seconds_sampling,
        seconds: started.elapsed().as_secs_f64(),
    };
    Ok(ScalarFit { fields, report })
}

/// Finds integers on levels for the fields that `scalars` give at the vertices of `mesh`, all together, on the base mesh of
/// `model`. The result is a function of these and the options alone: the number of threads does not matter. The epochs of
/// its report are sweeps.
///
/// # Errors
/// If the options or values are not usable, the mesh is not one of the model's surface, or the observer asks to stop.
pub fn fit_levels(
    model: &Model,
    mesh: &TriangleMesh,
    scalars: &[VertexScalars],
    options: &ScalarLevelOptions,
    progress: &dyn Progress,
) -> Result<ScalarFit, ScalarError> {
    let started = Instant::now();
    options.validate()?;
    let values = Values::new(mesh, scalars)?.in_ranges();
    let base = model.field.base();
    let sampler = AreaSampler::new(base).ok_or(ScalarError::NoBaseArea)?;
    let draw = |count, stream| values.draw(model, &sampler.sample(count, options.seed, stream));
    let measured = near(model, draw(MEASURED_SAMPLES, MEASURING_STREAM)?)?;
    let drawn = draw(DRAWN_SAMPLES, 0)?;
    let seconds_sampling = started.elapsed().as_secs_f64();
    progress.check()?;
    let nodes = NodeMesh::on(&model.field, options.splits(base.face_count()))?;
    let extensions = nodes.extensions(&model.field)?;
    progress.check()?;
    let at_nodes = values.draw(model, nodes.points())?;
    let mut levels = Levels::new((nodes, extensions), &values, &drawn, &at_nodes);
    let fields = levels.run(options.budget, progress)?;
    let report = ScalarReport {
        epochs: levels.sweeps,
        channels: errors(&fields, model, &values, &measured),
        distance_rms: measured.distance_rms(),
        distance_max: measured.distance_max(),
        interrupted: false,
        seconds_sampling,
        seconds: started.elapsed().as_secs_f64(),
    };
    Ok(ScalarFit { fields, report })
}

/// The samples, if the mesh of the values is one of the model's surface.
fn near(model: &Model, drawn: Drawn) -> Result<Drawn, ScalarError> {
    let distance = drawn.distance_rms();
    if distance.is_nan() || model.similarity.length_to_normalised(distance) > FARTHEST {
        return Err(ScalarError::Far { distance });
    }
    Ok(drawn)
}

fn errors(fields: &SurfaceScalars, model: &Model, values: &Values, measured: &Drawn) -> Vec<ChannelError> {
    let found = fields.evaluate(model.field.base(), &measured.points);
    let channels = fields.channels();
    let mut errors = vec![ChannelError::default(); channels.len()];
    let mut truth = vec![0.0; channels.len()];
    for (found, foot) in found.chunks_exact(channels.len()).zip(&measured.feet) {
        values.outputs_at(foot, &mut truth);
        for ((error, channel), (found, truth)) in
            errors.iter_mut().zip(channels).zip(found.iter().zip(&truth))
        {
            let range = f64::from(channel.range[1]) - f64::from(channel.range[0]);
            if channel.deviation > 0.0 {
                let difference = f64::from(found - channel.value(*truth)).abs() / range;
                error.rms += difference * difference;
                error.max = error.max.max(difference);
            }
        }
    }
    for error in &mut errors {
        error.rms = (error.rms / measured.feet.len().max(1) as f64).sqrt();
    }
    errors
}
