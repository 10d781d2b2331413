//! What holds the sections: a header, a table, checksums.

use super::bytes::Writer;
use super::error::{ModelError, VERSION};
use ndf_mesh::io::FileDefect;

/// Not text, so that a transfer as text is noticed.
const MAGIC: [u8; 8] = *b"\x89NDF\r\n\x1a\n";
const MAX_SECTIONS: usize = 1024;
/// Bytes of a section in the table.
const ENTRY: usize = 16;

/// Whether a file that begins with these bytes means to be a model.
pub(super) fn is_model(beginning: &[u8]) -> bool {
    beginning.starts_with(&MAGIC)
}

/// The file of these sections, each a tag of four bytes and a payload.
pub(super) fn join(version: u32, sections: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut file = Writer(MAGIC.to_vec());
    file.u32(version);
    file.u32(sections.len() as u32);
    for (tag, payload) in sections {
        file.0.extend(tag.as_bytes());
        file.u32(crc32fast::hash(payload));
        file.0.extend((payload.len() as u64).to_le_bytes());
    }
    file.u32(crc32fast::hash(&file.0));
    sections.iter().for_each(|(_, payload)| file.0.extend(payload));
    file.0
}

/// Bytes of the file of these sections.
pub(super) fn size(sections: &[(&str, Vec<u8>)]) -> usize {
    16 + ENTRY * sections.len() + 4 + sections.iter().map(|(_, payload)| payload.len()).sum::<usize>()
}

/// Tag and payload.
type Section<'a> = ([u8; 4], &'a [u8]);

/// The version and all sections, checksums verified.
pub(super) fn split(bytes: &[u8]) -> Result<(u32, Vec<Section<'_>>), ModelError> {
    let word = |at: usize| -> Option<u32> { bytes.get(at..)?.first_chunk().map(|b| u32::from_le_bytes(*b)) };
    if !is_model(bytes) {
        return Err(ModelError::Magic);
    }
    let cut = ModelError::Header(FileDefect::truncated("the file is truncated"));
    let (Some(version), Some(count)) = (word(8), word(12)) else { return Err(cut) };
    if version == 0 || version > VERSION {
        return Err(ModelError::Version(version));
    }
    if count as usize > MAX_SECTIONS {
        return Err(ModelError::Header(FileDefect::too_large("it announces too many sections")));
    }
    let table_end = 16 + ENTRY * count as usize;
    let Some(header_sum) = word(table_end) else { return Err(cut) };
    if crc32fast::hash(&bytes[..table_end]) != header_sum {
        return Err(ModelError::Header(FileDefect::Checksum("the checksum of the header")));
    }
    let mut rest = &bytes[table_end + 4..];
    let mut sections = Vec::with_capacity(count as usize);
    for entry in bytes[16..table_end].chunks_exact(ENTRY) {
        let (tag, entry) = entry.split_first_chunk::<4>().expect("an entry has 16 bytes");
        let (sum, length) = entry.split_first_chunk::<4>().expect("an entry has 16 bytes");
        let length = u64::from_le_bytes(*length.first_chunk().expect("an entry has 16 bytes"));
        let Some((payload, after)) = usize::try_from(length).ok().and_then(|l| rest.split_at_checked(l))
        else {
            return Err(cut);
        };
        if crc32fast::hash(payload) != u32::from_le_bytes(*sum) {
            return Err(ModelError::Checksum(String::from_utf8_lossy(tag).into_owned()));
        }
        rest = after;
        sections.push((*tag, payload));
    }
    if !rest.is_empty() {
        return Err(ModelError::Header(FileDefect::TrailingBytes("the last section")));
    }
    Ok((version, sections))
}
