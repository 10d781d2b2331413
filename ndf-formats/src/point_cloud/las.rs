//! LAS of the ASPRS and LAZ (Isenburg 2013), read by the crates `las` and `laz`.

use std::io::Cursor;
use std::thread;

use las::{PointDataBuilder, Reader};
use ndf_core::DVec3;

use super::{FileDefect, Parsed, RawCloud};

/// Bytes of points read at a time, about: a point may announce 65,535 of them.
const CHUNK: u64 = 1 << 20;

/// The thread on which LAZ is decoded. What damaged files make the decoder assert ends this thread alone, and is an error
/// of the reader.
const DECODER: &str = "decoder of LAZ";

/// Keeps the panic hook silent about LAZ files that are damaged: the decoder's library panics on some, and though the
/// reader turns that into an error, Rust's default hook prints a message first. Call it once, early: it wraps the hook
/// that is set. Needs `panic = "unwind"`.
pub fn silence_damaged_laz() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if thread::current().name() != Some(DECODER) {
            usual(panic);
        }
    }));
}

/// Reads the points of a file, without those that it marks as withheld or as noise, unless they are to be kept; the format
/// knows no normals.
pub(super) fn read(bytes: &[u8], keep_flagged: bool) -> Parsed {
    let bytes = without_absurdities(bytes)?;
    let decoder = thread::Builder::new().name(DECODER.to_owned()).spawn(move || decode(bytes, keep_flagged));
    let decoder = decoder.map_err(|e| FileDefect::undecodable(format!("no thread to decode it on: {e}")))?;
    decoder.join().unwrap_or_else(|_| Err(FileDefect::undecodable("its compressed data is damaged")))
}

fn decode(bytes: Vec<u8>, keep_flagged: bool) -> Parsed {
    let mut reader = Reader::new(Cursor::new(bytes)).map_err(|e| FileDefect::undecodable(e.to_string()))?;
    let announced = reader.header().number_of_points();
    let chunk = (CHUNK / u64::from(reader.header().point_format().len()).max(1)).max(1);
    let mut data = PointDataBuilder::new().for_header(reader.header()).build();
    let is_extended = data.format().is_extended;
    let mut cloud = RawCloud::default();
    while ((cloud.positions.len() + cloud.flagged) as u64) < announced {
        let read = reader
            .fill_points(chunk, &mut data)
            .map_err(|e| FileDefect::truncated(format!("it ends within its {announced} points: {e}")))?;
        if read == 0 {
            let found = (cloud.positions.len() + cloud.flagged) as u64;
            return Err(FileDefect::EndsEarly { items: "points", expected: announced, found });
        }
        let flagged = data.raw_bytes().chunks_exact(data.record_len()).map(|r| is_flagged(r, is_extended));
        for (((x, y), z), is_flagged) in data.x().zip(data.y()).zip(data.z()).zip(flagged) {
            if is_flagged && !keep_flagged {
                cloud.flagged += 1;
            } else {
                cloud.positions.push(DVec3::new(x, y, z));
            }
        }
    }
    Ok(cloud)
}

/// Whether a point is withheld, or of one of the two classes of noise: those that processing is to ignore (LAS 1.4 R15,
/// Tables 9, 16 and 17). Formats 6 to 10 are extended.
fn is_flagged(record: &[u8], is_extended: bool) -> bool {
    let (withheld, class) =
        if is_extended { (record[15] & 0x04, record[16]) } else { (record[15] & 0x80, record[15] & 0x1f) };
    withheld != 0 || matches!(class, 7 | 18)
}

/// A copy of a file in which nothing is left for which the crates would reserve more memory than the file is large:
/// extended records, which are not needed, are taken out; a table of chunks that announces too many is refused.
fn without_absurdities(bytes: &[u8]) -> Result<Vec<u8>, FileDefect> {
    let cut = || FileDefect::truncated("the header is cut off");
    let mut bytes = bytes.to_vec();
    let &[major, minor] = bytes.get(24..26).ok_or_else(cut)? else { return Err(cut()) };
    if (major, minor) >= (1, 4) {
        // Place and number of the extended variable length records.
        bytes.get_mut(235..247).ok_or_else(cut)?.fill(0);
    }
    let is_compressed = *bytes.get(104).ok_or_else(cut)? & 0x80 != 0;
    if is_compressed {
        let word = |at: u64, size: usize| -> Result<u64, FileDefect> {
            let at = usize::try_from(at).map_err(|_| cut())?;
            let found = at.checked_add(size).and_then(|end| bytes.get(at..end));
            let cut = || FileDefect::truncated("the table of its chunks is cut off");
            let found = found.ok_or_else(cut)?;
            Ok(found.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte)))
        };
        let start = word(96, 4)?;
        let mut table = word(start, 8)?;
        // A writer that could not go back leaves the place of the table at the end.
        if table as i64 <= start as i64 {
            table = word(bytes.len() as u64 - 8, 8)?;
        }
        let chunks = word(table.checked_add(4).ok_or_else(cut)?, 4)?;
        if chunks > bytes.len() as u64 {
            return Err(FileDefect::truncated(format!(
                "it announces {chunks} chunks in {} bytes",
                bytes.len()
            )));
        }
    }
    Ok(bytes)
}
