//! The binary container of glTF, GLB: a header, the JSON, and at most one buffer.

use std::io::{self, Write};

use super::super::FileDefect;

/// Bytes of the header: the magic number, the version, the length of the file.
const HEADER: usize = 12;
/// Bytes before a chunk: its length and its kind.
const CHUNK_HEADER: usize = 8;
const MAGIC: &[u8; 4] = b"glTF";
const JSON: &[u8; 4] = b"JSON";
const BUFFER: &[u8; 4] = b"BIN\0";

/// The JSON and the buffer of a file, which is empty if there is none.
pub(super) fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), FileDefect> {
    let cut_off = || FileDefect::truncated("it ends within its chunks; the file is cut off");
    let number = |at: usize| -> Result<usize, FileDefect> {
        let found = bytes.get(at..).and_then(|rest| rest.first_chunk()).ok_or_else(cut_off)?;
        Ok(u32::from_le_bytes(*found) as usize)
    };
    if !bytes.starts_with(MAGIC) {
        return Err(FileDefect::value("it does not begin with glTF"));
    }
    let (version, length) = (number(4)?, number(8)?);
    if version != 2 {
        return Err(FileDefect::unsupported(format!(
            "version {version} of binary glTF is not read; save version 2"
        )));
    }
    let end = if length > bytes.len() { return Err(cut_off()) } else { length };
    let chunk = |at: usize| -> Result<(&[u8], &[u8], usize), FileDefect> {
        let from = at + CHUNK_HEADER;
        let to = from.checked_add(number(at)?).filter(|&to| to <= end).ok_or_else(cut_off)?;
        Ok((&bytes[at + 4..from], &bytes[from..to], to))
    };
    let (kind, json, end_of_json) = chunk(HEADER)?;
    if kind != JSON {
        return Err(FileDefect::value("its first chunk is not JSON"));
    }
    if end_of_json + CHUNK_HEADER > end {
        return Ok((json, &[]));
    }
    let (kind, buffer, _) = chunk(end_of_json)?;
    Ok((json, if kind == BUFFER { buffer } else { &[] }))
}

/// Bytes of a file of this JSON and a buffer of so many bytes, a multiple of four; `None` if they are more than the format has.
pub(super) fn length(json: &[u8], buffer: usize) -> Option<u32> {
    // A chunk without bytes is left out.
    let header = if buffer > 0 { CHUNK_HEADER } else { 0 };
    let json = CHUNK_HEADER + json.len().next_multiple_of(4);
    u32::try_from(HEADER.checked_add(json)?.checked_add(header + buffer)?).ok()
}

/// Writes a file whose buffer of so many bytes, a multiple of four, `write` writes.
pub(super) fn write(
    out: &mut dyn Write,
    json: &[u8],
    buffer: usize,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let length = length(json, buffer).ok_or_else(|| io::Error::other("glTF ends at 4 GiB"))?;
    out.write_all(MAGIC)?;
    out.write_all(&2_u32.to_le_bytes())?;
    out.write_all(&length.to_le_bytes())?;
    let padded = json.len().next_multiple_of(4);
    out.write_all(&(padded as u32).to_le_bytes())?;
    out.write_all(JSON)?;
    out.write_all(json)?;
    out.write_all(&b"   "[..padded - json.len()])?;
    if buffer > 0 {
        out.write_all(&(buffer as u32).to_le_bytes())?;
        out.write_all(BUFFER)?;
    }
    write(out)
}
