//! Niantic's SPZ: attributes one after the other; versions 1 to 3 in gzip, version 4 each in Zstandard.

use std::io::Read;

use flate2::read::GzDecoder;
use half::f16;
use ndf_mesh::io::FileDefect;

use super::{SPZ_MAGIC, Splat, SplatError};

/// What the contents may be, in sizes of the file. Rounded attributes shrink to a half or a third.
const MAX_GROWTH: u64 = 64;

/// Bytes of a splat at most: with harmonics of degree 3.
const MAX_SPLAT: u64 = 65;

/// Whether gzip holds something that begins like this.
pub(super) fn begins_within_gzip(bytes: &[u8], magic: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b]) && inflated(bytes, magic.len() as u64).is_ok_and(|b| b == magic)
}

/// The first bytes of what gzip holds.
fn inflated(bytes: &[u8], limit: u64) -> Result<Vec<u8>, FileDefect> {
    let mut contents = Vec::new();
    let read = GzDecoder::new(bytes).take(limit).read_to_end(&mut contents);
    read.map(|_| contents).map_err(|e| FileDefect::undecodable(format!("as gzip: {e}")))
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Splat>, SplatError> {
    if bytes.starts_with(SPZ_MAGIC) {
        return plain(bytes);
    }
    let header = Header::parse(&inflated(bytes, HEADER)?)?;
    header.check_count(bytes.len())?;
    plain(&inflated(bytes, HEADER + MAX_SPLAT * header.count as u64)?)
}

/// Bytes of the header.
const HEADER: u64 = 16;

/// Magic, version, number of splats, degree of the harmonics, fractional bits, flags.
struct Header {
    version: u32,
    count: usize,
    fractional_bits: u32,
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Self, SplatError> {
        let word = |i: usize| {
            let word = bytes.get(4 * i..4 * i + 4).and_then(|word| word.try_into().ok());
            word.map(u32::from_le_bytes).ok_or_else(|| FileDefect::truncated("the header is cut off"))
        };
        let version = word(1)?;
        if !(1..=4).contains(&version) {
            return Err(SplatError::Version(version));
        }
        let fractional_bits = word(3)? >> 8 & 0xff;
        if fractional_bits > 23 {
            let text = format!("positions have {fractional_bits} bits after the point of 24 in all");
            return Err(FileDefect::value(text).into());
        }
        Ok(Self { version, count: word(2)? as usize, fractional_bits })
    }

    /// Whether a file of so many bytes can hold the splats that are announced.
    fn check_count(&self, bytes: usize) -> Result<(), FileDefect> {
        let needed: u64 = self.sizes().map(|size| size as u64).iter().sum();
        if needed > MAX_GROWTH * bytes as u64 {
            let text = format!("{} splats are too many for the size of the file", self.count);
            return Err(FileDefect::too_large(text));
        }
        Ok(())
    }

    /// Bytes of positions, opacities, colours, scales and rotations.
    fn sizes(&self) -> [usize; 5] {
        let position = if self.version == 1 { 6 } else { 9 };
        let rotation = if self.version < 3 { 3 } else { 4 };
        [position, 1, 3, 3, rotation].map(|size| size * self.count)
    }
}

fn plain(bytes: &[u8]) -> Result<Vec<Splat>, SplatError> {
    let header = Header::parse(bytes)?;
    // Nothing is reserved before it is known that the bytes are there.
    if header.version < 4 {
        let mut rest = &bytes[16..];
        let mut parts = [&[][..]; 5];
        for (part, size) in parts.iter_mut().zip(header.sizes()) {
            let split = rest.split_at_checked(size);
            (*part, rest) = split.ok_or_else(|| too_short(&header))?;
        }
        return Ok(splats(&header, parts));
    }
    header.check_count(bytes.len())?;
    let streams = zstandard_streams(bytes, &header)?;
    let [positions, opacities, colours, scales, rotations] = &streams;
    Ok(splats(&header, [positions, opacities, colours, scales, rotations]))
}

fn too_short(header: &Header) -> FileDefect {
    FileDefect::truncated(format!("it announces {} splats, more than its contents hold", header.count))
}

/// Version 4: the number of streams in byte 15, where their table begins in the next four; for each its packed and
/// unpacked size, then the streams.
fn zstandard_streams(bytes: &[u8], header: &Header) -> Result<[Vec<u8>; 5], FileDefect> {
    let cut_off = || FileDefect::truncated("the table of its streams is cut off");
    let count = usize::from(*bytes.get(15).ok_or_else(cut_off)?);
    let table = bytes.get(16..20).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let table = table.ok_or_else(cut_off)? as usize;
    let mut at = table.saturating_add(16 * count);
    let mut streams: [Vec<u8>; 5] = Default::default();
    if count < streams.len() {
        return Err(FileDefect::mismatch(format!("it has {count} streams instead of at least 5")));
    }
    for (i, (stream, size)) in streams.iter_mut().zip(header.sizes()).enumerate() {
        let entry = table.checked_add(16 * i).and_then(|i| bytes.get(i..i + 8)).ok_or_else(cut_off)?;
        let packed = u64::from_le_bytes(entry.try_into().expect("eight bytes"));
        let end =
            usize::try_from(packed).ok().and_then(|packed| at.checked_add(packed)).ok_or_else(cut_off)?;
        let source = bytes.get(at..end).ok_or_else(cut_off)?;
        at = end;
        let broken =
            |e: &dyn std::fmt::Display| FileDefect::undecodable(format!("stream {i} as Zstandard: {e}"));
        let decoder = ruzstd::decoding::StreamingDecoder::new(source).map_err(|e| broken(&e))?;
        decoder.take(size as u64).read_to_end(stream).map_err(|e| broken(&e))?;
        if stream.len() < size {
            return Err(too_short(header));
        }
    }
    Ok(streams)
}

fn splats(header: &Header, parts: [&[u8]; 5]) -> Vec<Splat> {
    let [positions, opacities, _, scales, rotations] = parts;
    let [position_size, _, _, _, rotation_size] = header.sizes().map(|size| size / header.count.max(1));
    let unit = 1.0 / (1_u32 << header.fractional_bits) as f32;
    let coordinate = |bytes: &[u8]| match *bytes {
        [a, b] => f16::from_le_bytes([a, b]).to_f32(),
        // Twenty-four bits with a sign.
        [a, b, c] => (i32::from_le_bytes([0, a, b, c]) >> 8) as f32 * unit,
        _ => f32::NAN,
    };
    let splat = |i: usize| {
        let position: Vec<f32> = positions[i * position_size..][..position_size]
            .chunks(position_size / 3)
            .map(coordinate)
            .collect();
        let scale = |k: usize| (f32::from(scales[3 * i + k]) / 16.0 - 10.0).exp();
        let bytes = &rotations[i * rotation_size..][..rotation_size];
        let [w, x, y, z] = if rotation_size == 3 { first_three(bytes) } else { smallest_three(bytes) };
        Splat {
            // Right, up, back here; right, down, front in the authors' files: half a turn about x.
            center: [position[0], -position[1], -position[2]].map(f64::from),
            scales: [0, 1, 2].map(scale),
            rotation: [w, x, -y, -z],
            opacity: f32::from(opacities[i]) / 255.0,
        }
    };
    (0..header.count).map(splat).collect()
}

/// x, y and z in a byte each; w is not negative.
fn first_three(bytes: &[u8]) -> [f32; 4] {
    let [x, y, z] = [0, 1, 2].map(|k| f32::from(bytes[k]) / 127.5 - 1.0);
    let w = (1.0 - (x * x + y * y + z * z)).max(0.0).sqrt();
    [w, x, y, z]
}

/// The number of the largest of x, y, z, w in two bits, then the others in ten each: a sign and nine bits of
/// magnitude, the last in the lowest.
fn smallest_three(bytes: &[u8]) -> [f32; 4] {
    let mut word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let largest = (word >> 30) as usize;
    let mut all = [0.0; 4];
    let mut squares = 0.0;
    for k in (0..4).rev().filter(|&k| k != largest) {
        let magnitude = std::f32::consts::FRAC_1_SQRT_2 * (word & 511) as f32 / 511.0;
        all[k] = if word & 512 != 0 { -magnitude } else { magnitude };
        squares += magnitude * magnitude;
        word >>= 10;
    }
    all[largest] = (1.0_f32 - squares).max(0.0).sqrt();
    let [x, y, z, w] = all;
    [w, x, y, z]
}
