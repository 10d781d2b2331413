//! Geodesic distances and shortest paths on intrinsic triangulations, hence on any mesh.
//!
//! - [`exact_distances`]: exact polyhedral distances from any number of points, by windows (Mitchell, Mount
//!   and Papadimitriou 1987) that cross faces in whole lists (Qin et al. 2016); distances at any point and
//!   shortest paths back from the windows, when they are kept.
//! - [`straightest_geodesic`]: the other way around, from a point in a direction (Polthier and Schmies 1998).
//! - [`geodesic_through`]: geodesics that wind as a path or a loop does (Sharp and Crane 2020).
//! - `HeatSolver`, with the feature `heat`: smooth approximate distances, many sources for one factorisation
//!   (Crane, Weischedel and Wardetzky 2013). The page of the module `heat` says when to use which.
//!
//! ```
//! use ndf_core::NoProgress;
//! use ndf_geodesic::{ExactOptions, exact_distances};
//! use ndf_intrinsic::IntrinsicMesh;
//! use ndf_mesh::{Face, FacePoint, ManifoldMesh, SurfacePoint, Vertex, shapes};
//!
//! let cube = ManifoldMesh::try_from(shapes::cube(1)).expect("a cube is a manifold");
//! let mesh = IntrinsicMesh::from_mesh(&cube);
//! let source = SurfacePoint::Face(FacePoint { face: Face(0), barycentric: [0.5, 0.5, 0.0] });
//! let geodesics = exact_distances(&mesh, &[source], &ExactOptions::with_windows(), &NoProgress)?;
//! assert_eq!(geodesics.unreached(), 0);
//! let path = geodesics.path_to(SurfacePoint::Vertex(Vertex(7)))?;
//! assert_eq!(path.length, geodesics.distances()[7]);
//! # Ok::<(), ndf_geodesic::GeodesicError>(())
//! ```

// How windows travel: they wait in lists (envelope.rs) at the half-edges through which they enter faces (windows.rs).
// The wavefront (propagation.rs) takes the nearest list, lets the edge's vertices rule out what they can, carries it
// across the face (unfolding.rs) and adds the two lists that result to those waiting there. Vertices that it reaches
// become pseudo-sources (pseudo_sources.rs) where shortest paths can bend.

mod edge_path;
mod envelope;
mod error;
mod exact;
mod front;
#[cfg(feature = "heat")]
pub mod heat;
mod joints;
mod paths;
mod pending;
mod propagation;
mod pseudo_sources;
mod queries;
mod round;
mod sources;
mod straightening;
mod straightest;
mod unfolding;
mod windows;

pub use error::GeodesicError;
pub use exact::{ExactOptions, Geodesics, exact_distances};
#[cfg(feature = "heat")]
pub use heat::{HeatDistances, HeatSolver};
pub use paths::Path;
pub use propagation::ExactReport;
pub use straightening::{StraightenedPath, ThroughOptions, geodesic_through};
pub use straightest::{StraightestGeodesic, straightest_geodesic};
