//! The `.ksplat` of the viewer GaussianSplats3D: a header of 4,096 bytes, one of 1,024 bytes for each section, then the
//! sections. A section has the numbers of splats in buckets that are not full, the centres of its buckets, and its splats.
//!
//! Splats are linear scales, quaternions w, x, y, z, a colour with the opacity, and harmonics, which are passed over. They are
//! floats at level 0 of compression; at levels 1 and 2 centres are 16 bits an axis around the centre of a bucket, scales
//! and quaternions half floats.

use half::f16;
use ndf_mesh::io::FileDefect;

use super::{Splat, SplatError};

const HEADER: usize = 4096;
const SECTION: usize = 1024;
/// Where the fields of the headers end; the rest is zero.
const HEADER_FIELDS: usize = 44;

/// Components of harmonics of degrees 0 to 3.
const HARMONICS: [usize; 4] = [0, 9, 24, 45];

/// Whether a file begins as `.ksplat` does: a version, a level of compression, and nothing in the rest of its header.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    let Some(header) = bytes.get(..HEADER) else { return false };
    let fields = Fields(header);
    header[0] == 0
        && header[1] > 0
        && header[2..4] == [0, 0]
        && fields.u16(20) <= 2
        && fields.u32(4) > 0
        && bytes.len() >= HEADER + SECTION
        && header[HEADER_FIELDS..].iter().all(|&byte| byte == 0)
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Splat>, SplatError> {
    let header = Fields(bytes.get(..HEADER).unwrap_or_default());
    let cut_off = || FileDefect::truncated("it ends within its sections");
    let sections = header.u32(4) as usize;
    let is_packed = header.u16(20) > 0;
    let mut rest =
        sections.checked_mul(SECTION).and_then(|size| bytes.get(HEADER + size..)).ok_or_else(cut_off)?;
    let mut splats = Vec::new();
    for section in bytes[HEADER..].chunks_exact(SECTION).take(sections) {
        let section = Section::read(Fields(section), header.u16(20))?;
        let mut take = |count: usize, size: usize| -> Result<&[u8], FileDefect> {
            let (taken, left) =
                count.checked_mul(size).and_then(|n| rest.split_at_checked(n)).ok_or_else(cut_off)?;
            rest = left;
            Ok(taken)
        };
        let lengths = take(section.partly_filled, 4)?;
        let centers = take(section.buckets, section.bucket_size)?;
        let records = take(section.room, section.record)?;
        let mut buckets = Buckets { section: &section, lengths, centers, bucket: 0, left: 0 };
        for record in records.chunks_exact(section.record).take(section.splats) {
            splats.push(if is_packed { buckets.packed(Fields(record))? } else { plain(Fields(record)) });
        }
    }
    // Writers that stream leave the number out.
    let announced = header.u32(16) as usize;
    if announced > 0 && announced != splats.len() {
        let text = format!("it announces {announced} splats, but its sections hold {}", splats.len());
        return Err(FileDefect::mismatch(text).into());
    }
    if !rest.is_empty() {
        return Err(FileDefect::mismatch(format!("{} bytes follow its last section", rest.len())).into());
    }
    Ok(splats)
}

/// Numbers at their places.
#[derive(Clone, Copy)]
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn u16(self, at: usize) -> u16 {
        u16::from_le_bytes([self.0[at], self.0[at + 1]])
    }

    fn u32(self, at: usize) -> u32 {
        u32::from_le_bytes([self.0[at], self.0[at + 1], self.0[at + 2], self.0[at + 3]])
    }

    fn f32(self, at: usize) -> f32 {
        f32::from_bits(self.u32(at))
    }

    fn f16(self, at: usize) -> f32 {
        f16::from_bits(self.u16(at)).to_f32()
    }
}

/// What the header of a section says.
struct Section {
    splats: usize,
    /// Splats that there is room for.
    room: usize,
    /// Bytes of a splat.
    record: usize,
    buckets: usize,
    /// Bytes of the centre of a bucket.
    bucket_size: usize,
    /// Splats of a full bucket.
    capacity: usize,
    full: usize,
    partly_filled: usize,
    /// Length of a step of a packed centre.
    step: f64,
    /// The packed centre that is the bucket's.
    middle: f64,
}

impl Section {
    fn read(fields: Fields<'_>, level: u16) -> Result<Self, FileDefect> {
        let whole = |at: usize| fields.u32(at) as usize;
        let degree = usize::from(fields.u16(40));
        let harmonics = HARMONICS.get(degree).ok_or_else(|| {
            FileDefect::Value(format!("its harmonics have degree {degree}; at most 3 is possible").into())
        })?;
        let (fixed, component) = match level {
            0 => (44, 4),
            1 => (24, 2),
            _ => (24, 1),
        };
        let (splats, room) = (whole(0), whole(4));
        let range = f64::from(if whole(24) > 0 { fields.u32(24) } else { 32767 });
        Ok(Self {
            // Writers that stream leave the number out.
            splats: if splats > 0 { splats.min(room) } else { room },
            room,
            record: fixed + harmonics * component,
            buckets: whole(12),
            bucket_size: usize::from(fields.u16(20)),
            capacity: whole(8),
            full: whole(32),
            partly_filled: whole(36),
            step: 0.5 * f64::from(fields.f32(16)) / range,
            middle: range,
        })
    }
}

/// The buckets of a section, as its splats are read.
struct Buckets<'a> {
    section: &'a Section,
    lengths: &'a [u8],
    centers: &'a [u8],
    /// Number of the next bucket.
    bucket: usize,
    /// Splats of the last one that are still to come.
    left: usize,
}

impl Buckets<'_> {
    fn packed(&mut self, record: Fields<'_>) -> Result<Splat, FileDefect> {
        let Section { full, capacity, bucket_size, step, middle, .. } = *self.section;
        while self.left == 0 {
            let partly = self.bucket.checked_sub(full).map(|i| self.lengths.get(4 * i..4 * i + 4));
            self.left = match partly {
                None if capacity > 0 => capacity,
                None => return Err(FileDefect::mismatch("its full buckets hold nothing")),
                Some(Some(length)) => Fields(length).u32(0) as usize,
                Some(None) => {
                    return Err(FileDefect::mismatch("its buckets hold fewer splats than it announces"));
                }
            };
            self.bucket += 1;
        }
        self.left -= 1;
        let center = self.centers.get((self.bucket - 1) * bucket_size..).and_then(|center| center.get(..12));
        let center =
            Fields(center.ok_or_else(|| FileDefect::mismatch("it has fewer buckets than it announces"))?);
        let place =
            |axis: usize| f64::from(center.f32(4 * axis)) + step * (f64::from(record.u16(2 * axis)) - middle);
        Ok(Splat {
            center: [0, 1, 2].map(place),
            scales: [6, 8, 10].map(|at| record.f16(at)),
            rotation: [12, 14, 16, 18].map(|at| record.f16(at)),
            opacity: f32::from(record.0[23]) / 255.0,
        })
    }
}

fn plain(record: Fields<'_>) -> Splat {
    Splat {
        center: [0, 4, 8].map(|at| f64::from(record.f32(at))),
        scales: [12, 16, 20].map(|at| record.f32(at)),
        rotation: [24, 28, 32, 36].map(|at| record.f32(at)),
        opacity: f32::from(record.0[43]) / 255.0,
    }
}
