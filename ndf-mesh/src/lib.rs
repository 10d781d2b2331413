//! Triangle meshes: as read ([`TriangleMesh`]), examined ([`ValidationReport`]), repaired ([`repair`]) and proven
//! ([`ManifoldMesh`]); their files ([`io`]), [closest points and rays](triangle_tree), [sampling], [quality],
//! [distances](metrics) and [self-intersections](SelfIntersections).
//!
//! [`Topology`] is the half-edge connectivity of them all, and of intrinsic triangulations: twins, fans, checks,
//! edits. Its elements are a [`Vertex`], an [`Edge`], a [`Face`] and a [`Halfedge`]: [indices](index) that cannot be mixed
//! up. A [`FacePoint`] is a point of a face, a [`SurfacePoint`] one of a vertex, an edge or a face.
//!
//! ```
//! use ndf_core::{DVec3, Hint};
//! use ndf_mesh::{ManifoldMesh, TriangleTree, shapes};
//!
//! let sphere = ManifoldMesh::try_from(shapes::icosphere(4))?;
//! assert_eq!(sphere.topology().euler_characteristic(), 2);
//! let tree = TriangleTree::new(&sphere);
//! let closest = tree.closest_point(DVec3::new(0.0, 0.0, 3.0), Hint::NONE).expect("the tree has faces");
//! assert!((closest.point.z - 1.0).abs() < 0.01);
//! assert!(closest.at.position(&sphere).distance(closest.point) < 1e-12);
//! # Ok::<(), ndf_mesh::NotManifold>(())
//! ```

pub mod colour_map;
mod face_point;
pub mod halfedge;
pub mod hierarchy;
pub mod index;
pub mod io;
mod manifold;
pub mod metrics;
mod places;
pub mod quality;
pub mod repair;
pub mod sampling;
mod self_intersections;
pub mod shapes;
mod sides;
pub mod subdivision;
pub mod surface_point;
mod triangle_mesh;
pub mod triangle_tree;
mod validation;
mod z_curve;

pub use colour_map::ColourMap;
pub use face_point::FacePoint;
pub use halfedge::{NO_HALFEDGE, Topology, TopologyError};
pub use index::{Edge, Face, Halfedge, Vertex};
pub use manifold::{ManifoldMesh, NotManifold};
pub use places::first_in_place;
pub use self_intersections::SelfIntersections;
pub use sides::Sides;
pub use surface_point::SurfacePoint;
pub use triangle_mesh::{FaceIndexOutOfRange, TriangleMesh};
pub use triangle_tree::{ClosestPoint, RayHit, TriangleTree};
pub use validation::{Defect, ValidationReport};
pub use z_curve::{Z_CURVE_DIGITS, z_curve_place};
