//! Triangle meshes: as read ([`TriangleMesh`]), examined ([`ValidationReport`]), mended ([`repair`]) and proven
//! ([`ManifoldMesh`]); their files ([`io`]), [closest points and rays](triangle_tree), [sampling], [quality] and
//! [distances](metrics).

mod face_point;
pub mod halfedge;
pub mod hierarchy;
pub mod io;
mod manifold;
pub mod metrics;
pub mod quality;
pub mod repair;
pub mod sampling;
pub mod shapes;
pub mod surface_point;
mod triangle_mesh;
pub mod triangle_tree;
mod validation;

pub use face_point::FacePoint;
pub use halfedge::{NO_HALFEDGE, Topology, TopologyError};
pub use manifold::{ManifoldMesh, NotManifold};
pub use surface_point::SurfacePoint;
pub use triangle_mesh::{FaceIndexOutOfRange, TriangleMesh};
pub use triangle_tree::{ClosestPoint, RayHit, TriangleTree};
pub use validation::{Defect, ValidationReport};
