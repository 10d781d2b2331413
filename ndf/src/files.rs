//! Files of meshes and models, with errors that name them.

use std::path::{Path, PathBuf};

use ndf_mesh::io::{self, MeshFile, ReadError};
use ndf_model::Model;
use ndf_model::file::ModelError;

/// A file that should be a model and is none.
#[derive(Debug, thiserror::Error)]
#[error("{}{}: {source}", if matches!(source, ModelError::Io(_)) { "cannot read " } else { "" }, path.display())]
pub struct NoModel {
    /// The file.
    pub path: PathBuf,
    /// Why.
    pub source: ModelError,
}

/// Reads a model; the error names the file.
///
/// # Errors
/// If it cannot be read or is damaged.
pub fn read_model(path: impl AsRef<Path>) -> Result<Model, NoModel> {
    let path = path.as_ref();
    Model::read(path).map_err(|source| NoModel { path: path.to_owned(), source })
}

/// Whether a file begins as a model does. A pipe is not looked into: what is read of it is gone.
pub fn begins_as_model(path: impl AsRef<Path>) -> bool {
    use std::io::Read;
    let path = path.as_ref();
    if !path.is_file() {
        return false;
    }
    let mut beginning = [0; 8];
    let read = std::fs::File::open(path).and_then(|mut f| f.read_exact(&mut beginning));
    read.is_ok() && Model::is_model(&beginning)
}

/// A file that should be a mesh with faces and is none.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NoMesh {
    /// It cannot be read, or is no mesh file.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It is a model.
    #[error("{} is a model, not a mesh", path.display())]
    Model {
        /// The file.
        path: PathBuf,
    },
    /// It has no faces.
    #[error("{} {}; a mesh with at least one face is needed here", path.display(), without_faces(*.vertices))]
    NoFaces {
        /// The file.
        path: PathBuf,
        /// Vertices it has.
        vertices: usize,
    },
}

/// What a mesh without faces is.
pub(crate) fn without_faces(vertices: usize) -> &'static str {
    if vertices > 0 { "is a point set without faces" } else { "is an empty mesh" }
}

/// Reads a mesh file that must have faces.
///
/// # Errors
/// If it cannot be read, is a model, or has no faces.
pub fn read_mesh(path: impl AsRef<Path>) -> Result<MeshFile, NoMesh> {
    let path = path.as_ref();
    let file = io::read_mesh(path).map_err(|error| match error {
        ReadError::Unrecognised { .. } if begins_as_model(path) => NoMesh::Model { path: path.to_owned() },
        error => NoMesh::Read(error),
    })?;
    match (file.mesh.face_count(), file.mesh.vertex_count()) {
        (0, vertices) => Err(NoMesh::NoFaces { path: path.to_owned(), vertices }),
        _ => Ok(file),
    }
}
