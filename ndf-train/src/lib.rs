//! Learning a displacement field from any [`Surface`](ndf_core::Surface).
//!
//! The way of a sample through an epoch: `batch` draws it on the base mesh and now and then projects its image
//! onto the surface; `step` carries it through g, the [terms] of the objective, and back, one block at a time;
//! `optimiser` moves the parameters. [`Trainer`] makes epochs, [`train`] a whole run of them, [`fit`] a run from
//! surface and base mesh to field.

mod anchors;
mod batch;
mod fit;
#[cfg(test)]
mod gradient_tests;
mod objective;
mod optimiser;
mod settings;
mod state;
mod step;
pub mod terms;
mod trainer;

pub use fit::{Fit, FitReport, Hooks, LogRecord, fit, train};
pub use settings::{ReverseMap, Schedule, Settings};
pub use state::{Checkpoint, CheckpointError};
pub use trainer::{EpochLosses, TrainError, Trainer};
