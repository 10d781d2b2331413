//! The faces around every crossed edge.
//!
//! The points of the four cells around an edge, from each to the next, lie in four tetrahedra with the edge in common.
//! Tetrahedra of different edges have no point inside in common, so that faces which keep to those of their edge never
//! cross (Ju and Udeshi 2006): a quadrilateral cut along a diagonal that stays in them, or else a fan around the 1-D point.

use ndf_core::DVec3;
use rayon::prelude::*;
use robust::{Coord3D, orient3d};

use super::complex::Complex;

/// What is around a crossed edge, counter-clockwise around its axis.
#[derive(Clone, Copy)]
struct Ring {
    /// Loops of the four cells.
    loops: [u32; 4],
    /// Segments between each cell and the next.
    segments: [u32; 4],
}

/// Vertices and faces of the surface.
pub(crate) struct Polygons {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) faces: Vec<[u32; 3]>,
}

/// Joins the points of loops (3-D), of segments (2-D) and of crossings (1-D). All of the first are vertices; those of
/// segments are if something has to be kept apart there, those of crossings if no diagonal serves.
pub(crate) fn polygons(
    complex: &Complex,
    on_edges: &[DVec3],
    in_faces: impl Fn(usize) -> DVec3,
    in_cells: Vec<DVec3>,
) -> Polygons {
    let mut positions = in_cells;
    let mut vertex_of_segment = vec![None; complex.segments.len()];
    for (i, segment) in complex.segments.iter().enumerate() {
        if !segment.region.is_empty() {
            vertex_of_segment[i] = Some(positions.len() as u32);
            positions.push(in_faces(i));
        }
    }
    let rings = rings(complex);
    let outline = |ring: &Ring| -> Vec<u32> {
        (0..4)
            .flat_map(|s| {
                [Some(ring.loops[s]), vertex_of_segment[ring.segments[s] as usize]].into_iter().flatten()
            })
            .collect()
    };
    let diagonals: Vec<Option<usize>> = rings
        .par_iter()
        .zip(&complex.crossings)
        .map(|(ring, crossing)| {
            let is_split = ring.segments.iter().any(|&s| vertex_of_segment[s as usize].is_some());
            let points = ring.loops.map(|l| positions[l as usize]);
            if is_split { None } else { sound_diagonal(points, crossing.ends) }
        })
        .collect();
    let mut faces = Vec::with_capacity(2 * rings.len());
    for (c, (ring, diagonal)) in rings.iter().zip(diagonals).enumerate() {
        let start = faces.len();
        if let Some(i) = diagonal {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| ring.loops[(i + k) % 4]);
            faces.extend([[a, b, c], [a, c, d]]);
        } else {
            let center = positions.len() as u32;
            positions.push(on_edges[c]);
            let around = outline(ring);
            faces.extend((0..around.len()).map(|i| [center, around[i], around[(i + 1) % around.len()]]));
        }
        if !complex.crossings[c].is_low_inside {
            faces[start..].iter_mut().for_each(|face| face.swap(1, 2));
        }
    }
    Polygons { positions, faces }
}

fn rings(complex: &Complex) -> Vec<Ring> {
    let mut rings = vec![Ring { loops: [u32::MAX; 4], segments: [u32::MAX; 4] }; complex.crossings.len()];
    for (l, of_cell) in (0..).zip(&complex.loops) {
        let n = of_cell.crossings.len();
        for (i, (&crossing, &slot)) in of_cell.crossings.iter().zip(&of_cell.slots).enumerate() {
            let ring = &mut rings[crossing as usize];
            ring.loops[usize::from(slot)] = l;
            let first_axis = (complex.crossings[crossing as usize].axis + 1) % 3;
            for segment in [of_cell.segments[i], of_cell.segments[(i + n - 1) % n]] {
                // The cells 0 and 1 meet in a face across the first of the two other axes, as do 2 and 3.
                let is_first = complex.segments[segment as usize].normal == first_axis;
                let place = match (slot, is_first) {
                    (0 | 1, true) => 0,
                    (1 | 2, false) => 1,
                    (2 | 3, true) => 2,
                    _ => 3,
                };
                ring.segments[place] = segment;
            }
        }
    }
    rings
}

/// The corner at which a diagonal of the quadrilateral begins that stays in the tetrahedra at the edge `ends`: it passes
/// through the triangle of the edge and the point of a cell between. The shorter one if both do.
fn sound_diagonal(points: [DVec3; 4], ends: [DVec3; 2]) -> Option<usize> {
    let is_sound = |i: usize| {
        let segment = [points[i], points[i + 2]];
        [points[i + 1], points[(i + 3) % 4]].into_iter().any(|p| pierces(segment, [ends[0], ends[1], p]))
    };
    let length = |i: usize| points[i].distance_squared(points[i + 2]);
    let order = if length(1) < length(0) { [1, 0] } else { [0, 1] };
    order.into_iter().find(|&i| is_sound(i))
}

/// Whether a segment passes through the interior of a triangle, decided exactly.
fn pierces([p, q]: [DVec3; 2], triangle: [DVec3; 3]) -> bool {
    let side = |points: [DVec3; 4]| {
        let [a, b, c, d] = points.map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
        orient3d(a, b, c, d)
    };
    let [a, b, c] = triangle;
    let (at_p, at_q) = (side([a, b, c, p]), side([a, b, c, q]));
    let around = [[a, b], [b, c], [c, a]].map(|[u, v]| side([p, q, u, v]));
    ((at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0))
        && (around.iter().all(|&s| s > 0.0) || around.iter().all(|&s| s < 0.0))
}
