//! Where the surface is: points on crossed edges (1-D), in crossed faces (2-D) and in cells (3-D), from inside and outside
//! alone.

use ndf_core::DVec3;
use ndf_core::glam::DMat3;
use rayon::prelude::*;

use super::complex::{Bound, Complex, Loop, Segment};
use super::occupancy::{Occupancy, Ray};

/// Bisections on a crossed edge.
const EDGE_BISECTIONS: u32 = 15;
/// The search across the chord of a face: its reach in cells, its steps, and bisections after them.
const ACROSS: (f64, u32, u32) = (0.8, 4, 11);
/// The searches along the chord.
const ALONG: (f64, u32, u32) = (0.71, 3, 12);
/// Heights over the chord, in cells, below which the surface is straight in a face: a few times what the bisections
/// leave open.
const STRAIGHT: f64 = 5e-4;
/// Weight of the rows that hold a point of a cell to the mean of those on its edges.
const PULL: f64 = 0.05;
/// Points keep this distance, in cells, from the ends of their edge and the sides of their face or cell, so that no face
/// of the mesh is without area.
const CLEARANCE: f64 = 1e-4;
/// Share of the clearance of a mean point that a point keeps from what bounds its region.
const KEPT: f64 = 0.1;

/// A crossed face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacePoint {
    /// The 2-D point.
    pub(crate) point: DVec3,
    /// Where the surface leads from the crossings at both ends of the segment: no unit vectors.
    pub(crate) tangents: [DVec3; 2],
}

/// 1-D points, by bisection.
pub(crate) fn on_edges(complex: &Complex, occupancy: &Occupancy<'_>, cell: f64) -> Vec<DVec3> {
    let ray = |c: &super::complex::Crossing| Ray {
        origin: c.ends[0],
        direction: DVec3::AXES[c.axis],
        starts_inside: c.is_low_inside,
    };
    let rays: Vec<Ray> = complex.crossings.iter().map(ray).collect();
    let found = occupancy.bisected(&rays, vec![Some([0.0, cell]); rays.len()], EDGE_BISECTIONS);
    let clear = CLEARANCE * cell;
    rays.iter()
        .zip(found)
        .map(|(ray, t)| {
            let t = t.expect("the ends are on different sides").clamp(clear, cell - clear);
            ray.origin + t * ray.direction
        })
        .collect()
}

/// The chord of a segment.
struct Chord {
    middle: DVec3,
    length: f64,
    along: DVec3,
    /// In the face, across the chord, from inside to outside.
    outward: DVec3,
}

impl Chord {
    fn new(segment: &Segment, complex: &Complex, on_edges: &[DVec3]) -> Self {
        let [a, b] = segment.crossings.map(|c| on_edges[c as usize]);
        let along = (b - a).normalize();
        let outward = DVec3::AXES[segment.normal].cross(along);
        let crossing = &complex.crossings[segment.crossings[0] as usize];
        let inner_end = crossing.ends[usize::from(!crossing.is_low_inside)];
        let sign = if outward.dot(inner_end - a) > 0.0 { -1.0 } else { 1.0 };
        Self { middle: a.midpoint(b), length: a.distance(b), along, outward: sign * outward }
    }
}

/// 2-D points: from the middle of the chord the surface is searched across it, then, at half the height found, along it on
/// both sides. The lines from the ends through what is found there meet in the point: in a sharp feature, if there is one.
pub(crate) fn in_faces(
    complex: &Complex,
    on_edges: &[DVec3],
    occupancy: &Occupancy<'_>,
    cell: f64,
) -> Vec<FacePoint> {
    let chords: Vec<Chord> = complex.segments.par_iter().map(|s| Chord::new(s, complex, on_edges)).collect();
    let middles: Vec<DVec3> = chords.iter().map(|c| c.middle).collect();
    let across: Vec<Ray> = occupancy
        .inside(&middles)
        .into_iter()
        .zip(&chords)
        .map(|(starts_inside, chord)| {
            let direction = if starts_inside { chord.outward } else { -chord.outward };
            Ray { origin: chord.middle, direction, starts_inside }
        })
        .collect();
    let heights = search(occupancy, &across, cell, ACROSS);
    let is_bent = |i: &usize| heights[*i].is_some_and(|h| h > STRAIGHT * cell);
    let bent: Vec<usize> = (0..chords.len()).filter(is_bent).collect();
    let along = |sign: f64| -> Vec<Ray> {
        let ray = |&i: &usize| {
            let height = heights[i].unwrap_or(0.0);
            let origin = across[i].origin + 0.5 * height * across[i].direction;
            Ray { origin, direction: sign * chords[i].along, ..across[i] }
        };
        bent.iter().map(ray).collect()
    };
    let [before, after] = [-1.0, 1.0].map(|sign| search(occupancy, &along(sign), cell, ALONG));
    let straight = |i: usize| {
        let (chord, height) = (&chords[i], heights[i].unwrap_or(0.0));
        let point = chord.middle + height * across[i].direction;
        let [a, b] = complex.segments[i].crossings.map(|c| on_edges[c as usize]);
        FacePoint { point, tangents: [point - a, point - b] }
    };
    let mut found: Vec<FacePoint> = (0..chords.len()).map(straight).collect();
    for (i, sides) in bent.into_iter().zip(before.into_iter().zip(after)) {
        if let (Some(before), Some(after)) = sides {
            let (chord, height) = (&chords[i], heights[i].unwrap_or(0.0));
            let half = 0.5 * height * across[i].direction;
            let tangents = [
                half + (0.5 * chord.length - before) * chord.along,
                half + (after - 0.5 * chord.length) * chord.along,
            ];
            // The lines from both ends meet at this multiple of half the height.
            let share = chord.length / (chord.length - before - after);
            let point = if share.is_finite() && share > 0.0 {
                on_edges[complex.segments[i].crossings[0] as usize] + share * tangents[0]
            } else {
                found[i].point
            };
            found[i] = FacePoint { point, tangents };
        }
    }
    for (i, (found, segment)) in found.iter_mut().zip(&complex.segments).enumerate() {
        let [first, second] = segment.crossings.map(|c| complex.crossings[c as usize].ends[0]);
        // The lower ends of two edges of a face have the lowest coordinates of the face between them.
        let low = first.min(second);
        let clear = within(found.point, low, cell, Some(segment.normal));
        found.point = kept(clear, chords[i].middle, &segment.region);
    }
    found
}

fn search(
    occupancy: &Occupancy<'_>,
    rays: &[Ray],
    cell: f64,
    (reach, steps, bisections): (f64, u32, u32),
) -> Vec<Option<f64>> {
    let brackets = occupancy.stepped(rays, reach * cell, steps);
    occupancy.bisected(rays, brackets, bisections)
}

/// A point moved into a cell, or into one of its faces, clear of the border.
fn within(p: DVec3, low: DVec3, cell: f64, normal: Option<usize>) -> DVec3 {
    let clear = CLEARANCE * cell;
    let mut inside = p.clamp(low + clear, low + (cell - clear));
    if let Some(axis) = normal {
        inside[axis] = low[axis];
    }
    inside
}

/// A point moved towards a mean one, which is well in the region, until it is so as well.
fn kept(p: DVec3, mean: DVec3, region: &[Bound]) -> DVec3 {
    let share = region.iter().fold(1.0_f64, |share, bound| {
        let (here, there) = (bound.clearance(p), bound.clearance(mean));
        let needed = KEPT * there;
        if here >= needed { share } else { share.min((there - needed) / (there - here)) }
    });
    if share < 1.0 { mean + share * (p - mean) } else { p }
}

/// 3-D points: the least squares of the planes through the 1-D points of a loop, whose normals are perpendicular to the
/// ways to the 2-D points on both sides.
pub(crate) fn in_cells(
    complex: &Complex,
    on_edges: &[DVec3],
    in_faces: &[FacePoint],
    cell: f64,
) -> Vec<DVec3> {
    complex.loops.par_iter().map(|l| in_cell(l, complex, on_edges, in_faces, cell)).collect()
}

fn in_cell(
    of_cell: &Loop,
    complex: &Complex,
    on_edges: &[DVec3],
    in_faces: &[FacePoint],
    cell: f64,
) -> DVec3 {
    let n = of_cell.crossings.len();
    let points = of_cell.crossings.iter().map(|&c| on_edges[c as usize]);
    let mean = points.clone().sum::<DVec3>() / n as f64;
    let mut matrix = DMat3::from_diagonal(DVec3::splat(PULL * PULL));
    let mut right = DVec3::ZERO;
    for (i, point) in points.enumerate() {
        let tangent = |side: usize| {
            let segment = of_cell.segments[side] as usize;
            let end = complex.segments[segment].crossings.iter().position(|&c| c == of_cell.crossings[i]);
            in_faces[segment].tangents[end.expect("the segment ends at the crossing")].normalize_or_zero()
        };
        let cross = tangent(i).cross(tangent((i + n - 1) % n));
        if cross.length_squared() > 1e-12 {
            let normal = cross.normalize();
            matrix += DMat3::from_cols(normal.x * normal, normal.y * normal, normal.z * normal);
            right += normal.dot(point - mean) * normal;
        }
    }
    let point = within(mean + matrix.inverse() * right, of_cell.low, cell, None);
    kept(point, mean, &of_cell.region)
}
