//! The methods that the experiments of ndf compare with, each written from its paper.
//!
//! [`occupancy_dual_contouring`] makes sharp meshes of fields of which only inside and outside are known.
//! [`spectral_simplification`] decimates meshes so that the eigenvalues of their Laplacians stay what they are.
//! [`micromesh()`] makes coarse meshes with displacements of 11 bits.
//! [`NeuralDualContouring`] makes meshes of signed distances by a convolutional network.
//! [`NeuralGeometryField`] keeps a mesh as quadrilaterals with features and a small network.
//! [`refined_marching_cubes`] and [`remeshed_marching_cubes`] put the workspace's own remeshing after marching cubes.
//!
//! ```
//! use ndf_baselines::{OdcOptions, occupancy_dual_contouring};
//! use ndf_core::{NoProgress, analytic::Sphere};
//!
//! let options = OdcOptions { grid: 20, ..OdcOptions::default() };
//! let surface = occupancy_dual_contouring(&Sphere::UNIT, &options, &NoProgress)?;
//! assert!(surface.mesh.positions().iter().all(|p| (p.length() - 1.0).abs() < 0.01));
//! # Ok::<(), ndf_meshing::IsosurfaceError>(())
//! ```

#[cfg(test)]
mod fields;
mod greedy;
pub mod marching;
pub mod micromesh;
pub mod ndc;
pub mod ngf;
pub mod odc;
pub mod sms;

pub use marching::{MarchingError, RefinedIsosurface, refined_marching_cubes, remeshed_marching_cubes};
pub use micromesh::{Micromesh, MicromeshOptions, micromesh};
pub use ndc::{DualContour, NdcOptions, NeuralDualContouring};
pub use ngf::{LearnedNgf, NeuralGeometryField, NgfOptions};
pub use odc::{OdcOptions, occupancy_dual_contouring};
pub use sms::{SmsError, SmsOptions, SpectralSimplification, SpectrallySimplified, spectral_simplification};
