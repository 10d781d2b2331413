//! The vocabulary of ndf: what a mesh, a point on it, a surface, and a displacement field are.
//!
//! Every other crate of the workspace speaks in the types defined here. Geometry is `f64`
//! ([`glam::DVec3`]); networks are `f32`, and the conversion happens in one place,
//! [the displacement field](field).

pub mod bounding_box;
pub mod field;
pub mod hierarchy;
pub mod io;
pub mod mesh;
pub mod metrics;
pub mod model;
pub mod network;
pub mod progress;
pub mod projection;
pub mod quality;
pub mod sampling;
pub mod scalars;
pub mod similarity;
pub mod surface;
pub mod surface_point;
pub mod tessellation;
pub mod triangle_tree;

#[cfg(feature = "conformance")]
pub mod conformance;

pub use bounding_box::BoundingBox;
pub use field::{DisplacementField, FieldShape};
pub use mesh::{ManifoldMesh, TriangleMesh, ValidationReport};
pub use model::Model;
pub use progress::{NoProgress, Progress};
pub use scalars::StoredScalars;
pub use similarity::Similarity;
pub use surface::{Foot, Hint, Inside, Miss, Projection, Query, ScalarField, Surface};
pub use surface_point::SurfacePoint;
pub use triangle_tree::{ClosestPoint, RayHit, TriangleTree};

/// Three-dimensional vectors and points, re-exported so that users need not match versions.
pub use glam;
pub use glam::DVec3;
