//! Learning a displacement field from any [`Surface`](ndf_core::Surface).
//!
//! The way of a sample through an epoch: `batch` draws it on the base mesh and now and then projects its image
//! onto the surface; `step` carries it through g, the [terms] of the objective, and back, one block at a time;
//! `optimiser` moves the parameters. [`Trainer`] makes epochs, [`train`] a whole run of them, [`fit`] a run from
//! surface and base mesh to field. [`scalars`] learns fields on the surface of a model.

mod anchors;
mod base;
mod batch;
mod cycle;
mod epoch;
mod error;
mod fit;
#[cfg(test)]
mod gradient_tests;
mod objective;
mod optimiser;
mod origin;
mod provenance;
mod rounding;
pub mod scalars;
mod settings;
mod state;
mod step;
pub mod terms;
mod trainer;

pub use base::stored_base;
pub use error::TrainError;
pub use fit::{Fit, FitReport, Log, LogRecord, fit, train};
pub use provenance::provenance;
pub use settings::{ReverseMap, Schedule, Settings, SettingsError};
pub use state::{Checkpoint, CheckpointError};
pub use trainer::{EpochLosses, Trainer};
