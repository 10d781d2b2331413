//! Base meshes: from a scalar field or a fine mesh to a coarse, well-shaped manifold close to it.
//!
//! [`marching_cubes`] makes a manifold of the level set of any [`ScalarField`](ndf_core::ScalarField), and
//! [`decimate`] leaves as many of its faces as are asked for.

pub mod decimation;
mod halfedge_mesh;
pub mod marching_cubes;
mod quadric;
pub mod triangle_shape;

pub use decimation::{Decimated, DecimationOptions, decimate};
pub use marching_cubes::{Isosurface, IsosurfaceError, MarchingCubesOptions, marching_cubes};
