//! Buffers of a document: the chunk of its container, data in its text, or files beside it.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use super::super::FileDefect;
use super::json::{Buffer, Root};

/// The buffers of a document that something is in: each file is read once, however many buffers name it.
#[derive(Debug)]
pub(super) struct Buffers<'a> {
    data: Vec<Cow<'a, [u8]>>,
    /// Where in `data` each buffer is, and how long it is; nothing for those that are not needed.
    places: Vec<Option<(usize, usize)>>,
}

impl<'a> Buffers<'a> {
    /// `chunk` is that of the container, for the first buffer, if there is one; `folder` is where files lie.
    pub(super) fn of(root: &Root, chunk: Option<&'a [u8]>, folder: &Path) -> Result<Self, FileDefect> {
        let mut is_needed = vec![false; root.buffers.len()];
        for view in &root.buffer_views {
            is_needed.get_mut(view.buffer as usize).into_iter().for_each(|needed| *needed = true);
        }
        let mut found = Self { data: Vec::new(), places: Vec::new() };
        // As much of each file as the longest of its buffers has.
        let mut files: HashMap<PathBuf, usize> = HashMap::new();
        let needed =
            || root.buffers.iter().enumerate().filter(|(i, _)| is_needed[*i]).map(|(_, buffer)| buffer);
        for buffer in needed() {
            if let Some(path) = buffer.file()? {
                let length = files.entry(path).or_default();
                *length = buffer.byte_length.max(*length);
            }
        }
        let mut read: HashMap<PathBuf, usize> = HashMap::new();
        for (i, buffer) in root.buffers.iter().enumerate() {
            if !is_needed[i] {
                found.places.push(None);
                continue;
            }
            let place = match (buffer.file()?, &buffer.uri, chunk.filter(|_| i == 0)) {
                (Some(path), _, _) => match read.get(&path) {
                    Some(&place) => place,
                    None => {
                        let place = found.add(Cow::Owned(beside(&path, files[&path], folder)?));
                        read.insert(path, place);
                        place
                    }
                },
                (None, Some(uri), _) => found.add(Cow::Owned(embedded(uri)?)),
                (None, None, Some(chunk)) => found.add(Cow::Borrowed(chunk)),
                // Of a buffer without data, only what is not needed may speak.
                (None, None, None) => {
                    found.places.push(None);
                    continue;
                }
            };
            let (announced, there) = (buffer.byte_length, found.data[place].len());
            if there < announced {
                let text = format!("a buffer announces {announced} bytes and has {there}");
                return Err(FileDefect::truncated(text));
            }
            found.places.push(Some((place, if buffer.uri.is_some() { announced } else { there })));
        }
        if root.buffers.is_empty()
            && let Some(chunk) = chunk
        {
            let place = found.add(Cow::Borrowed(chunk));
            found.places.push(Some((place, chunk.len())));
        }
        Ok(found)
    }

    fn add(&mut self, data: Cow<'a, [u8]>) -> usize {
        self.data.push(data);
        self.data.len() - 1
    }

    /// The bytes of a buffer, if it has some.
    pub(super) fn get(&self, buffer: u32) -> Option<&[u8]> {
        let (place, length) = (*self.places.get(buffer as usize)?)?;
        self.data[place].get(..length)
    }

    /// Bytes of all buffers.
    pub(super) fn len(&self) -> usize {
        self.data.iter().map(|data| data.len()).sum()
    }
}

impl Buffer {
    /// The file that it is in, from the folder of the document, if it is in one.
    fn file(&self) -> Result<Option<PathBuf>, FileDefect> {
        let Some(uri) = self.uri.as_ref().filter(|uri| !uri.starts_with("data:")) else { return Ok(None) };
        let name = percent_decode_str(uri).decode_utf8_lossy();
        let path = Path::new(name.as_ref());
        // Whoever made the file may not choose which others of this machine are read.
        let is_below = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        if !is_below || name.contains("://") {
            let text = format!(
                "its buffer {name} is not a file beside it, and others are not read; put it there, or pack all in one .glb"
            );
            return Err(FileDefect::unsupported(text));
        }
        Ok(Some(path.components().filter(|part| matches!(part, Component::Normal(_))).collect()))
    }
}

/// The bytes of a data URI.
fn embedded(uri: &str) -> Result<Vec<u8>, FileDefect> {
    /// Some writers leave out the padding at the end.
    const ENGINE: GeneralPurpose = GeneralPurpose::new(
        &base64::alphabet::STANDARD,
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
    );
    let (_, encoded) = uri
        .split_once(";base64,")
        .ok_or_else(|| FileDefect::unsupported("a buffer is in its text in another coding than Base64"))?;
    ENGINE.decode(encoded).map_err(|e| FileDefect::undecodable(format!("a buffer in Base64: {e}")))
}

/// So many bytes of a file below `folder`.
fn beside(path: &Path, length: usize, folder: &Path) -> Result<Vec<u8>, FileDefect> {
    let path = folder.join(path);
    let missing = |why: &dyn std::fmt::Display| {
        FileDefect::missing(format!("its buffer {} cannot be read: {why}", path.display()))
    };
    let metadata = path.metadata().map_err(|e| missing(&e))?;
    if !metadata.is_file() {
        return Err(missing(&"it is no file"));
    }
    let mut found = Vec::new();
    let file = File::open(&path).map_err(|e| missing(&e))?;
    file.take(length as u64).read_to_end(&mut found).map_err(|e| missing(&e))?;
    Ok(found)
}
