//! Edge flips towards a Delaunay triangulation that stay close to the surface.

use ndf_core::projected;
use ndf_core::{DVec3, Query, Surface};

use crate::editable_mesh::EditableMesh;
use crate::triangle_shape::{agree, cross, quality};
use ndf_mesh::Halfedge;

/// Most passes over all edges; Delaunay flips end by themselves long before in practice.
const PASSES: usize = 8;
/// A face may turn by the angle with this cosine in a flip near a surface.
const TURN: f64 = 0.5;
/// The same where there is no surface to ask.
const FLAT: f64 = 0.999;

/// Flips edges of which the middle of the new edge is no further from the surface than that of the old one or
/// than `distance`. Returns the number of flips.
pub(super) fn flip_near(mesh: &mut EditableMesh, surface: &dyn Surface, distance: f64) -> usize {
    let mut flips = 0;
    for _ in 0..PASSES {
        let candidates: Vec<Halfedge> = edges(mesh).filter(|&h| is_improving(mesh, h, TURN)).collect();
        let middles: Vec<Query> = candidates.iter().flat_map(|&h| middles(mesh, h)).collect();
        let feet = projected(surface, &middles);
        let away = |i: usize| feet[i].map_or(f64::INFINITY, |foot| foot.point.distance(middles[i].point));
        let mut changed = vec![false; mesh.halfedge_count() / 3];
        let before = flips;
        for (i, &h) in candidates.iter().enumerate() {
            let faces = [h, mesh.raw_twin(h)].map(|h| h.face().index());
            let (old, new) = (away(2 * i), away(2 * i + 1));
            // Another flip may have joined the opposite corners meanwhile.
            let free = faces.iter().all(|&f| !changed[f]) && mesh.is_flippable(h);
            if free && new <= old.max(distance) {
                mesh.flip(h);
                faces.into_iter().for_each(|f| changed[f] = true);
                flips += 1;
            }
        }
        if flips == before {
            break;
        }
    }
    flips
}

/// Flips edges between nearly coplanar faces. Returns the number of flips.
pub(super) fn flip_flat(mesh: &mut EditableMesh) -> usize {
    let mut flips = 0;
    for _ in 0..PASSES {
        let before = flips;
        for h in mesh.halfedges() {
            if mesh.canonical(h) == h && is_improving(mesh, h, FLAT) {
                mesh.flip(h);
                flips += 1;
            }
        }
        if flips == before {
            break;
        }
    }
    flips
}

fn edges(mesh: &EditableMesh) -> impl Iterator<Item = Halfedge> + '_ {
    mesh.halfedges().filter(|&h| mesh.canonical(h) == h)
}

/// Ends of an edge, then its opposite corners, left and right.
fn diamond(mesh: &EditableMesh, h: Halfedge) -> [DVec3; 4] {
    let opposite = |h: Halfedge| mesh.tail(h.previous());
    [mesh.tail(h), mesh.tip(h), opposite(h), opposite(mesh.raw_twin(h))].map(|v| mesh.position(v))
}

/// Whether an edge is not Delaunay, and its flip possible without a fold or a worse face.
fn is_improving(mesh: &EditableMesh, h: Halfedge, turn: f64) -> bool {
    if !mesh.is_flippable(h) {
        return false;
    }
    let [a, b, c, d] = diamond(mesh, h);
    // The angles opposite the edge add up to more than π: the sum of their cotangents is negative.
    let cotangent = |apex: DVec3| (a - apex).dot(b - apex) / (a - apex).cross(b - apex).length();
    if cotangent(c) + cotangent(d) >= -1e-9 {
        return false;
    }
    let (old, new) = ([[a, b, c], [b, a, d]], [[a, d, c], [d, b, c]]);
    let worst = |faces: [[DVec3; 3]; 2]| quality(faces[0]).min(quality(faces[1]));
    let stays = old.iter().all(|&o| new.iter().all(|&n| agree(cross(o), cross(n), turn)));
    stays && worst(new) > worst(old)
}

/// Queries in the middle of an edge and of what it would be flipped to.
fn middles(mesh: &EditableMesh, h: Halfedge) -> [Query; 2] {
    let [a, b, c, d] = diamond(mesh, h);
    let normal = (cross([a, b, c]) + cross([b, a, d])).try_normalize();
    [a.midpoint(b), c.midpoint(d)].map(|point| Query { normal, ..Query::at(point) })
}
