//! From a file, or from memory, to a surface that can be learned, whatever represents it.
//!
//! What a file is, its content decides, unless [`OpenOptions::kind`] names another kind. The formats of
//! [`ndf_formats::sniff()`] are asked in its order, with snapshots of instant-ngp before them, which name themselves,
//! and bare numbers last, which only their count tells. To add a representation: a [`Kind`], a file here with its
//! `Representation`, and a line in `representation`.

mod cloud;
mod content;
mod error;
mod mesh;
mod network;
mod splats;

use std::path::{Path, PathBuf};

use ndf_core::{NoProgress, Progress};
use ndf_formats::point_cloud::{CloudOptions, PointCloud};
use ndf_formats::splats::splats_of_tensors;
use ndf_formats::{Format, sniff};
use ndf_mesh::TriangleMesh;
use ndf_mesh::io::{MeshFormat, Signature};
use ndf_mesh::repair::{Parts, RepairOptions};
use ndf_model::Model;
use ndf_surfaces::networks::{NetworkOptions, NeuralField, is_snapshot};
use ndf_train::Checkpoint;

pub use cloud::cloud_notes;
pub use error::OpenError;
pub use network::read_latent;

use crate::describe::{CheckpointDescription, Described, Description, ModelDescription};
use crate::kind::Kind;
use crate::note::Note;
use crate::opened::Opened;
use crate::presets::MIN_PART;
pub(crate) use content::Content;

/// How a surface is to be understood.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenOptions {
    /// What it is, where its content should not decide.
    pub kind: Option<Kind>,
    /// The level of the surface, where it is that of a field: a density, an occupancy or a distance. By rule if `None`.
    pub level: Option<f64>,
    /// What is to be said of a network that its file does not say.
    pub network: NetworkOptions,
    /// How files of points are to be read.
    pub cloud: CloudOptions,
    /// Which components are kept, of meshes and of isosurfaces, and whether the seams of meshes are joined.
    pub repair: RepairOptions,
}

impl Default for OpenOptions {
    /// What the content tells, without parts of less than a thousandth of the area.
    fn default() -> Self {
        let repair = RepairOptions { parts: Parts::Above(MIN_PART), ..RepairOptions::default() };
        Self {
            kind: None,
            level: None,
            network: NetworkOptions::default(),
            cloud: CloudOptions::default(),
            repair,
        }
    }
}

/// Representations that share their files.
trait Representation: Sync {
    /// The kinds it can open.
    fn kinds(&self) -> &'static [Kind];

    /// Opens a file, as the kind that the options ask for or that its content tells. The bytes are given up when what they hold is
    /// known, for they may be a large part of the memory that is there.
    fn open(
        &self,
        content: Content,
        options: &OpenOptions,
        progress: &dyn Progress,
    ) -> Result<Opened, OpenError>;

    /// What a file holds.
    fn describe(&self, content: &Content, options: &OpenOptions) -> Result<Described, OpenError>;
}

/// All representations.
static REPRESENTATIONS: [&dyn Representation; 4] =
    [&mesh::Meshes, &network::Networks, &splats::Splats, &cloud::Clouds];

/// The representation that opens a file. What none recognises is left to that of meshes, to say what is wrong with it.
fn representation(
    content: &Content,
    options: &OpenOptions,
) -> Result<&'static dyn Representation, OpenError> {
    let bytes = &content.bytes;
    let foreign = |what| OpenError::Foreign { name: content.name(), what };
    if let Some(kind) = options.kind {
        if let Some(Signature::Foreign(what)) = Signature::of(bytes) {
            return Err(foreign(what));
        }
        let opens = |representation: &&&dyn Representation| representation.kinds().contains(&kind);
        return Ok(*REPRESENTATIONS.iter().find(opens).unwrap_or(&REPRESENTATIONS[0]));
    }
    if is_snapshot(bytes) {
        return Ok(&network::Networks);
    }
    Ok(match sniff(bytes) {
        Some(Format::Foreign(what)) => return Err(foreign(what)),
        Some(Format::Tensors(_)) if content.tensors().is_ok_and(|file| splats_of_tensors(file).is_some()) => {
            &splats::Splats
        }
        Some(Format::Tensors(_)) => &network::Networks,
        Some(Format::Splats(_)) => &splats::Splats,
        Some(Format::Cloud(_)) => &cloud::Clouds,
        // Counts of OFF without its keyword may be those of a cloud.
        Some(Format::Mesh(MeshFormat::Off)) | None if options.cloud.columns.is_some() => &cloud::Clouds,
        None if NeuralField::from_flat_file(bytes, &options.network).is_some() => &network::Networks,
        _ => &mesh::Meshes,
    })
}

/// Options of texts of points, and of LAS.
const COLUMNS: &str = "the columns of texts of points (--columns)";
const KEEP_FLAGGED: &str = "what is done with points that LAS files mark as noise (--keep-flagged)";

/// Notes of options that say nothing of what is opened as one of these kinds; no kinds are those of a model.
pub fn unused(options: &OpenOptions, kinds: &[Kind]) -> Vec<Note> {
    let is_cloud = kinds.contains(&Kind::Cloud);
    let has_level = kinds.contains(&Kind::Nerf) || kinds.contains(&Kind::Splats);
    let all = [
        (COLUMNS, options.cloud.columns.is_some() && !is_cloud),
        (KEEP_FLAGGED, options.cloud.keep_flagged && !is_cloud),
        (
            "what a network is (--activation, --omega, --box, --latent)",
            options.network != NetworkOptions::default() && !kinds.contains(&Kind::NeuralSdf),
        ),
        ("the level of a field (--iso)", options.level.is_some() && !has_level),
    ];
    all.into_iter().filter(|(_, is_unused)| *is_unused).map(|(what, _)| Note::OptionUnused { what }).collect()
}

/// What a file is that is no model, if it is known.
pub(crate) fn kind_in_words(content: &Content) -> Option<&'static str> {
    let bytes = &content.bytes;
    if Checkpoint::is_checkpoint(bytes) {
        return Some("a checkpoint");
    }
    if is_snapshot(bytes) {
        return Some("a network");
    }
    match sniff(bytes) {
        Some(Format::Splats(_)) => Some("a file of Gaussian splats"),
        Some(Format::Tensors(_)) if content.tensors().is_ok_and(|file| splats_of_tensors(file).is_some()) => {
            Some("a file of Gaussian splats")
        }
        Some(Format::Tensors(_)) => Some("a network"),
        Some(Format::Cloud(_)) => Some("a point cloud"),
        Some(Format::Mesh(_)) => Some("a mesh"),
        None if NeuralField::from_flat_file(bytes, &NetworkOptions::default()).is_some() => Some("a network"),
        _ => None,
    }
}

/// Opens a surface of any kind. Clouds without normals take some seconds; see [`open_with`] to watch.
///
/// ```no_run
/// let scan = ndf::open("scan.e57", &ndf::OpenOptions::default())?;
/// for note in &scan.notes {
///     eprintln!("{note}");
/// }
/// # Ok::<(), ndf::OpenError>(())
/// ```
///
/// # Errors
/// If the file is of no known kind, is malformed, or holds no usable surface.
pub fn open(path: impl AsRef<Path>, options: &OpenOptions) -> Result<Opened, OpenError> {
    open_with(path, options, &NoProgress)
}

/// As [`open`], with an observer that can stop it.
///
/// # Errors
/// As [`open`], and [`OpenError::Cancelled`].
pub fn open_with(
    path: impl AsRef<Path>,
    options: &OpenOptions,
    progress: &dyn Progress,
) -> Result<Opened, OpenError> {
    open_content(Content::read(path.as_ref())?, options, progress)
}

/// As [`open_with`], of the bytes of a file. The path names them in messages.
///
/// # Errors
/// As [`open_with`].
pub fn open_bytes(
    bytes: Vec<u8>,
    path: impl Into<PathBuf>,
    options: &OpenOptions,
    progress: &dyn Progress,
) -> Result<Opened, OpenError> {
    open_content(Content::new(path.into(), bytes), options, progress)
}

fn open_content(
    content: Content,
    options: &OpenOptions,
    progress: &dyn Progress,
) -> Result<Opened, OpenError> {
    if Model::is_model(&content.bytes) {
        return Err(OpenError::Model { name: content.name() });
    }
    let representation = representation(&content, options)?;
    let path = content.path.clone();
    let mut opened = representation.open(content, options, progress)?;
    opened.notes.splice(0..0, unused(options, representation.kinds()));
    Ok(Opened { path: Some(path), parts: options.repair.parts, ..opened })
}

/// Examines a file: a surface of any kind, a model, or a checkpoint. Costs no more than reading it and, for a mesh, its checks; for a
/// cloud with normals, neighbours of all points.
///
/// # Errors
/// If it cannot be read, or is of no known kind or malformed.
pub fn describe(path: impl AsRef<Path>, options: &OpenOptions) -> Result<Described, OpenError> {
    let content = Content::read(path.as_ref())?;
    if Checkpoint::is_checkpoint(&content.bytes) {
        let checkpoint = Checkpoint::from_bytes(&content.bytes)
            .map_err(|source| OpenError::CheckpointFile { path: content.path.clone(), source })?;
        let description = Description::Checkpoint(CheckpointDescription::of(&checkpoint));
        return Ok(Described { description, notes: unused(options, &[]) });
    }
    if !Model::is_model(&content.bytes) {
        let representation = representation(&content, options)?;
        let mut described = representation.describe(&content, options)?;
        described.notes.splice(0..0, unused(options, representation.kinds()));
        return Ok(described);
    }
    let model = Model::from_bytes(&content.bytes)
        .map_err(|source| OpenError::ModelFile { path: content.path.clone(), source })?;
    let description = Description::Model(ModelDescription::of(&model));
    Ok(Described { description, notes: unused(options, &[]) })
}

/// A mesh of any quality as a surface.
///
/// # Errors
/// If it has no face with an area.
pub fn open_mesh(mesh: TriangleMesh) -> Result<Opened, OpenError> {
    open_mesh_with(mesh, &OpenOptions::default().repair)
}

/// As [`open_mesh`], with a choice of components and seams.
///
/// # Errors
/// As [`open_mesh`], or if more than a twentieth of its area cannot be used and all of it is wanted.
pub fn open_mesh_with(mesh: TriangleMesh, options: &RepairOptions) -> Result<Opened, OpenError> {
    Ok(Opened { parts: options.parts, ..mesh::opened(mesh, options, "the mesh")? })
}

/// Points as a surface: with their normals, where they have some that agree, or where `kind` says so; else without.
///
/// # Errors
/// If `kind` asks for normals that are not there, or the observer asks to stop.
pub fn open_cloud(
    cloud: &PointCloud,
    kind: Option<Kind>,
    progress: &dyn Progress,
) -> Result<Opened, OpenError> {
    cloud::opened(cloud.clone(), kind, "the cloud", Vec::new(), progress)
}
