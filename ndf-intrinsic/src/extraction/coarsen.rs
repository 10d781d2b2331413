//! Collapses of short edges, under the link condition.

use ndf_core::{Cancelled, DVec3, Progress, Sparingly};
use rayon::prelude::*;

use super::chords::flip_towards_delaunay;
use super::{ChordMesh, LONG, Work};
use crate::delaunay::EdgeQueue;
use ndf_mesh::halfedge::keep;
use ndf_mesh::{Edge, Halfedge};

/// Edges shorter than this many h are collapsed. Splits make edges of 2/3 h and, where sides of a face differ, somewhat
/// shorter ones; those just above half of h are left to relaxation.
const SHORT: f64 = 0.55;
/// A collapse may turn a face's normal by up to 60°.
const LEAST_COSINE: f64 = 0.5;
/// A pass that collapses no more than one in so many vertices is the last.
const FEW: usize = 500;
/// Passes over all edges; each can halve the number of vertices.
const MOST_PASSES: usize = 40;

/// Collapses edges shorter than 0.55 h where topology and geometry allow, pass by pass.
pub(super) fn collapse_short(
    surface: &mut ChordMesh,
    h: f64,
    work: &mut Work,
    progress: &dyn Progress,
) -> Result<(), Cancelled> {
    let mut active = vec![true; surface.points.len()];
    let before = work.collapses;
    for _ in 0..MOST_PASSES {
        progress.check()?;
        let collapses = pass(surface, h, &mut active, work, progress)?;
        work.collapses += collapses;
        if collapses * FEW <= surface.points.len() {
            break;
        }
    }
    if work.collapses > before {
        close_holes(surface);
    }
    Ok(())
}

/// One pass over the short edges that have an end near where the last one changed something: others would be
/// refused again. `active` says which vertices are, before and after.
fn pass(
    surface: &mut ChordMesh,
    h: f64,
    active: &mut Vec<bool>,
    work: &mut Work,
    progress: &dyn Progress,
) -> Result<usize, Cancelled> {
    // A vertex takes part once a pass, so that collapses do not pile up in one place.
    let mut touched = vec![false; surface.points.len()];
    let mut kept_vertices = Vec::new();
    // Edges that have gone are infinitely long. Few of the short ones may be collapsed.
    let mesh = &surface.mesh;
    let short: Vec<Edge> = mesh
        .par_edges()
        .with_min_len(4096)
        .filter(|&e| {
            let is_active = || mesh.edge_vertices(e).into_iter().any(|v| active[v.index()]);
            mesh.length(e) < SHORT * h && is_active() && collapsible(surface, e, h).is_some()
        })
        .collect();
    let mut asked = Sparingly::new(progress, 1024);
    for edge in short {
        asked.check()?;
        if surface.mesh.length(edge) == f64::INFINITY
            || surface.mesh.edge_vertices(edge).into_iter().any(|v| touched[v.index()])
        {
            continue;
        }
        // The stars around may have changed since it was asked over all threads.
        let Some(half) = collapsible(surface, edge, h) else { continue };
        let ChordMesh { mesh, points, .. } = surface;
        let kept = mesh.tail(half);
        for e in mesh.topology.collapse(half).into_iter().flatten() {
            mesh.lengths[e.index()] = f64::INFINITY;
        }
        touched[kept.index()] = true;
        kept_vertices.push(kept);
        for out in mesh.topology.outgoing(kept) {
            let (tip, e) = (mesh.topology.tip(out), mesh.topology.halfedge_edge(out));
            mesh.lengths[e.index()] = points[kept.index()].distance(points[tip.index()]);
            touched[tip.index()] = true;
        }
    }
    let mut queue = EdgeQueue::default();
    let mesh = &surface.mesh;
    for h in kept_vertices.iter().flat_map(|&v| mesh.outgoing(v)) {
        queue.push(mesh.halfedge_edge(h));
        queue.push(mesh.halfedge_edge(h.next()));
    }
    let ChordMesh { mesh, points, .. } = surface;
    work.chord_flips += flip_towards_delaunay(mesh, points, f64::INFINITY, &mut queue, progress)?;
    *active = touched;
    Ok(kept_vertices.len())
}

fn close_holes(surface: &mut ChordMesh) {
    let ChordMesh { mesh, origins, points } = surface;
    let survivors = mesh.topology.compact();
    keep(&mut mesh.lengths, &survivors.edges);
    keep(points, &survivors.vertices);
    keep(origins, &survivors.vertices);
}

/// The half-edge of an edge, i → j, that may be collapsed into i.
fn collapsible(surface: &ChordMesh, edge: Edge, h: f64) -> Option<Halfedge> {
    let half = surface.mesh.edge_halfedge(edge);
    let twin = surface.mesh.twin(half)?;
    [half, twin].into_iter().find(|&half| may_collapse(surface, half, h))
}

/// Whether the edge of `half`, i → j, may be collapsed into i.
fn may_collapse(surface: &ChordMesh, half: Halfedge, h: f64) -> bool {
    let (mesh, points) = (&surface.mesh, &surface.points);
    let (i, j) = (mesh.tail(half), mesh.tip(half));
    let (source, target) = (points[j.index()], points[i.index()]);
    // Only the link condition looks further than the star of j.
    !mesh.is_boundary_vertex(j)
        && mesh.outgoing(j).all(|out| points[mesh.tip(out).index()].distance(target) <= LONG * h)
        && mesh.outgoing(j).all(|out| {
            let [a, b] = [mesh.tip(out), mesh.tail(out.previous())];
            let (pa, pb) = (points[a.index()], points[b.index()]);
            let normal = |p: DVec3| (pa - p).cross(pb - p).normalize_or_zero();
            a == i || b == i || normal(source).dot(normal(target)) >= LEAST_COSINE
        })
        && mesh.is_collapsible(half)
}
