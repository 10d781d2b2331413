//! Triangulations that know lengths instead of positions.
//!
//! [`IntrinsicMesh`] is an oriented Δ-complex of triangles with edge lengths: what geodesics, Laplacians and
//! Delaunay flips run on.

pub mod delaunay;
pub mod delta_complex;
pub mod intrinsic_mesh;
pub mod triangle;

pub use delaunay::flip_to_delaunay;
pub use delta_complex::{DeltaComplex, NO_HALFEDGE, TopologyError};
pub use intrinsic_mesh::{IntrinsicMesh, IntrinsicMeshError, Mollification};
