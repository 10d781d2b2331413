//! LAS of the ASPRS and LAZ (Isenburg 2013), read by the crates `las` and `laz`.

use std::io::Cursor;

use las::{PointDataBuilder, Reader};
use ndf_core::DVec3;

use super::super::cleaning::RawCloud;
use super::Parsed;

/// Points read at a time.
const CHUNK: u64 = 1 << 14;

/// Whether a file begins as LAS files do.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(b"LASF")
}

/// Reads the points of a file; the format knows no normals.
pub(super) fn read(bytes: &[u8]) -> Parsed {
    let mut reader = Reader::new(Cursor::new(bytes.to_vec())).map_err(|e| e.to_string())?;
    let announced = reader.header().number_of_points();
    let mut data = PointDataBuilder::new().for_header(reader.header()).build();
    let mut positions = Vec::new();
    while (positions.len() as u64) < announced {
        let read = reader
            .fill_points(CHUNK, &mut data)
            .map_err(|e| format!("it ends within its {announced} points: {e}"))?;
        if read == 0 {
            return Err(format!("it ends after {} of {announced} points", positions.len()));
        }
        positions.extend(data.x().zip(data.y()).zip(data.z()).map(|((x, y), z)| DVec3::new(x, y, z)));
    }
    Ok(RawCloud { positions, normals: None })
}
