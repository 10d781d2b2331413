//! PlayCanvas' PLY: for every 256 splats their ranges as floats, and four words a splat.

use ndf_mesh::io::FileDefect;
use serde::Deserialize;
use serde_ply::PlyReader;

use super::{Splat, SplatError};

/// Splats that share ranges.
const CHUNK: usize = 256;

/// The ranges of a chunk.
#[derive(Deserialize)]
struct Ranges {
    min_x: f32,
    min_y: f32,
    min_z: f32,
    max_x: f32,
    max_y: f32,
    max_z: f32,
    min_scale_x: f32,
    min_scale_y: f32,
    min_scale_z: f32,
    max_scale_x: f32,
    max_scale_y: f32,
    max_scale_z: f32,
}

/// A splat.
#[derive(Deserialize)]
struct Packed {
    packed_position: u32,
    packed_rotation: u32,
    packed_scale: u32,
    packed_color: u32,
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Splat>, SplatError> {
    let bad = |e: serde_ply::DeserializeError| FileDefect::undecodable(e.to_string());
    let mut reader = PlyReader::from_reader(bytes).map_err(bad)?;
    let (mut ranges, mut packed) = (Vec::<Ranges>::new(), Vec::<Packed>::new());
    while let Some(element) = reader.current_element().cloned() {
        // Every row of either has at least 16 bytes.
        if element.count as u128 * 16 > bytes.len() as u128 && element.name != "sh" {
            let (name, count) = (element.name, element.count);
            let text = format!("element {name} announces {count} rows, more than the file can hold");
            return Err(FileDefect::truncated(text).into());
        }
        match element.name.as_str() {
            "chunk" => ranges = reader.next_element().map_err(bad)?,
            "vertex" => packed = reader.next_element().map_err(bad)?,
            // Colours from other directions come last.
            _ => break,
        }
    }
    if packed.len() > ranges.len() * CHUNK {
        let (splats, chunks) = (packed.len(), ranges.len());
        let text = format!("{splats} splats need more than the {chunks} chunks it has");
        return Err(FileDefect::mismatch(text).into());
    }
    Ok(packed.iter().zip(ranges.iter().flat_map(|r| std::iter::repeat_n(r, CHUNK))).map(splat).collect())
}

fn splat((packed, ranges): (&Packed, &Ranges)) -> Splat {
    let position = by_eleven_ten_eleven(packed.packed_position);
    let scale = by_eleven_ten_eleven(packed.packed_scale);
    let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let r = ranges;
    Splat {
        center: [
            lerp(r.min_x, r.max_x, position[0]),
            lerp(r.min_y, r.max_y, position[1]),
            lerp(r.min_z, r.max_z, position[2]),
        ]
        .map(f64::from),
        scales: [
            lerp(r.min_scale_x, r.max_scale_x, scale[0]).exp(),
            lerp(r.min_scale_y, r.max_scale_y, scale[1]).exp(),
            lerp(r.min_scale_z, r.max_scale_z, scale[2]).exp(),
        ],
        rotation: rotation(packed.packed_rotation),
        opacity: (packed.packed_color & 255) as f32 / 255.0,
    }
}

fn by_eleven_ten_eleven(word: u32) -> [f32; 3] {
    let (x, y, z) = (word >> 21, word >> 11 & 1023, word & 2047);
    [x as f32 / 2047.0, y as f32 / 1023.0, z as f32 / 2047.0]
}

/// The three smaller parts of w, x, y, z in ten bits each, the number of the largest in two.
fn rotation(word: u32) -> [f32; 4] {
    let part = |shift: u32| ((word >> shift & 1023) as f32 / 1023.0 - 0.5) * std::f32::consts::SQRT_2;
    let small = [part(20), part(10), part(0)];
    let largest = (1.0 - small.iter().map(|x| x * x).sum::<f32>()).max(0.0).sqrt();
    let mut all = small.to_vec();
    all.insert((word >> 30) as usize, largest);
    [all[0], all[1], all[2], all[3]]
}
