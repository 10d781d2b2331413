//! Rows of measurements in a CSV file: a run that is made again takes the place of the earlier one, so that long tables can
//! be made a few rows at a time.

use std::path::PathBuf;

use ndf_mesh::io::atomic_write;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A line of a file.
pub(crate) trait Row: Serialize + DeserializeOwned {
    /// What tells it from others.
    fn key(&self) -> String;
}

/// All lines of a file.
pub(crate) struct Rows<R> {
    file: PathBuf,
    rows: Vec<R>,
}

impl<R: Row> Rows<R> {
    /// The lines of a file that exists, or none. Lines of other columns are an error.
    pub(crate) fn open(file: PathBuf) -> Result<Self, String> {
        let say = |e: csv::Error| format!("{}: {e}", file.display());
        let rows = if file.exists() {
            let mut reader = csv::Reader::from_path(&file).map_err(say)?;
            reader.deserialize().collect::<Result<_, _>>().map_err(say)?
        } else {
            Vec::new()
        };
        Ok(Self { file, rows })
    }

    /// Adds a line, or puts it in the place of an earlier one, and writes the file.
    pub(crate) fn put(&mut self, row: R) -> Result<(), String> {
        match self.rows.iter_mut().find(|earlier| earlier.key() == row.key()) {
            Some(earlier) => *earlier = row,
            None => self.rows.push(row),
        }
        self.write()
    }

    /// Takes a line away, if it is there, and writes the file.
    pub(crate) fn remove(&mut self, key: &str) -> Result<(), String> {
        if !self.contains(key) {
            return Ok(());
        }
        self.rows.retain(|row| row.key() != key);
        self.write()
    }

    fn write(&self) -> Result<(), String> {
        let bytes = || -> Result<Vec<u8>, csv::Error> {
            let mut writer = csv::Writer::from_writer(Vec::new());
            self.rows.iter().try_for_each(|row| writer.serialize(row))?;
            writer.into_inner().map_err(|e| e.into_error().into())
        };
        let say = |e: &dyn std::fmt::Display| format!("{}: {e}", self.file.display());
        let bytes = bytes().map_err(|e| say(&e))?;
        atomic_write(&self.file, |out| out.write_all(&bytes)).map_err(|e| say(&e))
    }

    /// Whether there is a line like this.
    pub(crate) fn contains(&self, key: &str) -> bool {
        self.find(key).is_some()
    }

    /// The line like this.
    pub(crate) fn find(&self, key: &str) -> Option<&R> {
        self.rows.iter().find(|row| row.key() == key)
    }

    /// All lines.
    pub(crate) fn all(&self) -> &[R] {
        &self.rows
    }
}
