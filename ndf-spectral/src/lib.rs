//! Laplace–Beltrami operators of triangulated surfaces, their eigenmodes, and what the modes are for.
//!
//! [`LaplaceBeltrami`] assembles the cotangent Laplacian and a mass matrix from edge lengths alone, by default on the
//! intrinsic Delaunay triangulation; meshes that are not manifold go through the [tufted cover](TuftedCover).
//! [`modes`] solves L φ = λ M φ for the smallest eigenvalues by shift-invert block Lanczos with thick restart
//! over a supernodal Cholesky factor, and checks that none is missing. [`Modes`] gives heat and wave kernel
//! signatures, spectral distances and filters; [`ScreenedPoisson`] solves Poisson and heat equations with the
//! factorisation that modes use. [`HeatFlow`] follows heat through time, with insulated boundaries or values that are held.
//!
//! ```
//! use ndf_core::NoProgress;
//! use ndf_intrinsic::IntrinsicMesh;
//! use ndf_mesh::{ManifoldMesh, shapes};
//! use ndf_spectral::{ModeOptions, modes};
//!
//! let sphere = ManifoldMesh::try_from(shapes::icosphere(3)).expect("a sphere is a manifold");
//! let options = ModeOptions { count: 9, ..ModeOptions::default() };
//! let modes = modes(&IntrinsicMesh::from_mesh(&sphere), &options, &NoProgress)?;
//! // Eigenvalues of the unit sphere are l (l + 1), each 2l + 1 times.
//! for (found, exact) in modes.eigenvalues.iter().zip([0.0, 2.0, 2.0, 2.0, 6.0, 6.0, 6.0, 6.0, 6.0]) {
//!     assert!((found - exact).abs() < 0.1);
//! }
//! assert_eq!(modes.mode(1).len(), sphere.vertex_count());
//! let signatures = modes.heat_kernel_signatures(&modes.heat_times(16));
//! assert_eq!(signatures.len(), 16);
//! # Ok::<(), ndf_spectral::SpectralError>(())
//! ```
//!
//! All sums run in a fixed order: the number of threads changes no digit of the iteration, only of the factor.

mod assembly;
mod components;
mod csr;
mod dense;
mod distances;
mod error;
mod factorisation;
mod filtering;
mod found;
mod heat_flow;
mod krylov;
mod laplace_beltrami;
mod laplacian;
mod mass;
mod modes;
mod multigrid;
mod orthonormal;
mod panel;
mod scalar;
mod screened_poisson;
mod signatures;
mod simd;
mod slices;
mod solver;
mod triangles;
mod triangular;
mod tufted_cover;
mod vertex_functions;

pub use components::Components;
pub use csr::{CsrError, CsrMatrix};
pub use distances::SpectralDistance;
pub use error::SpectralError;
pub use factorisation::{Cholesky, SymbolicCholesky};
pub use heat_flow::HeatFlow;
pub use laplace_beltrami::{LaplaceBeltrami, OperatorOptions};
pub use mass::Mass;
pub use modes::{Inversion, ModeOptions, Modes, modes};
pub use scalar::Scalar;
pub use screened_poisson::ScreenedPoisson;
pub use triangles::MetricTriangles;
pub use tufted_cover::TuftedCover;
pub use vertex_functions::VertexFunctions;

/// Linear algebra, re-exported so that users need not match versions.
pub use faer;
#[cfg(feature = "nalgebra")]
pub use nalgebra_sparse;
