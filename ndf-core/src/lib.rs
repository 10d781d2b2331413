//! The vocabulary of ndf: what a surface must answer to be learned.
//!
//! A representation needs this crate alone: it implements [`Surface`] and passes the
//! [conformance suite](https://docs.rs/ndf-core/latest/ndf_core/conformance). Geometry is `f64` ([`glam::DVec3`]).

pub mod bounding_box;
pub mod progress;
pub mod projection;
pub mod surface;

#[cfg(feature = "conformance")]
pub mod conformance;

pub use bounding_box::BoundingBox;
pub use progress::{NoProgress, Progress};
pub use surface::{Foot, Hint, ImplicitField, Inside, Miss, Projection, Query, Surface};

/// Three-dimensional vectors and points, re-exported so that users need not match versions.
pub use glam;
pub use glam::DVec3;
