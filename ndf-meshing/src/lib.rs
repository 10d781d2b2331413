//! Base meshes: from a scalar field or a fine mesh to a coarse, well-shaped manifold close to it.
//!
//! [`marching_cubes`] makes a manifold of the level set of any [`ScalarField`](ndf_core::ScalarField).

pub mod marching_cubes;

pub use marching_cubes::{Isosurface, IsosurfaceError, MarchingCubesOptions, marching_cubes};
