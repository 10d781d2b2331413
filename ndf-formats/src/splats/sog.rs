//! SOG of PlayCanvas, version 2: a zip archive of lossless WebP images, in which a pixel is a splat, and `meta.json`, which
//! names them and has the ranges of places and the table of scales.
//!
//! Places are 16 bits an axis of sign(x) ln(1 + |x|), scales are places in a table of logarithms, quaternions w, x, y, z
//! have their largest component left out, and opacities are bytes.

use std::f32::consts::FRAC_1_SQRT_2;
use std::io::Cursor;

use image_webp::WebPDecoder;
use ndf_mesh::io::FileDefect;
use serde::Deserialize;

use super::{Splat, SplatError};
use crate::tensors::Archive;

/// The most splats, in bytes of the file: they take some ten each, less where images are of one colour.
const MAX_GROWTH: usize = 64;

/// The most pixels that an image has beyond the splats: its last rows need not be full.
const MAX_PADDING: u64 = 1 << 16;

#[derive(Deserialize)]
struct Meta {
    #[serde(default)]
    version: u32,
    #[serde(default)]
    count: usize,
    means: Part,
    scales: Part,
    quats: Part,
    sh0: Part,
}

/// Images of a property, and what their numbers mean.
#[derive(Deserialize)]
struct Part {
    files: Vec<String>,
    #[serde(default)]
    mins: Vec<f64>,
    #[serde(default)]
    maxs: Vec<f64>,
    #[serde(default)]
    codebook: Vec<f32>,
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Splat>, SplatError> {
    let mut archive = Archive::open(bytes)?;
    let names = archive.names();
    let meta = names.iter().find(|name| name.ends_with("meta.json"));
    let meta = meta.ok_or_else(|| FileDefect::missing("it has no meta.json"))?;
    let folder = meta.strip_suffix("meta.json").unwrap_or_default();
    let meta: Meta = serde_json::from_slice(&archive.read(meta)?)
        .map_err(|e| FileDefect::undecodable(format!("meta.json: {e}")))?;
    if meta.version != 2 {
        let text = "this version of SOG is not read, version 2 is; convert it to .ply with splat-transform";
        return Err(FileDefect::unsupported(text).into());
    }
    if meta.count > MAX_GROWTH * bytes.len() {
        let text = format!("{} splats are too many for the size of the file", meta.count);
        return Err(FileDefect::too_large(text).into());
    }
    let mut image = |part: &Part, i: usize| -> Result<Vec<[u8; 4]>, FileDefect> {
        let name = part.files.get(i).ok_or_else(|| FileDefect::missing("meta.json names too few images"))?;
        let most = 2 * meta.count as u64 + MAX_PADDING;
        let pixels = pixels(&archive.read(&format!("{folder}{name}"))?, name, most)?;
        if pixels.len() < meta.count {
            let (found, count) = (pixels.len(), meta.count);
            return Err(FileDefect::mismatch(format!("{name} has {found} pixels for {count} splats")));
        }
        Ok(pixels)
    };
    let (low, high) = (image(&meta.means, 0)?, image(&meta.means, 1)?);
    let (scales, quats, colours) = (image(&meta.scales, 0)?, image(&meta.quats, 0)?, image(&meta.sh0, 0)?);
    let (mins, maxs, table) = (&meta.means.mins, &meta.means.maxs, &meta.scales.codebook);
    if mins.len() != 3 || maxs.len() != 3 || table.len() != 256 {
        return Err(FileDefect::mismatch("meta.json needs three ranges of means and 256 scales").into());
    }
    let splat = |i: usize| Splat {
        center: [0, 1, 2].map(|axis| {
            let t = f64::from(u16::from_le_bytes([low[i][axis], high[i][axis]])) / 65535.0;
            let x = mins[axis] + t * (maxs[axis] - mins[axis]);
            x.abs().exp_m1().copysign(x)
        }),
        scales: [0, 1, 2].map(|axis| table[usize::from(scales[i][axis])].exp()),
        rotation: rotation(quats[i]),
        opacity: f32::from(colours[i][3]) / 255.0,
    };
    Ok((0..meta.count).map(splat).collect())
}

/// A quaternion of which three components are bytes of [−1/√2, 1/√2], and the last byte names the fourth. What names none is
/// no rotation.
fn rotation([a, b, c, largest]: [u8; 4]) -> [f32; 4] {
    let component = |byte: u8| (f32::from(byte) / 127.5 - 1.0) * FRAC_1_SQRT_2;
    let three = [a, b, c].map(component);
    let Some(place @ 0..=3) = largest.checked_sub(252).map(usize::from) else { return [0.0; 4] };
    let fourth = (1.0 - three.iter().map(|x| x * x).sum::<f32>()).max(0.0).sqrt();
    let mut others = three.into_iter();
    [0, 1, 2, 3].map(|k| if k == place { fourth } else { others.next().unwrap_or(0.0) })
}

/// The pixels of a WebP image that has so many at most.
fn pixels(bytes: &[u8], name: &str, most: u64) -> Result<Vec<[u8; 4]>, FileDefect> {
    let wrong = |e: image_webp::DecodingError| FileDefect::undecodable(format!("{name}: {e}"));
    let mut decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(wrong)?;
    let (width, height) = decoder.dimensions();
    let count = u64::from(width) * u64::from(height);
    if count > most {
        return Err(FileDefect::too_large(format!("{name}: {count} pixels are too many for its splats")));
    }
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    let mut data = vec![0; count as usize * channels];
    decoder.read_image(&mut data).map_err(wrong)?;
    let pixel = |p: &[u8]| [p[0], p[1], p[2], p.get(3).copied().unwrap_or(255)];
    Ok(data.chunks_exact(channels).map(pixel).collect())
}
