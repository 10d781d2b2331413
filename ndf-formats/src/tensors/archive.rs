//! Zip archives of arrays.

use std::io::{Cursor, Read};

use ndf_mesh::io::FileDefect;
use zip::ZipArchive;

use super::{Container, Contents, TensorError, npy};

/// What all entries may grow to when they are unpacked, in sizes of the archive. Weights hardly compress.
const MAX_GROWTH: u64 = 64;

/// A zip archive in memory.
pub(crate) struct Archive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    /// Bytes that may still be unpacked: entries may overlap.
    left: u64,
}

impl<'a> Archive<'a> {
    pub(crate) fn open(bytes: &'a [u8]) -> Result<Self, FileDefect> {
        let zip = ZipArchive::new(Cursor::new(bytes));
        let zip = zip.map_err(|e| FileDefect::undecodable(format!("as a zip archive: {e}")))?;
        Ok(Self { zip, left: MAX_GROWTH * bytes.len() as u64 })
    }

    pub(crate) fn names(&self) -> Vec<String> {
        self.zip.file_names().filter_map(|name| Some(name.ok()?.into_owned())).collect()
    }

    /// The contents of an entry.
    pub(crate) fn read(&mut self, name: &str) -> Result<Vec<u8>, FileDefect> {
        let of_entry = |what: String| format!("entry {name} of the archive: {what}");
        let entry = self.zip.by_name(name).map_err(|e| FileDefect::undecodable(of_entry(e.to_string())))?;
        let size = entry.size();
        if size > self.left {
            let text = of_entry(format!("{size} bytes are too many for the size of the file"));
            return Err(FileDefect::too_large(text));
        }
        let mut contents = Vec::new();
        let read = entry.take(self.left).read_to_end(&mut contents);
        let read = read.map_err(|e| FileDefect::undecodable(of_entry(e.to_string())))?;
        self.left -= read as u64;
        Ok(contents)
    }
}

/// The container that an archive is; `None` if it can be looked into, and holds neither a pickle nor an array.
pub(super) fn container_of(bytes: &[u8]) -> Option<Container> {
    // What is damaged is for the reader to say.
    let Ok(archive) = Archive::open(bytes) else { return Some(Container::Npz) };
    let names = archive.names();
    if names.iter().any(|name| is_pickle(name)) {
        Some(Container::TorchZip)
    } else {
        names.iter().any(|name| name.ends_with(".npy")).then_some(Container::Npz)
    }
}

/// Whether an archive holds the images of SOG and their description.
pub(super) fn is_sog(bytes: &[u8]) -> bool {
    let names = Archive::open(bytes).map(|archive| archive.names()).unwrap_or_default();
    let has = |end: &str| names.iter().any(|name| name.ends_with(end));
    has("meta.json") && has(".webp")
}

/// What an archive without tensors is, told by what it holds, in words that complete "the file is …".
pub(super) fn other(bytes: &[u8]) -> &'static str {
    let names = Archive::open(bytes).map(|archive| archive.names()).unwrap_or_default();
    let has = |end: &str| names.iter().any(|name| name.to_ascii_lowercase().ends_with(end));
    if has(".model") {
        "a 3MF file, which is not read; export it as OBJ, PLY, STL or glTF"
    } else if has(".usdc") || has(".usda") || has(".usd") {
        "a USD file, which is not read; export it as OBJ, PLY, STL or glTF"
    } else if has(".weights.h5") {
        "a model of Keras 3; take the file model.weights.h5 out of it"
    } else if has(".fcstd") || has("document.xml") {
        "a document of FreeCAD or of an office; export a mesh from it"
    } else {
        "a zip archive; unpack it, and give one of its files"
    }
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
        let Contents { tensors, foreign, .. } = npy::read(&archive.read(&name)?, stem)?;
        all.tensors.extend(tensors);
        all.foreign.extend(foreign);
    }
    Ok(all)
}
