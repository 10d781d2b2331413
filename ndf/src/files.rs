//! Files of meshes and models, with errors that name them.

use std::path::{Path, PathBuf};

use ndf_mesh::io::{self, MeshFile, ReadError};
use ndf_model::Model;
use ndf_model::file::ModelError;

use crate::open::{Content, kind_in_words};
use crate::text::without_faces;

/// A file that should be a model and is none.
#[derive(Debug, thiserror::Error)]
#[error("{}", no_model(path, *what, source))]
pub struct NoModel {
    /// The file.
    pub path: PathBuf,
    /// What it is, if it is known.
    pub what: Option<&'static str>,
    /// Why.
    pub source: ModelError,
}

fn no_model(path: &Path, what: Option<&str>, source: &ModelError) -> String {
    let path = path.display();
    match (what, source) {
        (Some(what), _) => format!("{path} is {what}, not an .ndf model"),
        (None, ModelError::Io(_)) => format!("cannot read {path}: {source}"),
        (None, _) => format!("{path}: {source}"),
    }
}

/// Reads a model; the error names the file.
///
/// # Errors
/// If it cannot be read or is damaged.
pub fn read_model(path: impl AsRef<Path>) -> Result<Model, NoModel> {
    let path = path.as_ref();
    let bytes = std::fs::read(path).map_err(ModelError::from);
    let (source, what) = match bytes.map(|bytes| (Model::from_bytes(&bytes), bytes)) {
        Ok((Ok(model), _)) => return Ok(model),
        Ok((Err(source @ ModelError::Magic), bytes)) => {
            (source, kind_in_words(&Content::new(path.to_owned(), bytes)))
        }
        Ok((Err(source), _)) | Err(source) => (source, None),
    };
    Err(NoModel { path: path.to_owned(), what, source })
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
    /// It is a surface of another kind.
    #[error("{} is {what}, and a mesh is needed here", path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// What it is.
        what: &'static str,
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

/// Reads a mesh file that must have faces.
///
/// # Errors
/// If it cannot be read, is a model or a surface of another kind, or has no faces.
pub fn read_mesh(path: impl AsRef<Path>) -> Result<MeshFile, NoMesh> {
    let path = path.as_ref().to_owned();
    let bytes = std::fs::read(&path).map_err(|source| ReadError::Io { path: path.clone(), source })?;
    let read = io::parse_mesh(&bytes, &path);
    let is_other = match &read {
        Ok(file) => file.mesh.face_count() == 0 && file.mesh.vertex_count() > 0,
        Err(error) => matches!(error, ReadError::Unrecognised { .. } | ReadError::Foreign { .. }),
    };
    if Model::is_model(&bytes) {
        return Err(NoMesh::Model { path });
    }
    if is_other {
        let what = kind_in_words(&Content::new(path.clone(), bytes));
        if let Some(what) = what.filter(|what| *what != "a mesh") {
            return Err(NoMesh::Other { path, what });
        }
    }
    match read? {
        file if file.mesh.face_count() > 0 => Ok(file),
        file => Err(NoMesh::NoFaces { path, vertices: file.mesh.vertex_count() }),
    }
}
