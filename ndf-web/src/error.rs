//! What can go wrong.

use ndf::DistanceError;
use ndf_mesh::io::gltf::NotGlb;
use ndf_mesh::io::{ReadError, WriteError};
use ndf_spectral::SpectralError;

/// Why something could not be opened, extracted or computed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// It begins as a model and is none.
    #[error("{name}: {source}")]
    Model {
        /// The file.
        name: String,
        /// What is wrong.
        source: ndf::ModelError,
    },
    /// It is no mesh file.
    #[error(transparent)]
    Mesh(#[from] ReadError),
    /// It has no faces.
    #[error("{name} has no faces; a model or a mesh with at least one face is needed here")]
    NoFaces {
        /// The file.
        name: String,
    },
    /// The mesh cannot be used.
    #[error(transparent)]
    Unusable(#[from] ndf::NoTriangulation),
    /// An edge length was given for a mesh.
    #[error("{name} is a mesh, which is taken as it is; only models have an edge length")]
    NoModel {
        /// The file.
        name: String,
    },
    /// The edge length asks for too much, or the field is not finite.
    #[error(transparent)]
    Extraction(#[from] ndf::ExtractionError),
    /// There are no distances or paths.
    #[error(transparent)]
    Distances(#[from] DistanceError),
    /// There are no modes.
    #[error(transparent)]
    Spectrum(#[from] SpectralError),
    /// There is no such scalar.
    #[error("there is no scalar {name}; there are [{names}]")]
    NoScalar {
        /// What was asked for.
        name: String,
        /// What there is.
        names: String,
    },
    /// The mesh cannot be written as PLY.
    #[error(transparent)]
    Ply(#[from] WriteError),
    /// The mesh cannot be written as binary glTF.
    #[error(transparent)]
    Glb(#[from] NotGlb),
}
