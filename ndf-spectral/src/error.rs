//! What can go wrong.

use ndf_core::Cancelled;

use crate::modes::Modes;

/// Why a spectral computation failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpectralError {
    /// More modes were asked for than there are vertices.
    #[error("{asked} modes requested, but the surface has only {vertices} vertices")]
    TooManyModes {
        /// How many were asked for.
        asked: usize,
        /// How many vertices, hence modes, there are.
        vertices: usize,
    },
    /// No vertex is free.
    #[error("the values of all vertices are held, so that there are no modes")]
    AllHeld,
    /// The shift is not a positive number.
    #[error("the shift must be a positive number, not {0}")]
    Shift(f64),
    /// A parameter that must be a positive number is not.
    #[error("{name} must be a positive number, not {value}")]
    NotPositive {
        /// Which parameter.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A vertex has no area around it: no face, or only faces without area.
    #[error("vertex {0} has no area around it")]
    NoArea(usize),
    /// No face has an area: all vertices lie on a line or in a point, or the areas are too small for numbers.
    #[error("the surface has no area, so that it has no Laplacian")]
    NoSurface,
    /// An entry of the operator is not finite: a face without area.
    #[error("the operator is not finite at vertex {0}: the area of a face there is zero or not finite")]
    NotFinite(usize),
    /// The shifted operator is not numerically positive definite.
    #[error("the shifted operator is not positive definite: the mesh is too distorted for double precision")]
    NotPositiveDefinite,
    /// The operator hardly tells functions apart: a few faces have nearly all of the area.
    #[error(
        "the operator is degenerate: a few faces have nearly all of the area; remove vertices that are far away"
    )]
    Degenerate,
    /// There is not enough memory for the factorisation.
    #[error("not enough memory to factorise a matrix of {0} rows")]
    OutOfMemory(usize),
    /// The iteration ended before all modes converged.
    #[error("{} of {asked} modes converged in {applications} applications of the operator", found.len())]
    NotConverged {
        /// The modes that converged, ascending.
        found: Box<Modes>,
        /// How many were asked for.
        asked: usize,
        /// Vectors to which the inverse operator was applied.
        applications: usize,
    },
    /// An iterative solve did not reach its tolerance.
    #[error("the solve stopped at a relative residual of {0:.1e}")]
    SolveNotConverged(f64),
    /// The observer stopped the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
