//! Triangulations that know lengths instead of positions.
//!
//! [`IntrinsicMesh`] is an oriented Δ-complex of triangles with edge lengths: what geodesics, Laplacians and
//! Delaunay flips run on.

pub mod common_subdivision;
pub mod delaunay;
pub mod delta_complex;
mod edits;
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
pub use delta_complex::{DeltaComplex, NO_HALFEDGE, TopologyError};
pub use extraction::{Extraction, ExtractionError, ExtractionOptions, ExtractionReport, extract};
pub use integer_coordinates::IntegerCoordinates;
pub use intrinsic_mesh::{IntrinsicMesh, IntrinsicMeshError, Mollification};
pub use intrinsic_triangulation::{FlipError, InsertError, IntrinsicTriangulation, MoveError, RemoveError};
pub use refinement::{RefinementOptions, RefinementReport};
pub use tracing::Crossing;
