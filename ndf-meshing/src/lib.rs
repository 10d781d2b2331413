//! Base meshes: from a scalar field or a fine mesh to a coarse, well-shaped manifold close to it.
//!
//! [`marching_cubes()`] makes a manifold of the level set of any [`ImplicitField`](ndf_core::ImplicitField), [`decimate`]
//! leaves as many of its faces as are asked for, and [`improve`] improves their shapes. [`base_mesh()`] does all of it.
//! [`remesh_isotropically`] makes meshes of one edge length. [`decimate_within`] and [`remesh_within`] go as far as a distance
//! allows.
//!
//! ```
//! use ndf_core::NoProgress;
//! use ndf_mesh::{ManifoldMesh, shapes};
//! use ndf_meshing::{DecimationOptions, decimate};
//!
//! let fine = ManifoldMesh::try_from(shapes::torus(60, 30, 1.0, 0.4))?;
//! let coarse = decimate(&fine, &DecimationOptions::to_faces(400), &NoProgress);
//! assert!(coarse.reached && coarse.mesh.topology().euler_characteristic() == 0);
//! # Ok::<(), ndf_mesh::NotManifold>(())
//! ```

pub mod base_mesh;
pub mod decimation;
mod editable_mesh;
pub mod isotropic;
pub mod marching_cubes;
mod original;
mod quadric;
pub mod remeshing;
pub mod triangle_shape;
pub mod within;

pub use base_mesh::{
    BaseMesh, BaseMeshError, BaseMeshOptions, BaseMeshReport, base_mesh, base_mesh_of_manifold,
};
pub use decimation::{Decimated, DecimationOptions, decimate};
pub use editable_mesh::{Constraint, EditableMesh};
pub use isotropic::{IsotropicError, IsotropicOptions, remesh_isotropically, split_edges};
pub use marching_cubes::{Isosurface, IsosurfaceError, MarchingCubesOptions, marching_cubes};
pub use quadric::Quadric;
pub use remeshing::{FinalPassOptions, Improved, Target, improve};
pub use within::{WithinError, decimate_within, remesh_within};
