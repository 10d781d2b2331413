//! Triangulations that know lengths instead of positions.
//!
//! - [`IntrinsicMesh`]: an oriented Δ-complex of triangles with edge lengths; what geodesics and Laplacians run on.
//! - [`IntrinsicTriangulation`]: other triangles on the surface of a mesh, kept in integer coordinates (Gillespie,
//!   Sharp and Crane 2021): flips, insertions, removals, tracing, [Delaunay flips](delaunay),
//!   [refinement], the [common subdivision](common_subdivision), points carried both ways.
//! - [`extract`]: a manifold Delaunay mesh of a displacement field at a chosen edge length.
//!
//! The same input gives the same output on any number of threads.

pub mod common_subdivision;
pub mod delaunay;
pub mod extraction;
pub mod integer_coordinates;
pub mod intrinsic_mesh;
pub mod intrinsic_triangulation;
mod locating;
pub mod normal_coordinates;
mod planar;
pub mod refinement;
pub mod tracing;
pub mod triangle;
mod walking;

pub use common_subdivision::{CommonPoint, CommonSubdivision};
pub use delaunay::DelaunayReport;
pub use extraction::{Extraction, ExtractionError, ExtractionOptions, ExtractionReport, extract};
pub use integer_coordinates::IntegerCoordinates;
pub use intrinsic_mesh::{IntrinsicMesh, IntrinsicMeshError, Mollification};
pub use intrinsic_triangulation::{FlipError, InsertError, IntrinsicTriangulation, MoveError, RemoveError};
pub use refinement::{RefinementOptions, RefinementReport};
pub use tracing::Crossing;
