//! Micromeshes as bytes.

use super::layout::{are_graded, places};
use super::{DISPLACEMENT_BITS, MAX_LEVEL, Micromesh};
use half::f16;

/// Bits of a level.
const LEVEL_BITS: u32 = 3;

/// Why bytes are no micromesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MicromeshFileError {
    /// The bytes end early, or go on.
    #[error("the file has {found} bytes, but its {faces} faces need another number")]
    Length {
        /// How many bytes there are.
        found: usize,
        /// How many faces the file announces.
        faces: u32,
    },
    /// A face names a vertex that does not exist, or has a level that does not.
    #[error("face {0} has a corner or a level that does not exist")]
    Face(u32),
    /// A vertex is in no face.
    #[error("vertex {0} is in no face")]
    Vertex(u32),
    /// The levels of two neighbours differ by more than one.
    #[error("the levels of two faces at an edge differ by more than one")]
    Levels,
    /// A coordinate is not finite.
    #[error("a position or direction is not finite")]
    NotFinite,
}

/// Bits that name one of so many things.
fn index_bits(count: usize) -> u32 {
    usize::BITS - count.saturating_sub(1).leading_zeros()
}

impl Micromesh {
    /// The file: see the [module](super).
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        bytes.extend((self.positions.len() as u32).to_le_bytes());
        bytes.extend((self.faces.len() as u32).to_le_bytes());
        bytes.extend(self.scale.to_le_bytes());
        bytes.extend(self.positions.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(self.directions.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        let mut bits = BitWriter { bytes, filled: 0 };
        let corner_bits = index_bits(self.positions.len());
        self.faces.as_flattened().iter().for_each(|&v| bits.push(v, corner_bits));
        self.levels.iter().for_each(|&level| bits.push(u32::from(level), LEVEL_BITS));
        let values = self.displacements.iter().flatten();
        values.for_each(|&value| bits.push(u32::from(value), DISPLACEMENT_BITS));
        bits.bytes
    }

    /// Reads what [`to_bytes`](Self::to_bytes) wrote.
    ///
    /// # Errors
    /// See [`MicromeshFileError`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, MicromeshFileError> {
        let word =
            |i: usize| bytes.get(4 * i..4 * i + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        let (Some(vertices), Some(face_count), Some(scale)) = (word(0), word(1), word(2)) else {
            return Err(MicromeshFileError::Length { found: bytes.len(), faces: 0 });
        };
        let length = MicromeshFileError::Length { found: bytes.len(), faces: face_count };
        let (v, f) = (vertices as usize, face_count as usize);
        let corner_bits = index_bits(v);
        let rest = bytes.get(12..).and_then(|rest| rest.get(18 * v..)).ok_or(length)?;
        // Nothing is allocated for faces that cannot be there.
        if (3 * corner_bits + LEVEL_BITS) as usize * f > 8 * rest.len() {
            return Err(length);
        }
        let scale = f32::from_bits(scale);
        let read = |start: usize, size: usize| bytes[start..start + size * 3 * v].chunks_exact(size);
        let positions: Vec<f32> = read(12, 4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let directions: Vec<f16> = read(12 + 12 * v, 2).map(|b| f16::from_le_bytes([b[0], b[1]])).collect();
        let is_finite = scale.is_finite()
            && positions.iter().all(|x| x.is_finite())
            && directions.iter().all(|x| x.is_finite());
        if !is_finite {
            return Err(MicromeshFileError::NotFinite);
        }
        let mut bits = BitReader { bytes: rest, place: 0 };
        let mut next = |count: u32| bits.pull(count).ok_or(length);
        let mut faces = Vec::with_capacity(f);
        for face in 0..face_count {
            let corners = [next(corner_bits)?, next(corner_bits)?, next(corner_bits)?];
            let [a, b, c] = corners;
            if corners.iter().any(|&corner| corner >= vertices) || a == b || b == c || c == a {
                return Err(MicromeshFileError::Face(face));
            }
            faces.push(corners);
        }
        let mut is_used = vec![false; v];
        faces.as_flattened().iter().for_each(|&corner| is_used[corner as usize] = true);
        if let Some(unused) = is_used.iter().position(|used| !used) {
            return Err(MicromeshFileError::Vertex(unused as u32));
        }
        let mut levels = Vec::with_capacity(f);
        for face in 0..face_count {
            let level = next(LEVEL_BITS)? as u8;
            if level > MAX_LEVEL {
                return Err(MicromeshFileError::Face(face));
            }
            levels.push(level);
        }
        let mut displacements = Vec::with_capacity(f);
        for &level in &levels {
            let values = (0..places(level)).map(|_| Ok(next(DISPLACEMENT_BITS)? as u16));
            displacements.push(values.collect::<Result<Vec<u16>, MicromeshFileError>>()?);
        }
        if bits.place.div_ceil(8) != rest.len() {
            return Err(length);
        }
        if !are_graded(&faces, &levels) {
            return Err(MicromeshFileError::Levels);
        }
        Ok(Self {
            positions: positions.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect(),
            directions: directions.chunks_exact(3).map(|d| [d[0], d[1], d[2]]).collect(),
            scale,
            faces,
            levels,
            displacements,
        })
    }
}

/// Bits after bytes, the lowest first.
struct BitWriter {
    bytes: Vec<u8>,
    /// Bits of the last byte that are taken; 0 if there is none to be filled.
    filled: u32,
}

impl BitWriter {
    fn push(&mut self, value: u32, count: u32) {
        for bit in 0..count {
            if self.filled == 0 {
                self.bytes.push(0);
            }
            if let Some(last) = self.bytes.last_mut() {
                *last |= ((value >> bit & 1) as u8) << self.filled;
            }
            self.filled = (self.filled + 1) % 8;
        }
    }
}

struct BitReader<'a> {
    bytes: &'a [u8],
    /// Bits read.
    place: usize,
}

impl BitReader<'_> {
    fn pull(&mut self, count: u32) -> Option<u32> {
        let mut value = 0;
        for bit in 0..count {
            let byte = *self.bytes.get(self.place / 8)?;
            value |= u32::from(byte >> (self.place % 8) & 1) << bit;
            self.place += 1;
        }
        Some(value)
    }
}
