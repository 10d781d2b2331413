//! Rows of text files that hold more than the header announces.
//!
//! In a text file a row is a line. MeshLab has written headers that announce four numbers of a face where the lines hold a
//! list of nine; a reader that counts words loses its place there. What a line holds beyond its row is cut off before the
//! file is parsed. Rows may also share lines or go over several, which counting words allows; such files are left as they
//! are.

use serde_ply::{PlyFormat, PlyReader, PropertyType};

use super::FileDefect;

/// The body of a text file without what its lines hold beyond their rows.
pub(super) struct Trimmed {
    pub(super) body: Vec<u8>,
    /// Rows that held more.
    pub(super) rows: usize,
}

/// The body without what is too much; `None` if nothing is, or the file is binary. O(n).
pub(super) fn trimmed(header: &str, body: &[u8]) -> Result<Option<Trimmed>, FileDefect> {
    let reader = PlyReader::from_reader(header.as_bytes())
        .map_err(|e| FileDefect::undecodable(format!("header: {}", e.0)))?;
    if reader.header().format != PlyFormat::Ascii {
        return Ok(None);
    }
    let mut lines = body.split(|&b| b == b'\n').filter(|line| !line.trim_ascii().is_empty());
    let (mut kept, mut rows) = (Vec::new(), 0);
    for element in &reader.header().elem_defs {
        for _ in 0..element.count {
            // Rows share lines, or go on in the next one: the file is not one of rows on lines.
            let Some(line) = lines.next() else { return Ok(None) };
            let Some(end) = end_of_row(line, element.properties.iter().map(|p| &p.property_type)) else {
                return Ok(None);
            };
            rows += usize::from(!line[end..].trim_ascii().is_empty());
            kept.extend_from_slice(&line[..end]);
            kept.push(b'\n');
        }
    }
    Ok((rows > 0).then_some(Trimmed { body: kept, rows }))
}

/// Where the words of these properties end; `None` if the line has fewer words, or a list's length is no number.
fn end_of_row<'a>(line: &[u8], properties: impl Iterator<Item = &'a PropertyType>) -> Option<usize> {
    let mut at = 0;
    let mut word = || {
        let from = at + line[at..].iter().position(|b| !b.is_ascii_whitespace())?;
        let length = line[from..].iter().position(u8::is_ascii_whitespace);
        at = length.map_or(line.len(), |length| from + length);
        Some((&line[from..at], at))
    };
    let mut end = 0;
    for property in properties {
        let (first, after) = word()?;
        end = after;
        if let PropertyType::List { .. } = property {
            let count: usize = std::str::from_utf8(first).ok()?.parse().ok()?;
            for _ in 0..count {
                end = word()?.1;
            }
        }
    }
    Some(end)
}
