//! The bytes of a file, and the models among them.

use std::path::{Path, PathBuf};

use ndf_model::Model;
use ndf_model::file::ModelError;

use crate::output::Failure;

/// A file that has been read.
pub struct Content {
    /// Where it was.
    pub path: PathBuf,
    /// All of it.
    pub bytes: Vec<u8>,
}

impl Content {
    /// Reads a file.
    ///
    /// # Errors
    /// If that cannot be done.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let bytes =
            std::fs::read(path).map_err(|e| Failure::new(format!("cannot read {}: {e}", path.display())))?;
        Ok(Self { path: path.to_owned(), bytes })
    }

    /// The file in messages.
    pub fn name(&self) -> String {
        self.path.display().to_string()
    }
}

/// Whether a file begins as a model does. A pipe is not looked into: what is read of it is gone.
pub fn begins_as_model(path: &Path) -> bool {
    use std::io::Read;
    if !path.is_file() {
        return false;
    }
    let mut beginning = [0; 8];
    let read = std::fs::File::open(path).and_then(|mut f| f.read_exact(&mut beginning));
    read.is_ok() && Model::is_model(&beginning)
}

/// Reads a model.
///
/// # Errors
/// If it cannot be read or is damaged.
pub fn read_model(path: &Path) -> Result<Model, Failure> {
    Model::read(path).map_err(|e| {
        let name = path.display();
        match e {
            ModelError::Io(_) => Failure::new(format!("cannot read {name}: {e}")),
            ModelError::Magic => Failure::new(format!("{name}: {e}")).try_instead("`ndf fit` makes models"),
            _ => Failure::new(format!("{name}: {e}")),
        }
    })
}
