//! The bytes of a file.

use std::path::{Path, PathBuf};

use super::OpenError;

/// A file that has been read.
pub(crate) struct Content {
    /// Where it was.
    pub(crate) path: PathBuf,
    /// All of it.
    pub(crate) bytes: Vec<u8>,
}

impl Content {
    pub(crate) fn read(path: &Path) -> Result<Self, OpenError> {
        let bytes = std::fs::read(path).map_err(|source| OpenError::Io { path: path.to_owned(), source })?;
        Ok(Self { path: path.to_owned(), bytes })
    }

    /// The file in messages.
    pub(crate) fn name(&self) -> String {
        self.path.display().to_string()
    }
}
