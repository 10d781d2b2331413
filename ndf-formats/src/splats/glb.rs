//! Binary glTF with the extension `KHR_gaussian_splatting`: points whose attributes are linear scales, opacities and
//! quaternions x, y, z, w, in the coordinates of glTF.

use ndf_mesh::io::FileDefect;
use serde_json::Value;

use super::{Splat, SplatError};

const EXTENSION: &str = "KHR_gaussian_splatting";

/// Whether a file of binary glTF names the extension.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    let extension = EXTENSION.as_bytes();
    chunks(bytes).is_ok_and(|(json, _)| json.windows(extension.len()).any(|word| word == extension))
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Splat>, SplatError> {
    let (json, buffer) = chunks(bytes)?;
    let root: Value =
        serde_json::from_slice(json).map_err(|e| FileDefect::undecodable(format!("its JSON: {e}")))?;
    let file = File { root: &root, buffer };
    let is_moved =
        |node: &Value| ["matrix", "translation", "rotation", "scale"].iter().any(|key| !node[key].is_null());
    if list(&root["nodes"]).any(is_moved) {
        return Err(FileDefect::unsupported(
            "its nodes are moved, which is not read; apply their transformations",
        )
        .into());
    }
    let mut splats = Vec::new();
    for primitive in list(&root["meshes"]).flat_map(|mesh| list(&mesh["primitives"])) {
        let extension = &primitive["extensions"][EXTENSION];
        if extension.is_null() {
            continue;
        }
        if extension["extensions"].as_object().is_some_and(|packed| !packed.is_empty()) {
            return Err(FileDefect::unsupported(
                "its splats are compressed, which is not read; save them uncompressed",
            )
            .into());
        }
        let attribute = |name: &str, width: usize| file.numbers(&primitive["attributes"][name], name, width);
        let positions = attribute("POSITION", 3)?;
        let rotations = attribute("KHR_gaussian_splatting:ROTATION", 4)?;
        let scales = attribute("KHR_gaussian_splatting:SCALE", 3)?;
        let opacities = attribute("KHR_gaussian_splatting:OPACITY", 1)?;
        let count = opacities.len();
        if positions.len() != 3 * count || rotations.len() != 4 * count || scales.len() != 3 * count {
            return Err(FileDefect::mismatch("its attributes are of different lengths").into());
        }
        // Primitives may share their numbers, but not without end.
        if splats.len() + count > bytes.len() {
            return Err(FileDefect::too_large("its primitives have more splats than it has bytes").into());
        }
        splats.extend((0..count).map(|i| Splat {
            center: [0, 1, 2].map(|k| f64::from(positions[3 * i + k])),
            scales: [0, 1, 2].map(|k| scales[3 * i + k]),
            rotation: [3, 0, 1, 2].map(|k| rotations[4 * i + k]),
            opacity: opacities[i],
        }));
    }
    Ok(splats)
}

/// The JSON and the numbers of a file.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), FileDefect> {
    let cut_off = || FileDefect::truncated("it ends within its chunks");
    let chunk = |at: usize| -> Result<(&[u8], usize), FileDefect> {
        let length = bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        let from = at + 8;
        let to = length.and_then(|length| from.checked_add(length as usize)).ok_or_else(cut_off)?;
        Ok((bytes.get(from..to).ok_or_else(cut_off)?, to))
    };
    let (json, end) = chunk(12)?;
    let buffer = if end < bytes.len() { chunk(end)?.0 } else { &[] };
    Ok((json, buffer))
}

/// The items of an array; none if it is none.
fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

struct File<'a> {
    root: &'a Value,
    buffer: &'a [u8],
}

impl File<'_> {
    /// The numbers of an accessor of so many components.
    fn numbers(&self, accessor: &Value, name: &str, width: usize) -> Result<Vec<f32>, FileDefect> {
        let missing = || FileDefect::missing(format!("its splats have no attribute {name}"));
        let whole = |value: &Value| value.as_u64().map_or(0, |n| n as usize);
        let accessor = &self.root["accessors"][accessor.as_u64().ok_or_else(missing)? as usize];
        let view = &self.root["bufferViews"][whole(&accessor["bufferView"])];
        // Fractions of the largest number, where integers are normalised.
        let (size, number): (usize, fn(&[u8]) -> f32) = match accessor["componentType"].as_u64() {
            Some(5126) => (4, |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Some(5120) => (1, |b| (f32::from(b[0].cast_signed()) / 127.0).max(-1.0)),
            Some(5121) => (1, |b| f32::from(b[0]) / 255.0),
            Some(5122) => (2, |b| (f32::from(i16::from_le_bytes([b[0], b[1]])) / 32767.0).max(-1.0)),
            Some(5123) => (2, |b| f32::from(u16::from_le_bytes([b[0], b[1]])) / 65535.0),
            _ => {
                return Err(FileDefect::unsupported(format!(
                    "{name} holds numbers of a kind that is not read"
                )));
            }
        };
        let (count, stride) = (whole(&accessor["count"]), whole(&view["byteStride"]).max(size * width));
        let start = whole(&view["byteOffset"]).checked_add(whole(&accessor["byteOffset"]));
        let end =
            count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size * width));
        let data = start
            .and_then(|start| self.buffer.get(start..))
            .filter(|data| end.is_some_and(|end| end <= data.len()));
        let data = data.ok_or_else(|| FileDefect::truncated(format!("{name} reaches beyond the file")))?;
        let item = |i: usize| (0..width).map(move |k| number(&data[i * stride + k * size..]));
        Ok((0..count).flat_map(item).collect())
    }
}
