//! What can go wrong with fields.

use ndf_core::Cancelled;
use ndf_geodesic::GeodesicError;
use ndf_mesh::SurfacePoint;
use ndf_spectral::SpectralError;

/// Why there is no field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FieldError {
    /// The symmetry is not 1 to 16.
    #[error("a field of symmetry {0}; it should be 1 to 16")]
    Symmetry(u32),
    /// Lines of curvature have no sides.
    #[error("a field of symmetry {0} cannot follow lines of curvature, which have no sides; take 2 or 4")]
    OddSymmetry(u32),
    /// A value is not finite.
    #[error("a value is {0}")]
    NotFinite(f64),
    /// A field to align with has no directions.
    #[error("the field to align with vanishes everywhere")]
    NoAlignment,
    /// There is not one value for every vertex.
    #[error("{found} values for {expected} vertices")]
    Count {
        /// Values given.
        found: usize,
        /// Vertices of the mesh.
        expected: usize,
    },
    /// No source was given.
    #[error("there is no source")]
    NoSource,
    /// A point is not on the mesh.
    #[error("{point} is not on the mesh")]
    NotOnMesh {
        /// The point.
        point: SurfacePoint,
    },
    /// Two points of a curve that follow each other are in no common face.
    #[error("point {point} of curve {curve} and the next one are in no common face")]
    CurveLeavesFaces {
        /// Which curve, of those given.
        curve: usize,
        /// Which point of it.
        point: usize,
    },
    /// A frequency or a time is not positive.
    #[error("{name} must be positive, and is {value}")]
    NotPositive {
        /// What it is.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// The smallest eigenvector was not found.
    #[error("the smoothest field was not found: after {0} rounds its residual is {1:.1e}")]
    NotConverged(usize, f64),
    /// A linear system failed.
    #[error(transparent)]
    Operator(#[from] SpectralError),
    /// Distances failed.
    #[error(transparent)]
    Distances(#[from] GeodesicError),
    /// The observer asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
