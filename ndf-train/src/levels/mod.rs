//! Learning the levels of a base mesh from any surface: rate–distortion optimisation of integers.
//!
//! The numbers of [`Levels`](ndf_model::levels::Levels) are integers that a file codes in as many bits as they are surprising.
//! The descent looks for those of least `D + λ · bits`, where D is the mean squared distance from the
//! surface: it alternates between projecting the points of the finest level and coordinate descent on the linearised
//! distance, and lowers λ from a multiple to its own value, so that coarse levels and control vertices settle before
//! fine ones are paid for (Ortega & Ramchandran 1998 for the method, Khodakovsky, Schröder & Sweldens 2000 for
//! subdivision levels as a code of surfaces).

mod checkpoint;
mod descent;
mod influence;
mod options;
mod plan;
mod price;
mod rate;
mod run;
mod stop;
#[cfg(test)]
mod tests;
mod trainer;

use ndf_core::{Cancelled, Progress, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_model::levels::LevelsError;
use ndf_model::{DisplacementField, Similarity};

use crate::fit::FitReport;
pub(crate) use checkpoint::Header as LevelHeader;
pub use checkpoint::{Attempt, LevelCheckpoint, Search};
pub use options::{BYTES_PER_FACE, Budget, LevelOptions};
pub use run::Sharpness;
pub use trainer::{LevelRecord, LevelTrainer};

/// Why there are no levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LevelFitError {
    /// The observer asked to stop.
    #[error("interrupted before the first iteration, so that there is nothing to keep")]
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
/// project onto; the result is measured against the latter. [`LevelTrainer`] gives a checkpoint, too.
///
/// # Errors
/// If the observer asks to stop before the first iteration, or options, base mesh or surface are not usable.
pub fn fit_levels(
    surface: &dyn Surface,
    truth: &dyn Surface,
    similarity: Similarity,
    base: &ManifoldMesh,
    options: &LevelOptions,
    progress: &dyn Progress,
) -> Result<LevelFit, LevelFitError> {
    let trainer = LevelTrainer::new(surface, similarity, base, options, progress)?;
    let trainer = if std::ptr::addr_eq(surface, truth) { trainer } else { trainer.finished_on(truth) };
    trainer.train().map(|(fit, _)| fit)
}
