//! Collapses of short edges, under the link condition.

use ndf_core::DVec3;

use super::chords::flip_towards_delaunay;
use super::{Surface, Work};
use crate::delaunay::EdgeQueue;

/// Edges shorter than this many h are collapsed.
const SHORT: f64 = 0.7;
/// No collapse makes an edge longer than this many h.
const LONG: f64 = 4.0 / 3.0;
/// A collapse may turn a face's normal by up to 60°.
const LEAST_COSINE: f64 = 0.5;
/// A pass that collapses no more than one in so many vertices is the last.
const FEW: usize = 500;
/// Passes over all edges; each can halve the number of vertices.
const MOST_PASSES: usize = 40;

/// Collapses edges shorter than 0.7 h where topology and geometry allow, pass by pass.
pub(super) fn collapse_short(surface: &mut Surface, h: f64, work: &mut Work) {
    for _ in 0..MOST_PASSES {
        let collapses = pass(surface, h, work);
        work.collapses += collapses;
        if collapses * FEW <= surface.points.len() {
            break;
        }
    }
}

fn pass(surface: &mut Surface, h: f64, work: &mut Work) -> usize {
    // A vertex takes part once a pass, so that collapses do not pile up in one place.
    let mut touched = vec![false; surface.points.len()];
    let mut collapses = 0;
    let mut kept_vertices = Vec::new();
    // Downwards: where an edge is removed the last takes its number, and that has been looked at.
    let mut edge = surface.mesh.edge_count() as u32;
    while edge > 0 {
        edge -= 1;
        if edge as usize >= surface.mesh.edge_count() || surface.mesh.length(edge) >= SHORT * h {
            continue;
        }
        let half = surface.mesh.edge_halfedge(edge);
        let Some(twin) = surface.mesh.twin(half) else { continue };
        let ends = surface.mesh.edge_vertices(edge);
        if ends.iter().any(|&v| touched[v as usize]) {
            continue;
        }
        let Some(half) = [half, twin].into_iter().find(|&half| may_collapse(surface, half, h)) else {
            continue;
        };
        let (kept, gone) = (surface.mesh.tail(half), surface.mesh.tip(half));
        for e in surface.mesh.complex.collapse(half) {
            surface.mesh.lengths.swap_remove(e as usize);
        }
        surface.points.swap_remove(gone as usize);
        surface.origins.swap_remove(gone as usize);
        touched.swap_remove(gone as usize);
        // The last vertex may be the one kept.
        let kept = if kept as usize == surface.points.len() { gone } else { kept };
        touched[kept as usize] = true;
        kept_vertices.push(kept);
        let around: Vec<u32> = surface.mesh.outgoing(kept).collect();
        for out in around {
            let (tip, e) = (surface.mesh.tip(out), surface.mesh.halfedge_edge(out));
            surface.mesh.lengths[e as usize] =
                surface.points[kept as usize].distance(surface.points[tip as usize]);
            touched[tip as usize] = true;
        }
        collapses += 1;
    }
    // Vertices may have been renumbered since: then others are looked at, to no harm.
    let mut queue = EdgeQueue::default();
    let mesh = &surface.mesh;
    for v in kept_vertices.into_iter().filter(|&v| (v as usize) < mesh.vertex_count()) {
        for h in mesh.outgoing(v) {
            queue.push(mesh.halfedge_edge(h));
            queue.push(mesh.halfedge_edge(mesh.next(h)));
        }
    }
    work.chord_flips += flip_towards_delaunay(&mut surface.mesh, &surface.points, f64::INFINITY, &mut queue);
    collapses
}

/// Whether the edge of `half`, i → j, may be collapsed into i.
fn may_collapse(surface: &Surface, half: u32, h: f64) -> bool {
    let (mesh, points) = (&surface.mesh, &surface.points);
    if !mesh.can_collapse(half) {
        return false;
    }
    let (i, j) = (mesh.tail(half), mesh.tip(half));
    let target = points[i as usize];
    mesh.outgoing(j).all(|out| {
        let [_, a, b] = [out, mesh.next(out), mesh.previous(out)].map(|h| mesh.tail(h));
        if a == i || b == i {
            return true;
        }
        let (pa, pb) = (points[a as usize], points[b as usize]);
        let normal = |p: DVec3| (pa - p).cross(pb - p).normalize_or_zero();
        let turned = normal(points[j as usize]).dot(normal(target));
        pa.distance(target) <= LONG * h && turned >= LEAST_COSINE
    })
}
