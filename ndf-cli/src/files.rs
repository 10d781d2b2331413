//! Reading files: notes become warnings, and errors failures that say what to try.

use std::path::Path;

use ndf::files::{NoMesh, NoModel};
use ndf::{Extracted, Model, ModelExt, OpenError, OpenOptions, Opened, begins_as_model};
use ndf_mesh::io::MeshFile;
use ndf_model::file::ModelError;

use crate::arguments::EdgeLength;
use crate::context::Context;
use crate::output::{Failure, grouped};

/// What to do where much would be left out.
pub const LARGEST: &str = "--largest-component allows it";

/// Opens a surface of any kind.
///
/// # Errors
/// If the file is of no known kind, is malformed, or holds no usable surface.
pub fn open(path: &Path, options: &OpenOptions, context: &Context) -> Result<Opened, Failure> {
    let opened = ndf::open_with(path, options, &context.progress()).map_err(|e| not_opened(&e))?;
    opened.notes.iter().for_each(|note| context.warn_of(&path.display(), note));
    Ok(opened)
}

/// The failure of opening a surface, with advice where there is some.
pub fn not_opened(error: &OpenError) -> Failure {
    let failure = Failure::new(error.to_string());
    match error {
        OpenError::Model { .. } => failure.try_instead("`ndf extract` makes a mesh of it"),
        OpenError::LeftOut { .. } => failure.try_instead(LARGEST),
        OpenError::OneSided { .. } => {
            failure.try_instead("`ndf geodesic` and `ndf spectrum` take it as it is")
        }
        OpenError::NoNormals { .. } => failure.try_instead("--as cloud finds normals"),
        OpenError::Table { .. } => {
            failure.try_instead(
                "codes go to the decoder they are for, with --latent; points are read from text (.xyz), PLY, PCD, LAS and E57",
            )
        }
        _ => failure,
    }
}

/// Reads a model.
///
/// # Errors
/// If it cannot be read or is damaged.
pub fn read_model(path: &Path) -> Result<Model, Failure> {
    ndf::read_model(path).map_err(|error| no_model(&error))
}

/// The failure of reading a model.
pub fn no_model(error: &NoModel) -> Failure {
    let failure = Failure::new(error.to_string());
    match error.source {
        ModelError::Magic if error.what == Some("a checkpoint") => {
            failure.try_instead("`ndf fit --resume` makes a model of it")
        }
        ModelError::Magic if error.what.is_some() => failure.try_instead("`ndf fit` makes one of it"),
        ModelError::Magic => failure.try_instead("`ndf fit` makes models"),
        _ => failure,
    }
}

/// Reads a mesh file that must have faces; its notes are told as warnings.
///
/// # Errors
/// If it cannot be read or has no faces.
pub fn read_faces(path: &Path, context: &Context) -> Result<MeshFile, Failure> {
    let file = ndf::read_mesh(path).map_err(|error| no_mesh(&error))?;
    Ok(told_faces(path, file, context))
}

/// The same file; its notes are told as warnings.
pub fn told_faces(path: &Path, file: MeshFile, context: &Context) -> MeshFile {
    file.notes.iter().for_each(|&note| context.warn_of(&path.display(), &note.into()));
    file
}

/// The failure of reading a mesh.
pub fn no_mesh(error: &NoMesh) -> Failure {
    let failure = Failure::new(error.to_string());
    match error {
        NoMesh::Other { what: "a checkpoint", .. } => {
            failure.try_instead("`ndf fit --resume` makes a model of it")
        }
        NoMesh::Other { .. } => failure.try_instead("`ndf mesh` makes one of it, and `ndf fit` a model"),
        NoMesh::Model { .. } => {
            failure.try_instead("`ndf extract` makes a mesh of it, and `ndf convert` one of its base mesh")
        }
        _ => failure,
    }
}

/// The model in a file and the mesh that is made of it, which is told; `None` if the file holds something else.
///
/// # Errors
/// If the model is damaged, or the edge length asks for too much.
pub fn model_mesh(path: &Path, length: EdgeLength, context: &Context) -> Result<Option<ModelMesh>, Failure> {
    if !begins_as_model(path) {
        return Ok(None);
    }
    let model = read_model(path)?;
    let wanted = length.get().unwrap_or_default();
    let name = path.display();
    let found = model.extract_with(wanted, &context.progress());
    let extracted = found.map_err(|e| Failure::new(format!("{name}: {e}")))?;
    context.tell(&format!(
        "{name} is a model: its mesh of {} faces is used, edges {}",
        grouped(extracted.mesh.face_count()),
        length.in_words(wanted.world(&model))
    ));
    Ok(Some(ModelMesh { model, extracted }))
}

/// A model, and a mesh of it.
pub struct ModelMesh {
    /// The model.
    pub model: Model,
    /// The mesh, in the units of the input.
    pub extracted: Extracted,
}
