//! The final pass over a base mesh: better-shaped triangles, no further from the surface.
//!
//! Every round flips edges towards Delaunay, moves vertices of badly shaped faces along
//! the surface, and fits the vertices to the surface by least squares. A round that takes the mesh
//! further from the surface than allowed is undone.

mod fitting;
mod flips;
mod relaxation;
#[cfg(test)]
mod tests;

use ndf_core::{DVec3, Progress, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::{FacePoint, Vertex};

use crate::editable_mesh::EditableMesh;
use crate::triangle_shape::{agree, cross, quality};

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedPoint {
    /// Where it is.
    pub point: DVec3,
    /// The unit outward normal there.
    pub normal: DVec3,
}

/// What a mesh should be close to.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// The surface, to project points of the mesh onto.
    pub surface: &'a dyn Surface,
    /// Points spread over the surface, so that no part of it is left behind; may be empty.
    pub points: &'a [OrientedPoint],
}

/// `count` points of a fine mesh, uniform by area, with the normals of their faces: points for a [`Target`].
/// Always the same; none if the mesh has no area.
pub fn spread_points(mesh: &ManifoldMesh, count: usize) -> Vec<OrientedPoint> {
    let samples = AreaSampler::new(mesh).map_or(Vec::new(), |sampler| sampler.sample(count, 0, 0));
    let point = |s: FacePoint| OrientedPoint { point: s.position(mesh), normal: mesh.face_normal(s.face) };
    samples.into_iter().map(point).filter(|p| p.normal != DVec3::ZERO).collect()
}

/// How much to do in the final pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinalPassOptions {
    /// Rounds of flips, relaxation and fitting; 0 leaves the mesh as it is.
    pub rounds: u32,
    /// Vertices move along the surface only while a face around them has a lower quality (4 √3 area / sum of
    /// squared sides, 1 for an equilateral triangle) than this.
    pub wanted_quality: f64,
    /// By what share of itself the root-mean-square distance between mesh and surface may grow in a round. A
    /// round that exceeds it is undone, and fewer vertices move in the next.
    pub allowed_growth: f64,
}

impl Default for FinalPassOptions {
    fn default() -> Self {
        Self { rounds: 4, wanted_quality: 0.6, allowed_growth: 0.0 }
    }
}

/// A mesh after the final pass.
#[derive(Clone, Debug)]
pub struct Improved {
    /// The mesh: as many vertices and faces as before, and the same topology.
    pub mesh: ManifoldMesh,
    /// Number of edges flipped.
    pub flips: usize,
    /// Root-mean-square distance before and after: of six points a face from the surface, and of the points of
    /// the target from the mesh, the mean of both squares. `None` without a target.
    pub distance: Option<[f64; 2]>,
}

/// Improves the shape of the faces of a mesh near a surface. Vertices of the boundary stay where they are.
///
/// Without a target only edges between nearly coplanar faces are flipped. Deterministic. Each round
/// projects about twenty points a face, and the points of the target three times.
pub fn improve(
    mesh: &ManifoldMesh,
    target: Option<&Target<'_>>,
    options: &FinalPassOptions,
    progress: &dyn Progress,
) -> Improved {
    let mut work = EditableMesh::new(mesh);
    let Some(target) = target else {
        let flips = if options.rounds > 0 { flips::flip_flat(&mut work) } else { 0 };
        return Improved { mesh: work.into_manifold(), flips, distance: None };
    };
    let before = fitting::Match::of(&work, target).distance;
    let (mut after, mut flipped, mut wanted) = (before, 0, options.wanted_quality);
    for round in 0..options.rounds {
        progress.report("final pass", f64::from(round) / f64::from(options.rounds));
        if progress.cancelled() {
            break;
        }
        let mut next = work.clone();
        let flips = flips::flip_near(&mut next, target.surface, after);
        relaxation::relax(&mut next, wanted);
        let distance = fitting::fit(&mut next, target);
        if distance <= after * (1.0 + options.allowed_growth) {
            (work, after, flipped) = (next, distance, flipped + flips);
        } else {
            // Undone; try again with fewer vertices moved.
            wanted *= 0.5;
        }
    }
    progress.report("final pass", 1.0);
    Improved { mesh: work.into_manifold(), flips: flipped, distance: Some([before, after]) }
}

/// A vertex may turn a face by the angle with this cosine in one move.
const TURN: f64 = 0.5;

/// The worst quality around a vertex moved to `position`; `None` if a face would turn too far.
pub(crate) fn quality_around(mesh: &EditableMesh, v: Vertex, position: DVec3) -> Option<f64> {
    let mut worst = f64::INFINITY;
    for o in mesh.outgoing(v) {
        let [x, y] = [mesh.tip(o), mesh.tail(o.previous())].map(|w| mesh.position(w));
        let (old, new) = (cross([mesh.position(v), x, y]), cross([position, x, y]));
        if old != DVec3::ZERO && old != new && !agree(old, new, TURN) {
            return None;
        }
        worst = worst.min(quality([position, x, y]));
    }
    Some(worst)
}
