//! Why a surface could not be opened.

use std::path::PathBuf;

use ndf_formats::point_cloud;
use ndf_formats::splats::SplatError;
use ndf_formats::tensors::TensorError;
use ndf_mesh::{Vertex, io};
use ndf_model::file::ModelError;
use ndf_surfaces::EmptyMesh;
use ndf_surfaces::networks::LayoutError;
use ndf_surfaces::splats::NoSplats;
use ndf_train::CheckpointError;

use crate::kind::Kind;
use crate::left_out::LeftOut;
use crate::range::OutOfRange;
use crate::text::without_faces;

/// What can be read, for files of no known kind.
const KINDS: &str = "known are meshes from OBJ, PLY, STL, OFF and glTF, clouds from PLY, XYZ, PWN, PTS, PTX, PCD, E57, LAS and LAZ, \
                     networks from PyTorch, safetensors, NumPy, HDF5 and MessagePack, splats from PLY, SPZ, SOG, GLB, PyTorch, .splat and .ksplat";

/// Why a surface could not be opened. Every message names the file, or what stands for it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is a model.
    #[error("{name} is a model already")]
    Model {
        /// The file.
        name: String,
    },
    /// The file is a model, and damaged.
    #[error("cannot read {}: {source}", path.display())]
    ModelFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: ModelError,
    },
    /// The file is a checkpoint, and damaged.
    #[error("{} is {source}", path.display())]
    CheckpointFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: CheckpointError,
    },
    /// The file is of no known kind.
    #[error("{name} is of no known kind: {reason}; {KINDS}")]
    Unrecognised {
        /// The file.
        name: String,
        /// What was seen instead.
        reason: &'static str,
    },
    /// The file is of a format that nothing here reads, or something else stands in its place.
    #[error("{name} is {what}")]
    Foreign {
        /// The file.
        name: String,
        /// What it is.
        what: &'static str,
    },
    /// The mesh file could not be read.
    #[error(transparent)]
    MeshFile(#[from] io::ReadError),
    /// A vertex is so far away that nothing can be computed with it.
    #[error(
        "{name}: vertex {vertex} lies beyond 1e75, where lengths cannot be computed any more; scale it down"
    )]
    TooFar {
        /// The file.
        name: String,
        /// The vertex, counted from 0.
        vertex: Vertex,
    },
    /// Points of a cloud lie so far out, or so close together, that lengths cannot be computed any more.
    #[error("{name}: {source}")]
    Range {
        /// The file.
        name: String,
        /// How large they are.
        source: OutOfRange,
    },
    /// The mesh has no faces.
    #[error(
        "{name} {}; a mesh with at least one face is needed here",
        without_faces(*.vertices)
    )]
    NoFaces {
        /// The file.
        name: String,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// No face of the mesh has an area and finite corners.
    #[error("{name}: no face has an area and finite corners")]
    NoArea {
        /// The file.
        name: String,
    },
    /// The mesh has one side.
    #[error(
        "{name} cannot be oriented: there is a Möbius strip in it, and without an inner and an outer side it is not learned"
    )]
    OneSided {
        /// The file.
        name: String,
    },
    /// Too much of the mesh would be left out.
    #[error("{name}: {source}")]
    LeftOut {
        /// The file.
        name: String,
        /// How much.
        source: LeftOut,
    },
    /// No surface can be made of the mesh.
    #[error("{name}: {source}")]
    EmptyMesh {
        /// The file.
        name: String,
        /// Why.
        source: EmptyMesh,
    },
    /// The file of points could not be read.
    #[error(transparent)]
    CloudFile(#[from] point_cloud::ReadError),
    /// Normals were asked for, and the points have none.
    #[error("{name} has no usable normals")]
    NoNormals {
        /// The file.
        name: String,
    },
    /// The file of tensors could not be read.
    #[error("{name}: {source}")]
    Tensors {
        /// The file.
        name: String,
        /// Why.
        source: TensorError,
    },
    /// Another of the shards in which a network is kept cannot be read.
    #[error("{name} is a part of a network, and {} cannot be read: {source}", other.display())]
    Shard {
        /// The file.
        name: String,
        /// The other shard.
        other: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file holds no network.
    #[error("{name} is not a PyTorch, safetensors, NumPy, HDF5 or instant-ngp file")]
    NoNetwork {
        /// The file.
        name: String,
    },
    /// The network has no known layout, or a damaged one.
    #[error("{name}: {source}")]
    Layout {
        /// The file.
        name: String,
        /// Why.
        source: LayoutError,
    },
    /// The file holds a table instead of a network.
    #[error("{name} holds a table, perhaps of latent codes, instead of a network")]
    Table {
        /// The file.
        name: String,
    },
    /// The file has no latent code with this number.
    #[error("{name} has no code number {row}")]
    NoCode {
        /// The file.
        name: String,
        /// The number.
        row: usize,
    },
    /// A network of distances was opened as a density, or the reverse.
    #[error("{name} is of the kind {found}, not {asked}")]
    OtherKind {
        /// The file.
        name: String,
        /// What it is.
        found: Kind,
        /// What it was opened as.
        asked: Kind,
    },
    /// The file of splats could not be read.
    #[error("{name}: {source}")]
    SplatFile {
        /// The file.
        name: String,
        /// Why.
        source: SplatError,
    },
    /// No density can be made of the splats.
    #[error("{name}: {source}")]
    NoSplats {
        /// The file.
        name: String,
        /// Why.
        source: NoSplats,
    },
    /// The observer asked to stop.
    #[error("{name}: interrupted while its normals were being estimated")]
    Cancelled {
        /// The file.
        name: String,
    },
}
