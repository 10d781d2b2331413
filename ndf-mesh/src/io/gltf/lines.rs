//! Lines in space, of primitives of lines.

use std::io::{self, Write};
use std::path::Path;

use ndf_core::DVec3;
use serde_json::json;

use super::super::FileDefect;
use super::json::{Mode, Primitive};
use super::layout::{ELEMENTS, Parts, UNSIGNED_INT, origin, scene, write_positions};
use super::{Document, container};

/// Points, and segments between them.
type Segments = (Vec<DVec3>, Vec<[u32; 2]>);

/// The lines of a scene. Points of different primitives are not joined.
pub(in super::super) fn lines(bytes: &[u8], path: &Path) -> Result<Segments, FileDefect> {
    let document = Document::parse(bytes, path.parent().unwrap_or(Path::new("")))?;
    let (mut all_points, mut segments) = Segments::default();
    let mut left = document.max_numbers();
    for placed in document.placed_meshes()? {
        let primitives = document.primitives(placed.mesh);
        left = left
            .checked_sub(primitives.len().max(1))
            .ok_or_else(|| document.too_many(primitives.len(), "the list of its parts"))?;
        for primitive in primitives {
            let Some(&position) = primitive.attributes.get("POSITION").filter(|_| is_of_lines(primitive))
            else {
                continue;
            };
            let count = document.count(position)?;
            left = left
                .checked_sub(count.max(1).saturating_mul(3))
                .ok_or_else(|| document.too_many(count, "POSITION"))?;
            let points = document.numbers(position, 3, "POSITION")?;
            let first = all_points.len() as u32;
            let place = |&[x, y, z]: &[f32; 3]| {
                placed.affine.transform_point3(DVec3::new(x.into(), y.into(), z.into()))
            };
            all_points.extend(points.as_chunks::<3>().0.iter().map(place));
            let corners = match primitive.indices {
                Some(indices) => {
                    let count = document.count(indices)?;
                    left = left.checked_sub(count).ok_or_else(|| document.too_many(count, "indices"))?;
                    document.indices(indices)?
                }
                None => (0..count as u32).collect(),
            };
            if let Some(corner) = corners.iter().find(|&&corner| corner as usize >= count) {
                let text = format!("a line ends at vertex {corner} of a part with {count} vertices");
                return Err(FileDefect::mismatch(text));
            }
            let step = if primitive.mode == Mode::LINES { 2 } else { 1 };
            let ends = corners.windows(2).step_by(step).map(|pair| [first + pair[0], first + pair[1]]);
            segments.extend(ends);
            if let (Mode::LINE_LOOP, [start, .., end]) = (primitive.mode, corners.as_slice()) {
                segments.push([first + end, first + start]);
            }
        }
    }
    Ok((all_points, segments))
}

fn is_of_lines(primitive: &Primitive) -> bool {
    [Mode::LINES, Mode::LINE_LOOP, Mode::LINE_STRIP].contains(&primitive.mode)
}

/// Writes lines as binary glTF: one primitive of segments.
pub(in super::super) fn write_lines(
    out: &mut dyn Write,
    points: &[DVec3],
    segments: &[[u32; 2]],
) -> io::Result<()> {
    let mut parts = Parts::default();
    let indices = parts.add("SCALAR", UNSIGNED_INT, 4, 2 * segments.len(), ELEMENTS);
    let origin = origin(points);
    let position = parts.add_positions(points, origin);
    let primitive =
        json!({ "attributes": { "POSITION": position }, "indices": indices, "mode": Mode::LINES.0 });
    let json = scene(json!({ "primitives": [primitive] }), &parts, origin).to_string();
    container::write(out, json.as_bytes(), parts.bytes, |out| {
        segments.as_flattened().iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
        write_positions(out, points, origin)
    })
}
