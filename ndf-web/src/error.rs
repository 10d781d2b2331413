//! What can go wrong.

use ndf::DistanceError;
use ndf::text::{grouped, readable};
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
    /// The edge length asks for more triangles than memory holds.
    #[error(
        "this edge length needs more than {} triangles; the shortest possible is about {}",
        grouped(*max_faces),
        readable(*shortest)
    )]
    TooFine {
        /// How many triangles are extracted at most.
        max_faces: usize,
        /// About the shortest edge length, in the unit that was asked in.
        shortest: f64,
    },
    /// The edge length is no positive number, or the field is not finite.
    #[error(transparent)]
    Extraction(#[from] ndf::ExtractionError),
    /// There are no distances or paths.
    #[error(transparent)]
    Distances(#[from] DistanceError),
    /// The modes would fill the memory.
    #[error("{} modes of {} vertices do not fit into memory; at most {} do", grouped(*asked), grouped(*vertices), grouped(*most))]
    TooManyModes {
        /// How many were asked for.
        asked: usize,
        /// The vertices at which they have values.
        vertices: usize,
        /// How many there can be.
        most: usize,
    },
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
