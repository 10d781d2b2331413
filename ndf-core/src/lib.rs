//! What a surface must answer to be learned: the vocabulary of ndf.
//!
//! [`Surface`] is the plug-in point of the project. A new representation needs this crate alone: it says how points are
//! projected onto it, and passes the laws of the [conformance suite](conformance). A representation that is the level set
//! of a function implements [`ImplicitField`] instead, and `LevelSetSurface` of ndf-surfaces projects onto it.
//!
//! ```
//! use ndf_core::{Answer, BoundingBox, DVec3, Foot, Hint, Miss, Query, Surface, conformance::Facts, projected};
//!
//! /// The axis-aligned cube [-1, 1]³, seen from outside.
//! struct Cube;
//!
//! impl Surface for Cube {
//!     fn bounds(&self) -> BoundingBox {
//!         BoundingBox { min: DVec3::NEG_ONE, max: DVec3::ONE }
//!     }
//!
//!     fn project(&self, queries: &[Query], feet: &mut [Answer]) {
//!         for (query, foot) in queries.iter().zip(feet) {
//!             let p = query.point;
//!             // The face that is nearest from inside, and the one that is farthest from outside.
//!             let axis = if p.abs().x >= p.abs().y.max(p.abs().z) { 0 } else if p.abs().y >= p.abs().z { 1 } else { 2 };
//!             let (mut point, mut normal) = (p.clamp(DVec3::NEG_ONE, DVec3::ONE), DVec3::ZERO);
//!             (point[axis], normal[axis]) = (p[axis].signum(), p[axis].signum());
//!             *foot = if p.is_finite() { Ok(Foot { point, normal, hint: Hint::NONE }) } else { Err(Miss::NotFinite) };
//!         }
//!     }
//! }
//!
//! let feet = projected(&Cube, &[Query::at(DVec3::new(0.5, 3.0, -0.5))]);
//! assert_eq!(feet[0].unwrap().point, DVec3::new(0.5, 1.0, -0.5));
//! // In tests, `ndf_core::surface_conformance!(cube, Cube, Facts::closed().through([DVec3::X]))` checks all laws.
//! Facts::closed().through([DVec3::X]).hold_for(&Cube);
//! ```
//!
//! Geometry is `f64` ([`glam::DVec3`]). Libraries print nothing: long work reports to a [`Progress`], which can cancel it.

pub mod analytic;
pub mod bounding_box;
pub mod conformance;
pub mod progress;
mod project;
pub mod surface;

pub use bounding_box::BoundingBox;
pub use progress::{Cancelled, NoProgress, Part, Progress, Sparingly};
pub use project::{project_all, projected};
pub use surface::{Answer, Foot, Hint, ImplicitField, Inside, Miss, Query, Surface};

/// Three-dimensional vectors and points, re-exported so that users need not match versions.
pub use glam;
pub use glam::DVec3;
