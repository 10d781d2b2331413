//! What stands where in a file that is written.

use std::io::{self, Write};

use ndf_core::{BoundingBox, DVec3};
use serde_json::{Value, json};

use super::super::Rounding;

pub(super) const UNSIGNED_SHORT: u32 = 5123;
pub(super) const UNSIGNED_INT: u32 = 5125;
pub(super) const FLOAT: u32 = 5126;

/// What a part of the buffer is for.
pub(super) const VERTICES: u32 = 34962;
pub(super) const ELEMENTS: u32 = 34963;

/// The parts of a buffer, one after the other, each with a view and an accessor.
#[derive(Default)]
pub(super) struct Parts {
    views: Vec<Value>,
    accessors: Vec<Value>,
    pub(super) bytes: usize,
}

impl Parts {
    /// Adds a part of so many items; returns its accessor.
    pub(super) fn add(&mut self, shape: &str, kind: u32, size: usize, count: usize, target: u32) -> usize {
        let view = self.views.len();
        self.views.push(
            json!({ "buffer": 0, "byteOffset": self.bytes, "byteLength": size * count, "target": target }),
        );
        self.accessors
            .push(json!({ "bufferView": view, "componentType": kind, "count": count, "type": shape }));
        self.bytes += (size * count).next_multiple_of(4);
        view
    }

    pub(super) fn say(&mut self, accessor: usize, key: &str, value: Value) {
        self.accessors[accessor][key] = value;
    }

    /// Adds positions relative to `origin`, with the box that they fill as they are written.
    pub(super) fn add_positions(&mut self, positions: &[DVec3], origin: DVec3) -> usize {
        let start = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let (min, max) = positions.iter().fold(start, |(min, max), &p| {
            let p = single(p, origin).map(f64::from);
            ([0, 1, 2].map(|k| min[k].min(p[k])), [0, 1, 2].map(|k| max[k].max(p[k])))
        });
        let accessor = self.add("VEC3", FLOAT, 12, positions.len(), VERTICES);
        self.say(accessor, "min", json!(min));
        self.say(accessor, "max", json!(max));
        accessor
    }
}

/// What a file says of itself.
pub(super) fn asset() -> Value {
    json!({
        "version": "2.0",
        "generator": concat!("ndf ", env!("CARGO_PKG_VERSION")),
        "extras": { "positions": "in the units and axes of the input" },
    })
}

/// A document of one mesh, whose node leads to `origin`.
pub(super) fn scene(mesh: Value, parts: &Parts, origin: DVec3) -> Value {
    let node = if origin == DVec3::ZERO {
        json!({ "mesh": 0 })
    } else {
        json!({ "mesh": 0, "translation": origin.to_array() })
    };
    json!({
        "asset": asset(),
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [node],
        "meshes": [mesh],
        "accessors": parts.accessors,
        "bufferViews": parts.views,
        "buffers": [{ "byteLength": parts.bytes }],
    })
}

/// The point to which positions are relative: the origin, unless single precision would move them visibly.
pub(super) fn origin(positions: &[DVec3]) -> DVec3 {
    if Rounding::to_single(positions).is_coarse() {
        BoundingBox::of_points(positions).center()
    } else {
        DVec3::ZERO
    }
}

pub(super) fn single(position: DVec3, origin: DVec3) -> [f32; 3] {
    (position - origin).as_vec3().to_array()
}

/// Writes positions relative to `origin`.
pub(super) fn write_positions(out: &mut dyn Write, positions: &[DVec3], origin: DVec3) -> io::Result<()> {
    positions.iter().flat_map(|&p| single(p, origin)).try_for_each(|x| out.write_all(&x.to_le_bytes()))
}
