//! Geodesic distances and paths.
pub mod exact;
mod envelope;
mod front;
mod pending;
mod propagation;
mod pseudo_sources;
mod sources;
mod unfolding;
mod windows;

pub use exact::{ExactOptions, GeodesicError, Geodesics, Statistics, exact_distances};
