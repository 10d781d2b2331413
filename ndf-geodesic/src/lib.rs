//! Geodesic distances and paths.
pub mod exact;
mod envelope;
mod front;
mod pending;
pub mod heat;
pub mod paths;
mod propagation;
mod pseudo_sources;
mod queries;
mod sources;
mod unfolding;
mod windows;

pub use heat::HeatSolver;
pub use paths::Path;
pub use exact::{ExactOptions, GeodesicError, Geodesics, Statistics, exact_distances};
