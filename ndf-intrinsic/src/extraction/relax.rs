//! Tangential relaxation: vertices slide over the base mesh towards the centres of their stars.

use ndf_core::{DVec3, Progress};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::{FacePoint, Vertex};
use ndf_model::DisplacementField;
use rayon::prelude::*;

use super::{ChordMesh, ExtractionError, Work, map};
use crate::intrinsic_mesh::IntrinsicMesh;

/// How far of the way to the centre of its star a vertex goes: all vertices move at once.
const STEP: f64 = 0.8;
/// Vertices a thread takes at a time.
const CHUNK: usize = 4096;
/// Shorter moves, as a fraction of h, are not worth an evaluation.
const STILL: f64 = 0.05;
/// A move that ends farther from its target than this fraction of the way is not made.
const ASTRAY: f64 = 0.7;
/// Base faces a vertex may pass in one move.
const MOST_FACES: usize = 64;

/// Moves inner vertices towards the area-weighted centre of their faces (Botsch and Kobbelt 2004), all at once and
/// within the surface: the displacement's tangential part is walked over Ω′, where g is near the identity.
/// Vertices that are there, but for a fraction of `h`, stay.
pub(super) fn relax(
    surface: &mut ChordMesh,
    field: &DisplacementField,
    h: f64,
    work: &mut Work,
    progress: &dyn Progress,
) -> Result<(), ExtractionError> {
    let ChordMesh { mesh, origins, points } = surface;
    let mut moved = points.clone();
    let evaluations: Vec<Result<usize, ExtractionError>> = moved
        .par_chunks_mut(CHUNK)
        .zip(origins.par_chunks_mut(CHUNK))
        .enumerate()
        .map(|(chunk, (moved, origins))| {
            progress.check()?;
            let first = chunk * CHUNK;
            let moves: Vec<(usize, FacePoint, DVec3)> = (0..moved.len())
                .filter_map(|k| {
                    let step = step_to_centre(mesh, points, Vertex::new(first + k))?;
                    let far = step.length_squared() > (STILL * h) * (STILL * h);
                    far.then(|| (k, walk(field.base(), origins[k], step), points[first + k] + step))
                })
                .collect();
            let places: Vec<FacePoint> = moves.iter().map(|&(_, place, _)| place).collect();
            for ((k, place, target), point) in moves.into_iter().zip(map(field, &places, progress)?) {
                // Where g is far from the identity the walk may go wrong: then the vertex stays.
                if point.distance(target) < ASTRAY * points[first + k].distance(target) {
                    (moved[k], origins[k]) = (point, place);
                }
            }
            Ok(places.len())
        })
        .collect();
    *points = moved;
    for evaluations in evaluations {
        work.evaluations += evaluations?;
    }
    Ok(())
}

/// The tangential step of an inner vertex.
fn step_to_centre(mesh: &IntrinsicMesh, points: &[DVec3], v: Vertex) -> Option<DVec3> {
    if mesh.is_boundary_vertex(v) {
        return None;
    }
    let here = points[v.index()];
    let (mut normal, mut pull, mut area) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    let start = mesh.vertex_halfedge(v);
    let mut a = points[mesh.tip(start).index()] - here;
    let mut h = start;
    loop {
        let last = h.previous();
        let b = points[mesh.tail(last).index()] - here;
        let cross = a.cross(b);
        let weight = cross.length();
        normal += cross;
        pull += weight * (a + b);
        area += weight;
        (a, h) = (b, mesh.raw_twin(last));
        if h == start {
            break;
        }
    }
    let normal = normal.normalize_or_zero();
    if area <= 0.0 || !area.is_finite() || normal == DVec3::ZERO {
        return None;
    }
    let step = STEP / (3.0 * area) * pull;
    Some(step - step.dot(normal) * normal)
}

/// Where one gets from a place by following the part of `step` that is tangential to the mesh, straight on
/// across edges, until it is used up or the boundary is met.
fn walk(base: &ManifoldMesh, from: FacePoint, step: DVec3) -> FacePoint {
    let FacePoint { mut face, barycentric: mut at } = from;
    let mut step = step;
    for _ in 0..MOST_FACES {
        let [a, b, c] = base.corner_positions(face);
        let (u, v) = (b - a, c - a);
        let cross = u.cross(v);
        let squared = cross.length_squared();
        if squared == 0.0 {
            break;
        }
        // Barycentric components of the tangential part of the step.
        let db = cross.dot(step.cross(v)) / squared;
        let dc = cross.dot(u.cross(step)) / squared;
        let d = [-db - dc, db, dc];
        let mut exit = (1.0, None);
        for k in 0..3 {
            if d[k] < 0.0 {
                let t = at[k] / -d[k];
                if t < exit.0 {
                    exit = (t.max(0.0), Some(k));
                }
            }
        }
        let (t, Some(k)) = exit else {
            return FacePoint { face, barycentric: clamped([0, 1, 2].map(|i| at[i] + d[i])) };
        };
        let mut hit = clamped([0, 1, 2].map(|i| at[i] + t * d[i]));
        hit[k] = 0.0;
        // The side opposite to corner k.
        let h = face.halfedge((k + 1) % 3);
        let Some(twin) = base.topology().twin(h) else {
            return FacePoint { face, barycentric: clamped(hit) };
        };
        // Turn what is left of the step about the side.
        let corners = [a, b, c];
        let (p, q) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let along = (q - p).normalize_or_zero();
        let tangential = u * db + v * dc;
        let rest = (1.0 - t) * tangential;
        let straight = rest.dot(along);
        let inward = (rest - straight * along).length();
        let apex = base.positions()[base.topology().tail(twin.previous()).index()];
        let normal_in_next = (apex - p) - (apex - p).dot(along) * along;
        step = straight * along + inward * normal_in_next.normalize_or_zero();
        let mut next = [0.0; 3];
        next[twin.corner()] = hit[(k + 2) % 3];
        next[twin.next().corner()] = hit[(k + 1) % 3];
        (face, at) = (twin.face(), clamped(next));
    }
    FacePoint { face, barycentric: at }
}

fn clamped(b: [f64; 3]) -> [f64; 3] {
    crate::planar::normalised(b.map(|x| x.max(0.0)))
}
