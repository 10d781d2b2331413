//! Flips towards Delaunay in the metric of chords.

use ndf_core::{Cancelled, DVec3, Progress, Sparingly};
use rayon::prelude::*;

use super::{ChordMesh, Work};
use crate::delaunay::{EdgeQueue, Flip, is_surely_delaunay, quad_edges};
use crate::intrinsic_mesh::{DELAUNAY_TOLERANCE, IntrinsicMesh};
use ndf_mesh::Edge;

/// Chords change when edges are flipped: nothing proves an end, so there is one. Smooth surfaces take about one
/// flip for each edge of a fresh refinement.
const MOST_FLIPS_PER_EDGE: usize = 8;

/// The cotangent of the angle at `apex` between the directions to `a` and `b`.
#[inline]
fn cotangent(apex: DVec3, a: DVec3, b: DVec3) -> f64 {
    let (u, v) = (a - apex, b - apex);
    let sine = u.cross(v).length();
    if sine == 0.0 { f64::INFINITY.copysign(u.dot(v)) } else { u.dot(v) / sine }
}

/// Edges looked at between two questions whether to stop.
const ASKED: u32 = 4096;

/// Flips queued edges and those around them while that brings them closer to Delaunay as embedded and leaves the
/// complex simplicial. No flip makes an edge longer where the result is longer than `limit`. Returns the number of
/// flips.
pub(super) fn flip_towards_delaunay<T: Flip>(
    triangulation: &mut T,
    points: &[DVec3],
    limit: f64,
    queue: &mut EdgeQueue,
    progress: &dyn Progress,
) -> Result<usize, Cancelled> {
    let mut asked = Sparingly::new(progress, ASKED);
    let most = MOST_FLIPS_PER_EDGE * triangulation.mesh().edge_count();
    let mut flips = 0;
    while let Some(edge) = queue.pop() {
        asked.check()?;
        if flips == most {
            break;
        }
        if triangulation.is_settled(edge) {
            continue;
        }
        let mesh = triangulation.mesh();
        let Some(length) = improved_by_flip(mesh, points, limit, edge) else { continue };
        if triangulation.flip(edge, length) {
            flips += 1;
            quad_edges(triangulation.mesh(), edge).into_iter().for_each(|e| queue.push(e));
        }
    }
    Ok(flips)
}

/// The length of the other diagonal, if it is better than the edge.
#[inline]
fn improved_by_flip(mesh: &IntrinsicMesh, points: &[DVec3], limit: f64, edge: Edge) -> Option<f64> {
    let h = mesh.edge_halfedge(edge);
    let t = mesh.twin(h)?;
    let [i, j, k, l] = [h, t, h.previous(), t.previous()].map(|h| mesh.tail(h));
    let [pi, pj, pk, pl] = [i, j, k, l].map(|v| points[v.index()]);
    let now = cotangent(pk, pi, pj) + cotangent(pl, pj, pi);
    if now >= -DELAUNAY_TOLERANCE {
        return None;
    }
    let then = cotangent(pi, pl, pk) + cotangent(pj, pk, pl);
    // Written so that NaN, of faces without area, flips nothing.
    let better = then > now + DELAUNAY_TOLERANCE;
    let length = pk.distance(pl);
    let short = length <= limit || length <= pi.distance(pj);
    (better && short && k != l && !mesh.joins(k, l)).then_some(length)
}

/// [Flips](flip_towards_delaunay) all edges of a surface whose points have moved.
pub(super) fn flip_all(
    surface: &mut ChordMesh,
    work: &mut Work,
    progress: &dyn Progress,
) -> Result<(), Cancelled> {
    surface.measure();
    let ChordMesh { mesh, points, .. } = surface;
    // Most edges are left alone: those that are not are found over all threads.
    let improvable: Vec<Edge> = mesh
        .par_edges()
        .with_min_len(4096)
        .filter(|&e| {
            !is_surely_delaunay(mesh, e) && improved_by_flip(mesh, points, f64::INFINITY, e).is_some()
        })
        .collect();
    let mut queue = EdgeQueue::of(&improvable);
    work.chord_flips += flip_towards_delaunay(mesh, points, f64::INFINITY, &mut queue, progress)?;
    Ok(())
}
