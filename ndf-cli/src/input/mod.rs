//! From a file to a surface that can be learned, whatever represents it.
//!
//! What a file is, its content decides: `FAMILIES` lists the families of representations, and the first that
//! recognises the content opens it. `--as` names the kind, and with it the family, instead. To add a
//! representation: a [`Kind`], a file here with its [`Family`], and a line in the list.

mod band;
mod base;
mod cloud;
mod content;
mod kind;
mod mesh;
mod network;
mod splats;

use std::path::{Path, PathBuf};

use clap::Args;
use ndf_core::{Progress, Surface};
use ndf_mesh::TriangleMesh;
use ndf_meshing::{MarchingCubesOptions, marching_cubes};
use ndf_model::Model;
use ndf_surfaces::LevelSearch;

pub use band::{Band, BandFigures};
pub use base::{Base, BaseSource};
pub use content::{Content, begins_as_model, read_model};
pub use kind::Kind;

use crate::context::Context;
use crate::output::{Failure, Outcome};

/// Representations that share their files.
pub struct Family {
    /// The kinds it can open.
    kinds: &'static [Kind],
    /// Whether a file is of this family, told from its beginning.
    recognises: fn(&Content) -> bool,
    /// Opens a file, as the kind that the reading asks for or that its content tells.
    open: fn(&Content, &Reading, &Context) -> Result<Input, Failure>,
    /// What `ndf info` says of a file.
    describe: fn(&Content, &Reading, &Context) -> Result<Outcome, Failure>,
}

/// All families, in the order in which they are asked. What none recognises is left to [`mesh::FAMILY`], to say what is
/// wrong with it.
static FAMILIES: [Family; 4] = [mesh::FAMILY, network::FAMILY, splats::FAMILY, cloud::FAMILY];

/// How an input is to be understood.
#[derive(Args, Clone, Debug, Default)]
pub struct Reading {
    /// What the input is, where its content should not decide.
    #[arg(long = "as", value_name = "KIND")]
    pub kind: Option<Kind>,
    /// Level of the surface, where the input is a field: a density, an occupancy or a distance [default: by rule].
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = finite)]
    pub iso: Option<f64>,
    /// Codes of a decoder of many shapes: a file with a table of them.
    #[arg(long, value_name = "FILE")]
    pub latent: Option<PathBuf>,
    /// Which of the codes.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "latent")]
    pub latent_index: usize,
}

fn finite(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if number.is_finite() { Ok(number) } else { Err("not finite".to_owned()) }
}

/// The level of a field that is learned.
#[derive(Clone, Copy, Debug)]
pub struct Level {
    /// Its value.
    pub value: f64,
    /// How it was chosen.
    pub rule: &'static str,
}

/// A surface from a file.
pub struct Input {
    /// What represents it.
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
}

/// Reads a surface of any kind; what had to be mended is told as warnings.
///
/// # Errors
/// If the file is of no known kind, is malformed, or holds no usable surface.
pub fn open(path: &Path, reading: &Reading, context: &Context) -> Result<Input, Failure> {
    let content = Content::read(path)?;
    if Model::is_model(&content.bytes) {
        let failure = Failure::new(format!("{} is a model already", content.name()));
        return Err(failure.try_instead("`ndf extract` makes a mesh of it"));
    }
    (family(&content, reading).open)(&content, reading, context)
}

/// What `ndf info` says of a file that is no model.
///
/// # Errors
/// If the file is of no known kind or malformed.
pub fn describe(content: &Content, reading: &Reading, context: &Context) -> Result<Outcome, Failure> {
    (family(content, reading).describe)(content, reading, context)
}

/// The family that opens a file.
fn family(content: &Content, reading: &Reading) -> &'static Family {
    let fits = |family: &&Family| match reading.kind {
        Some(kind) => family.kinds.contains(&kind),
        None => (family.recognises)(content),
    };
    FAMILIES.iter().find(fits).unwrap_or(&FAMILIES[0])
}

impl Input {
    /// A mesh that stands for the input in comparisons and pictures: the mesh it is, or its isosurface on a grid
    /// of `cells` along the longest side.
    ///
    /// # Errors
    /// If the input is no mesh and has no isosurface.
    pub fn reference(&self, cells: u32, progress: &dyn Progress) -> Result<TriangleMesh, Failure> {
        match (&self.base, &self.mesh) {
            (BaseSource::Manifold(mesh), _) => Ok(TriangleMesh::clone(mesh)),
            (_, Some(mesh)) => Ok(mesh.clone()),
            _ => {
                let field = self.field_surface().and_then(Surface::as_field).ok_or_else(|| {
                    Failure::new("the input has neither a mesh nor an isosurface to be compared with")
                })?;
                let options = MarchingCubesOptions { grid: cells, ..MarchingCubesOptions::default() };
                Ok(marching_cubes(field, &options, progress)?.mesh.into_triangle_mesh())
            }
        }
    }
}
