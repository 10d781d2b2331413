//! Reading files: notes become warnings, and errors failures that say what to try.

use std::path::Path;

use ndf::files::{NoMesh, NoModel};
use ndf::{Model, OpenError, Opened};
use ndf_mesh::io::MeshFile;
use ndf_model::file::ModelError;

use crate::arguments::Reading;
use crate::context::Context;
use crate::interrupt;
use crate::output::Failure;

/// Opens a surface of any kind.
///
/// # Errors
/// If the file is of no known kind, is malformed, or holds no usable surface.
pub fn open(path: &Path, reading: &Reading, context: &Context) -> Result<Opened, Failure> {
    let progress = context.progress().cancelled_by(interrupt::flag());
    let opened = ndf::open_with(path, &reading.options()?, &progress).map_err(|e| not_opened(&e))?;
    drop(progress);
    opened.notes.iter().for_each(|note| context.warn_of(&path.display(), note));
    Ok(opened)
}

/// The failure of opening a surface, with advice where there is some.
pub fn not_opened(error: &OpenError) -> Failure {
    let failure = Failure::new(error.to_string());
    match error {
        OpenError::Model { .. } => failure.try_instead("`ndf extract` makes a mesh of it"),
        OpenError::NoNormals { .. } => failure.try_instead("--as cloud finds normals"),
        OpenError::Table { .. } => {
            failure.try_instead("fit the decoder they are for, and give the codes with --latent")
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
    file.notes.iter().for_each(|&note| context.warn_of(&path.display(), &note.into()));
    Ok(file)
}

/// The failure of reading a mesh.
pub fn no_mesh(error: &NoMesh) -> Failure {
    let failure = Failure::new(error.to_string());
    match error {
        NoMesh::Model { .. } => {
            failure.try_instead("`ndf extract` makes a mesh of it, and `ndf convert` one of its base mesh")
        }
        _ => failure,
    }
}
