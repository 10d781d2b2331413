//! Buffers of a document: the chunk of its container, data in its text, or files beside it.

use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path};

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use super::super::FileDefect;
use super::json::Buffer;

/// The bytes of a buffer. `chunk` is that of the container, for the first buffer, if there is one; `folder` is where files lie.
pub(super) fn bytes<'a>(
    buffer: &Buffer,
    chunk: Option<&'a [u8]>,
    folder: &Path,
) -> Result<Cow<'a, [u8]>, FileDefect> {
    let found = match (&buffer.uri, chunk) {
        (None, Some(chunk)) => Cow::Borrowed(chunk),
        // Of a buffer without data, only what is not needed may speak.
        (None, None) => return Ok(Cow::Borrowed(&[])),
        (Some(uri), _) => match uri.strip_prefix("data:") {
            Some(data) => Cow::Owned(embedded(data)?),
            None => Cow::Owned(beside(uri, buffer.byte_length, folder)?),
        },
    };
    if found.len() < buffer.byte_length {
        let (announced, there) = (buffer.byte_length, found.len());
        return Err(FileDefect::truncated(format!("a buffer announces {announced} bytes and has {there}")));
    }
    Ok(found)
}

/// The bytes of a data URI, after its scheme.
fn embedded(data: &str) -> Result<Vec<u8>, FileDefect> {
    /// Some writers leave out the padding at the end.
    const ENGINE: GeneralPurpose = GeneralPurpose::new(
        &base64::alphabet::STANDARD,
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
    );
    let (_, encoded) = data
        .split_once(";base64,")
        .ok_or_else(|| FileDefect::unsupported("a buffer is in its text in another coding than Base64"))?;
    ENGINE.decode(encoded).map_err(|e| FileDefect::undecodable(format!("a buffer in Base64: {e}")))
}

/// So many bytes of a file in `folder` or below.
fn beside(uri: &str, length: usize, folder: &Path) -> Result<Vec<u8>, FileDefect> {
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
