//! Learning a displacement field from any [`Surface`](ndf_core::Surface).
//!
//! The way of a sample through an epoch: it is drawn on the base mesh, and now and then its image is projected
//! onto the surface; a block of samples at a time goes through g, the [terms](objective::Term) of the objective, and back;
//! Adam moves the parameters. [`Trainer`] makes epochs, [`train`] a whole run of them, [`fit`] a run from
//! surface and base mesh to field. [`scalars`] learns fields on the surface of a model.
//!
//! ```
//! use ndf_core::analytic::Sphere;
//! use ndf_core::progress::NoProgress;
//! use ndf_mesh::{ManifoldMesh, shapes};
//! use ndf_train::{Settings, fit};
//!
//! let base = ManifoldMesh::try_from(shapes::icosphere(1))?;
//! let settings = Settings { epochs: 300, samples: 512, ..Settings::default() };
//! let fit = fit(&Sphere::UNIT, &base, &settings, &NoProgress)?;
//! // In the box of side 3 the sphere has radius 1.5; its base mesh is up to 0.2 away.
//! assert!(fit.report.projection_rms < 0.02);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod base;
mod batch;
mod checkpoint;
mod clock;
#[cfg(any(test, feature = "conformance"))]
pub mod conformance;
mod engine;
mod error;
mod fit;
#[cfg(test)]
mod gradient_tests;
pub mod levels;
mod likeness;
mod metric;
pub mod objective;
mod plan;
mod provenance;
pub mod scalars;
mod settings;
mod state;
mod step;
pub mod tape;
mod trainer;

pub use base::stored_base;
pub use checkpoint::{Checkpoint, CheckpointError, Learning};
pub use error::TrainError;
pub use fit::{Fit, FitReport, Log, LogRecord, fit, train};
pub use likeness::Likeness;
pub use metric::{MetricReport, measure_metric};
pub use provenance::{level_provenance, provenance};
pub use settings::{ReverseMap, Schedule, Settings, SettingsError};
pub use state::NetworkCheckpoint;
pub use trainer::{EpochLosses, Trainer};

/// Of which [`objective::Term::state`] gives a value.
pub use serde_json;
