//! Learning a displacement field from any [`Surface`](ndf_core::Surface).
//!
//! The way of a sample through an epoch: `batch` draws it on the base mesh and now and then projects its image
//! onto the surface; `step` carries it through g and back, one block at a time; `optimiser` moves the
//! parameters. [`fit`] turns the crank and says what came out.

mod batch;
#[cfg(test)]
mod gradient_tests;
mod optimiser;
mod settings;
mod step;
mod trainer;

pub use settings::{Schedule, Settings};
pub use trainer::{EpochLosses, Fit, FitReport, TrainError, Trainer, fit};
