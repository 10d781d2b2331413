//! The bytes of a file.

use std::cell::OnceCell;
use std::path::{Path, PathBuf};

use ndf_formats::tensors::TensorFile;

use super::OpenError;

/// A file that has been read.
pub(crate) struct Content {
    /// Where it was.
    pub(crate) path: PathBuf,
    /// All of it.
    pub(crate) bytes: Vec<u8>,
    tensors: OnceCell<TensorFile>,
}

impl Content {
    pub(crate) fn new(path: PathBuf, bytes: Vec<u8>) -> Self {
        Self { path, bytes, tensors: OnceCell::new() }
    }

    pub(crate) fn read(path: &Path) -> Result<Self, OpenError> {
        let bytes = std::fs::read(path).map_err(|source| OpenError::Io { path: path.to_owned(), source })?;
        Ok(Self::new(path.to_owned(), bytes))
    }

    /// The file in messages.
    pub(crate) fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// Its tensors, which are taken out once. Of a shard, those of all shards, which lie beside it.
    pub(crate) fn tensors(&self) -> Result<&TensorFile, OpenError> {
        if let Some(file) = self.tensors.get() {
            return Ok(file);
        }
        let mut files = vec![parse(&self.bytes, &self.path)?];
        for other in shards(&self.path) {
            let bytes = std::fs::read(&other).map_err(|source| OpenError::Shard {
                name: self.name(),
                other: other.clone(),
                source,
            })?;
            files.push(parse(&bytes, &other)?);
        }
        let file = TensorFile::merged(files).expect("there is one file at least");
        Ok(self.tensors.get_or_init(|| file))
    }
}

fn parse(bytes: &[u8], path: &Path) -> Result<TensorFile, OpenError> {
    let error = |source| OpenError::Tensors { name: path.display().to_string(), source };
    TensorFile::parse(bytes).map_err(error)
}

/// The other files of one that is named as a shard, `model-00001-of-00003.safetensors`.
fn shards(path: &Path) -> Vec<PathBuf> {
    let split = || {
        let (stem, extension) = path.file_name()?.to_str()?.rsplit_once('.')?;
        let (stem, count) = stem.rsplit_once("-of-")?;
        let (stem, number) = stem.rsplit_once('-')?;
        let digits = number.len();
        let [number, count] = [number.parse::<u32>().ok()?, count.parse::<u32>().ok()?];
        (digits == 5 && (1..=count).contains(&number) && count < 1000)
            .then_some((stem, number, count, extension))
    };
    let Some((stem, number, count, extension)) = split() else { return Vec::new() };
    let others = (1..=count).filter(|&other| other != number);
    others.map(|other| path.with_file_name(format!("{stem}-{other:05}-of-{count:05}.{extension}"))).collect()
}
