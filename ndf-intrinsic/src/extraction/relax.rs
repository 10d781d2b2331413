//! Tangential relaxation: vertices slide over the base mesh towards the centres of their stars.

use ndf_core::sampling::FaceSample;
use ndf_core::{DVec3, DisplacementField, ManifoldMesh};
use rayon::prelude::*;

use super::refine::map;
use super::{ExtractionError, Surface, Work};

/// How far of the way to the centre of its star a vertex goes: all vertices move at once.
const STEP: f64 = 0.8;
/// A move that ends farther from its target than this fraction of the way is not made.
const ASTRAY: f64 = 0.7;
/// Base faces a vertex may pass in one move.
const MOST_FACES: usize = 64;

/// Moves every inner vertex towards the area-weighted centre of its faces (Botsch and Kobbelt 2004), within
/// the surface: the displacement's tangential part is walked over Ω′, where g is near the identity, and all new
/// places are mapped in one batch.
pub(super) fn relax(
    surface: &mut Surface,
    field: &DisplacementField,
    work: &mut Work,
) -> Result<(), ExtractionError> {
    let Surface { mesh, origins, points } = &*surface;
    let moves: Vec<(FaceSample, DVec3)> = (0..points.len() as u32)
        .into_par_iter()
        .with_min_len(1024)
        .map(|v| {
            let origin = origins[v as usize];
            let here = points[v as usize];
            if mesh.is_boundary_vertex(v) {
                return (origin, here);
            }
            let (mut normal, mut pull, mut area) = (DVec3::ZERO, DVec3::ZERO, 0.0);
            for h in mesh.outgoing(v) {
                let [a, b] = [mesh.next(h), mesh.previous(h)].map(|h| points[mesh.tail(h) as usize] - here);
                let cross = a.cross(b);
                let weight = cross.length();
                normal += cross;
                pull += weight * (a + b) / 3.0;
                area += weight;
            }
            let normal = normal.normalize_or_zero();
            if area <= 0.0 || !area.is_finite() || normal == DVec3::ZERO {
                return (origin, here);
            }
            let step = STEP / area * pull;
            let tangential = step - step.dot(normal) * normal;
            (walk(field.base(), origin, tangential), here + tangential)
        })
        .collect();
    let places: Vec<FaceSample> = moves.iter().map(|&(place, _)| place).collect();
    let mapped = map(field, &places, work)?;
    for (v, ((place, target), point)) in moves.into_iter().zip(mapped).enumerate() {
        // Where g is far from the identity the walk may lead astray: then the vertex stays.
        let here = surface.points[v];
        if point.distance(target) < ASTRAY * here.distance(target) {
            surface.points[v] = point;
            surface.origins[v] = place;
        }
    }
    Ok(())
}

/// Where one gets from a place by following the part of `step` that is tangential to the mesh, straight on
/// across edges, until it is used up or the boundary is met.
fn walk(base: &ManifoldMesh, from: FaceSample, step: DVec3) -> FaceSample {
    let FaceSample { mut face, barycentric: mut at } = from;
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
            return FaceSample { face, barycentric: clamped([0, 1, 2].map(|i| at[i] + d[i])) };
        };
        let mut hit = clamped([0, 1, 2].map(|i| at[i] + t * d[i]));
        hit[k] = 0.0;
        // The side opposite to corner k.
        let h = 3 * face + (k as u32 + 1) % 3;
        let Some(twin) = base.twin(h) else { return FaceSample { face, barycentric: clamped(hit) } };
        // Turn what is left of the step about the side.
        let corners = [a, b, c];
        let (p, q) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let along = (q - p).normalize_or_zero();
        let tangential = u * db + v * dc;
        let rest = (1.0 - t) * tangential;
        let straight = rest.dot(along);
        let inward = (rest - straight * along).length();
        let apex = base.positions()[base.tail(base.previous(twin)) as usize];
        let normal_in_next = (apex - p) - (apex - p).dot(along) * along;
        step = straight * along + inward * normal_in_next.normalize_or_zero();
        let mut next = [0.0; 3];
        next[twin as usize % 3] = hit[(k + 2) % 3];
        next[(twin as usize + 1) % 3] = hit[(k + 1) % 3];
        (face, at) = (twin / 3, clamped(next));
    }
    FaceSample { face, barycentric: at }
}

fn clamped(b: [f64; 3]) -> [f64; 3] {
    crate::planar::normalised(b.map(|x| x.max(0.0)))
}
