//! What can go wrong.

use ndf_core::Cancelled;
use ndf_mesh::SurfacePoint;

/// Why there are no distances, or no path.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GeodesicError {
    /// No source was given.
    #[error("geodesic distances need a source")]
    NoSource,
    /// A source, target or query is not a point of the mesh.
    #[error("{point} is not a point of the mesh")]
    NotOnMesh {
        /// The point.
        point: SurfacePoint,
    },
    /// Faces are so slender that the wavefront does not come to an end.
    #[error(
        "the faces are too slender for exact distances: more than {windows} windows were made; \
         remesh the surface, or use the heat method"
    )]
    TooManyWindows {
        /// The most that are made on such a mesh.
        windows: u64,
    },
    /// The observer stopped the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A query needs the windows, but they were not kept.
    #[error("distances inside faces and paths are computed from windows, which were not kept")]
    WindowsNotKept,
    /// A path was asked for to a point that no source reaches.
    #[error("no source reaches {point}")]
    Unreached {
        /// The point.
        point: SurfacePoint,
    },
    /// A path could not be followed back: edge lengths are too far from those of a surface.
    #[error(
        "the shortest path to {point} is lost in faces that are too slender for its lengths; its distance is known"
    )]
    PathLost {
        /// Where it led.
        point: SurfacePoint,
    },
    /// A direction is not finite.
    #[error("{0:?} is no direction")]
    Direction([f64; 2]),
    /// The time step of the heat method is not a positive number.
    #[cfg(feature = "heat")]
    #[error("the time step must be a positive number of squared mean edge lengths, not {0}")]
    TimeStep(f64),
    /// The matrices of the heat method could not be assembled or factorised.
    #[cfg(feature = "heat")]
    #[error(transparent)]
    Matrices(#[from] ndf_spectral::SpectralError),
}
