//! From a file, or from memory, to a surface that can be learned, whatever represents it.
//!
//! What a file is, its content decides: the first [`Representation`] that recognises the content opens it, unless
//! [`OpenOptions::kind`] names another. To add a representation: a [`Kind`], a file here with its [`Representation`],
//! and a line in the list.

mod cloud;
mod content;
mod error;
mod mesh;
mod network;
mod splats;

use std::path::{Path, PathBuf};

use ndf_core::{NoProgress, Progress, Surface};
use ndf_formats::point_cloud::PointCloud;
use ndf_mesh::TriangleMesh;
use ndf_meshing::{IsosurfaceError, MarchingCubesOptions, marching_cubes};
use ndf_model::Model;
use ndf_surfaces::LevelSearch;
use ndf_surfaces::networks::Latent;
use serde::Serialize;

pub use error::OpenError;
pub use network::read_latent;

use crate::base::BaseSource;
use crate::describe::Described;
use crate::{Kind, Note};
pub(crate) use content::Content;

/// How a surface is to be understood.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpenOptions {
    /// What it is, where its content should not decide.
    pub kind: Option<Kind>,
    /// The level of the surface, where it is that of a field: a density, an occupancy or a distance. By rule if `None`.
    pub level: Option<f64>,
    /// The code of the shape, for a decoder of many.
    pub latent: Option<Latent>,
}

/// The level of a field that is learned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Level {
    /// Its value.
    pub value: f64,
    /// How it was chosen.
    pub rule: LevelRule,
}

/// How a level was chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum LevelRule {
    /// By [`OpenOptions::level`].
    Asked,
    /// The zero of a distance.
    Zero,
    /// That of the logarithm of the density, as instant-ngp meshes it.
    InstantNgp,
    /// Halves light within 1/100 of the box, or parts the densities best (Otsu) if that is less.
    Light,
    /// That of SuGaR's meshes, or half the typical density of opaque splats if that is less or where these are even.
    Sugar,
}

impl std::fmt::Display for LevelRule {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Asked => "as asked for",
            Self::Zero => "the zero of a distance",
            Self::InstantNgp => "of the logarithm of the density, as instant-ngp meshes it",
            Self::Light => "halves light within 1/100 of the box, or parts the densities best (Otsu) if less",
            Self::Sugar => {
                "as SuGaR's meshes, or half the typical density of opaque splats if less or where these are even"
            }
        })
    }
}

/// A surface that can be learned: what [`Fit`](crate::Fit) takes.
#[non_exhaustive]
pub struct Opened {
    /// The file it comes from, if it comes from one.
    pub path: Option<PathBuf>,
    /// What represents it. Decides on the [defaults](crate::presets).
    pub kind: Kind,
    /// What is learned.
    pub surface: Box<dyn Surface>,
    /// Where its base mesh comes from.
    pub base: BaseSource,
    /// The mesh it is known by, where it is a mesh.
    pub mesh: Option<TriangleMesh>,
    /// The level of its field, where that was to be chosen.
    pub level: Option<Level>,
    /// How the level of a cached copy of the field is searched, where projecting onto the field itself is costly.
    pub cached: Option<LevelSearch>,
    /// What was left out, changed or is doubtful.
    pub notes: Vec<Note>,
}

/// Representations that share their files.
trait Representation: Sync {
    /// The kinds it can open.
    fn kinds(&self) -> &'static [Kind];

    /// Whether a file is of this family, told from its beginning.
    fn recognises(&self, content: &Content) -> bool;

    /// Opens a file, as the kind that the options ask for or that its content tells.
    fn open(
        &self,
        content: &Content,
        options: &OpenOptions,
        progress: &dyn Progress,
    ) -> Result<Opened, OpenError>;

    /// What a file holds.
    fn describe(&self, content: &Content, options: &OpenOptions) -> Result<Described, OpenError>;
}

/// All representations, in the order in which they are asked. What none recognises is left to the first, to say what is
/// wrong with it.
static REPRESENTATIONS: [&dyn Representation; 4] =
    [&mesh::Meshes, &network::Networks, &splats::Splats, &cloud::Clouds];

/// The representation that opens a file.
fn representation(content: &Content, options: &OpenOptions) -> &'static dyn Representation {
    let fits = |representation: &&&dyn Representation| match options.kind {
        Some(kind) => representation.kinds().contains(&kind),
        None => representation.recognises(content),
    };
    *REPRESENTATIONS.iter().find(fits).unwrap_or(&REPRESENTATIONS[0])
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
    open_content(&Content::read(path.as_ref())?, options, progress)
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
    open_content(&Content { path: path.into(), bytes }, options, progress)
}

fn open_content(
    content: &Content,
    options: &OpenOptions,
    progress: &dyn Progress,
) -> Result<Opened, OpenError> {
    if Model::is_model(&content.bytes) {
        return Err(OpenError::Model { name: content.name() });
    }
    let opened = representation(content, options).open(content, options, progress)?;
    Ok(Opened { path: Some(content.path.clone()), ..opened })
}

/// What a file holds: a surface of any kind, or a model.
pub(crate) fn describe_content(content: &Content, options: &OpenOptions) -> Result<Described, OpenError> {
    representation(content, options).describe(content, options)
}

/// A mesh of any quality as a surface.
///
/// # Errors
/// If it has no face with an area.
pub fn open_mesh(mesh: TriangleMesh) -> Result<Opened, OpenError> {
    mesh::opened(mesh, "the mesh")
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
    cloud::opened(cloud, kind, "the cloud", Vec::new(), progress)
}

impl Opened {
    /// A surface of one's own. It is learned with the defaults of the kind it is `like`; its base mesh is made of its field,
    /// if it has one, and is to be given to [`Fit`](crate::Fit) otherwise.
    pub fn from_surface(surface: Box<dyn Surface>, like: Kind) -> Self {
        Self {
            path: None,
            kind: like,
            surface,
            base: BaseSource::OWN_FIELD,
            mesh: None,
            level: None,
            cached: None,
            notes: Vec::new(),
        }
    }

    /// A mesh that stands for the surface in comparisons and pictures: the mesh it is, or its isosurface on a grid of `cells`
    /// along the longest side.
    ///
    /// # Errors
    /// If it is no mesh and has no isosurface, or the observer asks to stop.
    pub fn reference(&self, cells: u32, progress: &dyn Progress) -> Result<TriangleMesh, NoReference> {
        match (&self.base, &self.mesh) {
            (BaseSource::Manifold(mesh), _) => Ok(TriangleMesh::clone(mesh)),
            (_, Some(mesh)) => Ok(mesh.clone()),
            _ => {
                let field = self.field_surface().and_then(Surface::as_field).ok_or(NoReference::NoField)?;
                let options = MarchingCubesOptions { grid: cells, ..MarchingCubesOptions::default() };
                Ok(marching_cubes(field, &options, progress)?.mesh.into_triangle_mesh())
            }
        }
    }
}

/// Why no mesh stands for a surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoReference {
    /// It is no mesh and has no field.
    #[error("the input has neither a mesh nor an isosurface to be compared with")]
    NoField,
    /// The isosurface failed.
    #[error(transparent)]
    Isosurface(#[from] IsosurfaceError),
}
