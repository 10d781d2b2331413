//! Tangential relaxation: vertices move to where the faces around them are better shaped.

use ndf_core::DVec3;

use super::quality_around;
use crate::editable_mesh::EditableMesh;
use crate::quadric::Quadric;
use crate::triangle_shape::{agree, cross};
use ndf_mesh::Vertex;

/// Sweeps over all vertices.
const SWEEPS: usize = 2;
/// How easily a vertex leaves the planes of its faces: small, so that it stays on creases and corners.
const SOFTNESS: f64 = 0.05;
/// Cosine of the widest angle between a face and the mean normal around a vertex that may move.
const OPEN: f64 = 0.6;

/// Moves every interior vertex with a face of a quality below `wanted` towards the mean of the places where
/// each of its faces would be equilateral, as far as the worst of them improves (smart smoothing; Freitag 1997).
/// The planes of the faces resist, so that the step is tangential, and along a crease where there is one.
pub(super) fn relax(mesh: &mut EditableMesh, wanted: f64) {
    for _ in 0..SWEEPS {
        for v in mesh.vertices() {
            if !mesh.is_boundary_vertex(v) {
                relax_vertex(mesh, v, wanted);
            }
        }
    }
}

fn relax_vertex(mesh: &mut EditableMesh, v: Vertex, wanted: f64) {
    let position = mesh.position(v);
    let Some(worst) = quality_around(mesh, v, position).filter(|&q| q < wanted) else { return };
    if !is_open(mesh, v) {
        return;
    }
    let (mut sum, mut count, mut planes) = (DVec3::ZERO, 0.0, Quadric::default());
    for o in mesh.outgoing(v) {
        let [x, y] = [mesh.tip(o), mesh.tail(o.previous())].map(|w| mesh.position(w));
        let cross = cross([position, x, y]);
        let normal = cross.normalize_or_zero();
        sum += x.midpoint(y) + 0.5 * 3.0_f64.sqrt() * normal.cross(y - x);
        count += 1.0;
        planes += Quadric::plane(position, normal, cross.length());
    }
    let Some(goal) = planes.minimiser(sum / count, SOFTNESS, 1) else { return };
    let steps = [1.0, 0.5, 0.25].map(|share| position.lerp(goal, share));
    let better = |&p: &DVec3| quality_around(mesh, v, p).is_some_and(|q| q > worst * 1.001);
    if let Some(place) = steps.into_iter().find(better) {
        mesh.positions[v.index()] = place;
    }
}

/// Whether the faces around a vertex all see the same side. A vertex at the tip of something thin must stay: the
/// planes along the thin part would not resist its sliding down.
fn is_open(mesh: &EditableMesh, v: Vertex) -> bool {
    let crosses = || mesh.outgoing(v).map(|o| cross(mesh.corners(o).map(|w| mesh.position(w))));
    let mean: DVec3 = crosses().sum();
    crosses().all(|c| agree(c, mean, OPEN))
}
