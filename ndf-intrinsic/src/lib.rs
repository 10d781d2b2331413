//! Triangulations that know lengths instead of positions.
//!
//! - [`IntrinsicMesh`]: an oriented Δ-complex of triangles with edge lengths; what geodesics and Laplacians run on.
//! - [`IntrinsicTriangulation`]: other triangles on the surface of a mesh, kept in integer coordinates (Gillespie,
//!   Sharp and Crane 2021): flips, insertions, removals, tracing, [Delaunay flips](delaunay),
//!   [refinement], the [common subdivision](common_subdivision), points carried both ways.
//! - [`extract`]: a manifold Delaunay mesh of a displacement field at a chosen edge length.
//!
//! The same input gives the same output on any number of threads.
//!
//! ```
//! use ndf_intrinsic::{IntrinsicTriangulation, RefinementOptions};
//! use ndf_mesh::{Face, FacePoint, ManifoldMesh, SurfacePoint, shapes};
//!
//! let torus = ManifoldMesh::try_from(shapes::torus(40, 8, 1.0, 0.3))?;
//! let mut triangulation = IntrinsicTriangulation::new(&torus);
//! let report = triangulation.refine_delaunay(&RefinementOptions::default());
//! assert!(triangulation.mesh().is_delaunay() && report.min_angle.to_degrees() > 24.9);
//! // The middle of an intrinsic face, on the torus.
//! let middle = triangulation.to_input(SurfacePoint::Face(FacePoint::center(Face(0))));
//! assert!(middle.position(&torus).is_finite());
//! # Ok::<(), ndf_mesh::NotManifold>(())
//! ```

pub mod common_subdivision;
pub mod delaunay;
pub mod extraction;
pub mod integer_coordinates;
pub mod intrinsic_mesh;
pub mod intrinsic_triangulation;
mod locating;
pub mod normal_coordinates;
mod planar;
mod quad;
pub mod refinement;
pub mod remeshing;
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
pub use remeshing::{RemeshError, remesh_intrinsically};
pub use tracing::Crossing;
