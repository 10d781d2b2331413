//! Zip archives of arrays.

use std::io::{Cursor, Read};

use ndf_mesh::io::FileDefect;
use zip::ZipArchive;

use super::{Contents, TensorError, npy};

/// What an entry may grow to when it is unpacked, in sizes of the archive. Weights hardly compress.
const MOST_GROWTH: u64 = 64;

/// A zip archive in memory.
pub(super) struct Archive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    limit: u64,
}

impl<'a> Archive<'a> {
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, FileDefect> {
        let zip = ZipArchive::new(Cursor::new(bytes));
        let zip = zip.map_err(|e| FileDefect::undecodable(format!("as a zip archive: {e}")))?;
        Ok(Self { zip, limit: MOST_GROWTH * bytes.len() as u64 })
    }

    pub(super) fn names(&self) -> Vec<String> {
        self.zip.file_names().filter_map(|name| Some(name.ok()?.into_owned())).collect()
    }

    /// The contents of an entry.
    pub(super) fn read(&mut self, name: &str) -> Result<Vec<u8>, FileDefect> {
        let of_entry = |what: String| format!("entry {name} of the archive: {what}");
        let entry = self.zip.by_name(name).map_err(|e| FileDefect::undecodable(of_entry(e.to_string())))?;
        let size = entry.size();
        if size > self.limit {
            let text = of_entry(format!("{size} bytes are too many for the size of the file"));
            return Err(FileDefect::too_large(text));
        }
        let mut contents = Vec::new();
        let read = entry.take(self.limit).read_to_end(&mut contents);
        read.map_err(|e| FileDefect::undecodable(of_entry(e.to_string())))?;
        Ok(contents)
    }
}

/// Whether an archive holds the pickle that `torch.save` writes.
pub(super) fn has_pickle(bytes: &[u8]) -> bool {
    Archive::open(bytes).is_ok_and(|archive| archive.names().iter().any(|name| is_pickle(name)))
}

/// Whether an entry is the pickle of `torch.save`.
pub(super) fn is_pickle(name: &str) -> bool {
    name == "data.pkl" || name.ends_with("/data.pkl")
}

/// Arrays of an archive, named by their entries.
pub(super) fn read_npz(bytes: &[u8]) -> Result<Contents, TensorError> {
    let mut archive = Archive::open(bytes)?;
    let mut all = Contents::default();
    let mut names = archive.names();
    names.sort_unstable();
    for name in names {
        let Some(stem) = name.strip_suffix(".npy") else { continue };
        let Contents { tensors, foreign } = npy::read(&archive.read(&name)?, stem)?;
        all.tensors.extend(tensors);
        all.foreign.extend(foreign);
    }
    Ok(all)
}
