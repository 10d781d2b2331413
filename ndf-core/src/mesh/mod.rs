//! Triangle meshes: as read ([`TriangleMesh`]), examined ([`ValidationReport`]), mended ([`repair`]) and
//! proven ([`ManifoldMesh`]).

mod manifold;
pub mod repair;
pub mod shapes;
mod triangle_mesh;
mod validation;

pub use manifold::{ManifoldMesh, NO_HALFEDGE, NotManifold};
pub use triangle_mesh::{FaceIndexOutOfRange, TriangleMesh};
pub use validation::{Defect, ValidationReport};
