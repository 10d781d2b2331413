//! Binary glTF with the extension `KHR_gaussian_splatting`: points whose attributes are linear scales, opacities and
//! quaternions x, y, z, w, in the coordinates of glTF.

use ndf_core::DVec3;
use ndf_core::glam::{DAffine3, DMat4, DQuat};
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
    let mut splats = Vec::new();
    for (mesh, affine) in placed_meshes(&root)? {
        for primitive in list(&root["meshes"][mesh]["primitives"]) {
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
            let place = Placement::new(affine)?;
            let attribute =
                |name: &str, width: usize| file.numbers(&primitive["attributes"][name], name, width);
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
            splats.extend((0..count).map(|i| {
                place.moved(&Splat {
                    center: [0, 1, 2].map(|k| f64::from(positions[3 * i + k])),
                    scales: [0, 1, 2].map(|k| scales[3 * i + k]),
                    rotation: [3, 0, 1, 2].map(|k| rotations[4 * i + k]),
                    opacity: opacities[i],
                })
            }));
        }
    }
    Ok(splats)
}

/// A similarity of space.
#[derive(Clone, Copy, Debug)]
struct Placement {
    affine: DAffine3,
    scale: f64,
    rotation: DQuat,
}

/// How far axes of a node may be from equal lengths and right angles.
const EVEN: f64 = 1e-5;

impl Placement {
    /// A transformation that keeps angles; splats under any other have other axes.
    fn new(affine: DAffine3) -> Result<Self, FileDefect> {
        let axes = [affine.x_axis, affine.y_axis, affine.z_axis];
        let scale = affine.matrix3.determinant().cbrt();
        let is_even = scale > 0.0
            && (0..3).all(|i| {
                (axes[i].length() / scale - 1.0).abs() < EVEN
                    && axes[i].dot(axes[(i + 1) % 3]).abs() < EVEN * scale * scale
            });
        if !is_even {
            return Err(FileDefect::unsupported(
                "a node stretches or mirrors its splats, which is not read; apply its transformation",
            ));
        }
        Ok(Self { affine, scale, rotation: DQuat::from_mat3(&(affine.matrix3 * scale.recip())) })
    }

    fn moved(&self, splat: &Splat) -> Splat {
        if self.affine == DAffine3::IDENTITY {
            return *splat;
        }
        let [w, x, y, z] = splat.rotation.map(f64::from);
        let turned = self.rotation * DQuat::from_xyzw(x, y, z, w);
        Splat {
            center: self.affine.transform_point3(DVec3::from_array(splat.center)).to_array(),
            scales: splat.scales.map(|s| s * self.scale as f32),
            rotation: [turned.w, turned.x, turned.y, turned.z].map(|q| q as f32),
            opacity: splat.opacity,
        }
    }
}

/// The meshes of the scene where its nodes have them; every mesh where it is, if no node has one. O(nodes).
fn placed_meshes(root: &Value) -> Result<Vec<(usize, DAffine3)>, FileDefect> {
    let nodes: Vec<&Value> = list(&root["nodes"]).collect();
    let index = |value: &Value| value.as_u64().map(|i| i as usize);
    if nodes.iter().all(|node| node["mesh"].is_null()) {
        return Ok((0..list(&root["meshes"]).count()).map(|mesh| (mesh, DAffine3::IDENTITY)).collect());
    }
    let children = |node: &Value| list(&node["children"]).filter_map(index).collect::<Vec<usize>>();
    let scene = list(&root["scenes"]).nth(index(&root["scene"]).unwrap_or(0));
    let mut is_child = vec![false; nodes.len()];
    nodes
        .iter()
        .flat_map(|node| children(node))
        .filter(|&i| i < nodes.len())
        .for_each(|i| is_child[i] = true);
    let roots: Vec<usize> = match scene {
        Some(scene) => list(&scene["nodes"]).filter_map(index).collect(),
        None => (0..nodes.len()).filter(|&i| !is_child[i]).collect(),
    };
    let mut waiting: Vec<(usize, DAffine3)> =
        roots.into_iter().rev().map(|i| (i, DAffine3::IDENTITY)).collect();
    let mut is_seen = vec![false; nodes.len()];
    let mut placed = Vec::new();
    while let Some((i, above)) = waiting.pop() {
        let node = nodes.get(i).ok_or_else(|| FileDefect::mismatch("it names a node that is not there"))?;
        if std::mem::replace(&mut is_seen[i], true) {
            return Err(FileDefect::mismatch("a node is the child of two others, or of itself"));
        }
        let affine = above * local(node);
        placed.extend(index(&node["mesh"]).map(|mesh| (mesh, affine)));
        waiting.extend(children(node).into_iter().rev().map(|child| (child, affine)));
    }
    if scene.is_none() && is_seen.contains(&false) {
        return Err(FileDefect::mismatch("a node is the child of itself"));
    }
    Ok(placed)
}

/// The transformation of a node in that of its parent: a matrix by columns, or translation, rotation and scale.
fn local(node: &Value) -> DAffine3 {
    let numbers = |key: &str| list(&node[key]).filter_map(Value::as_f64).collect::<Vec<f64>>();
    if let Ok(matrix) = <[f64; 16]>::try_from(numbers("matrix")) {
        return DAffine3::from_mat4(DMat4::from_cols_array(&matrix));
    }
    let three = |key: &str, usual: DVec3| <[f64; 3]>::try_from(numbers(key)).map_or(usual, DVec3::from_array);
    let rotation = <[f64; 4]>::try_from(numbers("rotation")).map_or(DQuat::IDENTITY, DQuat::from_array);
    let rotation = if rotation.length() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    DAffine3::from_scale_rotation_translation(
        three("scale", DVec3::ONE),
        rotation,
        three("translation", DVec3::ZERO),
    )
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

/// How a number is read.
type Number = fn(&[u8]) -> f32;

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
        let (size, largest, number): (usize, f32, Number) = match accessor["componentType"].as_u64() {
            Some(5126) => (4, 1.0, |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Some(5120) => (1, 127.0, |b| f32::from(b[0].cast_signed())),
            Some(5121) => (1, 255.0, |b| f32::from(b[0])),
            Some(5122) => (2, 32767.0, |b| f32::from(i16::from_le_bytes([b[0], b[1]]))),
            Some(5123) => (2, 65535.0, |b| f32::from(u16::from_le_bytes([b[0], b[1]]))),
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
        // Normalised integers are fractions of the largest one.
        let is_normalised = size < 4 && accessor["normalized"] == true;
        let value = |bytes: &[u8]| {
            let number = number(bytes);
            if is_normalised { (number / largest).max(-1.0) } else { number }
        };
        let item = |i: usize| (0..width).map(move |k| value(&data[i * stride + k * size..]));
        Ok((0..count).flat_map(item).collect())
    }
}
