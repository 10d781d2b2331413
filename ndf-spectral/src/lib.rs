//! Laplace–Beltrami operators of triangulated surfaces, their eigenmodes, and what the modes are for.
//!
//! [`LaplaceBeltrami`] assembles the cotangent Laplacian and a mass matrix from edge lengths alone, by default on the
//! intrinsic Delaunay triangulation; meshes that are no manifolds go through the [tufted cover](tufted_cover).
//! [`modes`](modes()) solves L φ = λ M φ for the smallest eigenvalues by shift-invert block Lanczos with thick restart
//! over a supernodal Cholesky factor, and makes sure that none is missing. [`Modes`] gives heat and wave kernel
//! signatures, spectral distances and filters; [`ScreenedPoisson`] solves Poisson and heat equations with the
//! factorization that modes use.
//!
//! All sums run in a fixed order: the number of threads changes no digit of the iteration, only of the factor.

mod assembly;
pub mod components;
mod dense;
pub mod distances;
pub mod error;
pub mod factorization;
pub mod filtering;
mod krylov;
pub mod laplace_beltrami;
pub mod laplacian;
pub mod mass;
pub mod modes;
mod orthonormal;
mod panel;
pub mod screened_poisson;
pub mod signatures;
mod simd;
mod triangular;
pub mod triangulation;
pub mod tufted_cover;

pub use distances::SpectralDistance;
pub use error::SpectralError;
pub use laplace_beltrami::{LaplaceBeltrami, OperatorOptions};
pub use mass::Mass;
pub use modes::{ModeOptions, Modes, modes};
pub use screened_poisson::ScreenedPoisson;
