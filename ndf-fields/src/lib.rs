//! Tangent vector fields on intrinsic triangulations, hence on any mesh.
//!
//! - [`TangentBundle`]: a tangent plane at every vertex, and parallel transport between them; [`Frames`] lead into space.
//! - [`DirectionField`]: the smoothest fields of vectors, lines or crosses, fields that follow given directions or the
//!   [curvature](principal_directions), their singularities.
//! - [`StripePattern`]: evenly spaced stripes across a line field.
//! - [`VectorHeatSolver`]: parallel transport, extension of values, logarithmic maps; [`exact_log_map`] from shortest paths.
//! - [`geodesic_centre`]: means and medians of points.
//! - [`signed_distances`] from curves, closed or not.
//! - [`HodgeDecomposition`]: a field as gradient, rotation and harmonic part.
//!
//! Vectors are complex numbers. All results are the same on any number of threads.
//!
//! ```
//! use ndf_core::NoProgress;
//! use ndf_fields::{DirectionField, TangentBundle};
//! use ndf_intrinsic::IntrinsicMesh;
//! use ndf_mesh::{ManifoldMesh, shapes};
//!
//! let sphere = ManifoldMesh::try_from(shapes::icosphere(3)).expect("a sphere is a manifold");
//! let bundle = TangentBundle::new(&IntrinsicMesh::from_mesh(&sphere));
//! let crosses = DirectionField::smoothest(&bundle, 4, &NoProgress)?;
//! // The indices of crosses, quarters of a turn, sum to χ = 2.
//! let indices: i32 = crosses.singularities(&bundle).iter().map(|(_, index)| index).sum();
//! assert_eq!(indices, 4 * 2);
//! # Ok::<(), ndf_fields::FieldError>(())
//! ```

mod bundle;
mod centre;
mod connection;
mod curvature;
mod directions;
mod eigenvector;
mod error;
mod faces;
mod frames;
mod hodge;
mod log_map;
mod points;
mod reach;
mod signed_heat;
mod stripes;
mod vector_heat;

pub use bundle::TangentBundle;
pub use centre::{Centre, CentreKind, geodesic_centre};
pub use connection::connection_laplacian;
pub use curvature::principal_directions;
pub use directions::DirectionField;
pub use error::FieldError;
pub use frames::Frames;
pub use hodge::HodgeDecomposition;
pub use log_map::exact_log_map;
pub use num_complex::Complex64;
pub use signed_heat::{SignedDistances, SignedHeatOptions, ZeroSet, joined_curve, signed_distances};
pub use stripes::StripePattern;
pub use vector_heat::{Diffused, VectorHeatSolver};
