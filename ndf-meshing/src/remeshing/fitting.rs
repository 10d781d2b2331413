//! Least-squares fit of a coarse mesh to a surface.
//!
//! A mesh whose vertices lie on the surface is not the closest one: its faces cut the curved parts off. Here
//! the vertices go where the squared distances of the faces' sample points from the tangent planes at their
//! feet add up to the least (point to plane; Chen and Medioni 1992). Points of the surface take part with
//! their feet on the mesh: without them nothing would hold the mesh at the tips of thin parts.

use ndf_core::projected;
use ndf_core::{DVec3, Hint, Query, Surface};
use ndf_mesh::{Face, FacePoint, TriangleTree, Vertex};
use rayon::prelude::*;

use super::{OrientedPoint, Target, quality_around};
use crate::editable_mesh::EditableMesh;
use crate::quadric::Quadric;
use crate::triangle_shape::cross;

/// Barycentric coordinates and weights of six sample points, exact to degree 4 (Dunavant 1985).
const RULE: [([f64; 3], f64); 6] = {
    const A: f64 = 0.445_948_490_915_965;
    const B: f64 = 0.091_576_213_509_771;
    const WA: f64 = 0.223_381_589_678_011;
    const WB: f64 = 0.109_951_743_655_322;
    [
        ([1.0 - 2.0 * A, A, A], WA),
        ([A, 1.0 - 2.0 * A, A], WA),
        ([A, A, 1.0 - 2.0 * A], WA),
        ([1.0 - 2.0 * B, B, B], WB),
        ([B, 1.0 - 2.0 * B, B], WB),
        ([B, B, 1.0 - 2.0 * B], WB),
    ]
};
/// Sweeps over all vertices with the same feet.
const SWEEPS: usize = 6;
/// Hold of a vertex on its place, against the planes at the feet.
const SOFTNESS: f64 = 0.01;
/// A fit makes no face worse than this, unless it was.
const LEAST_QUALITY: f64 = 0.3;
/// Matches of both meshes, each followed by sweeps.
const FITS: usize = 2;
/// Points with a smaller share in a vertex do not move it.
const LEAST_SHARE: f64 = 1e-3;
/// Feet on a part of the surface that faces elsewhere are of no use.
const LEAST_COSINE: f64 = 0.3;

/// A point of a face and the plane it should be on.
#[derive(Clone, Copy)]
struct Pull {
    at: FacePoint,
    weight: f64,
    /// Point and normal of the surface.
    foot: DVec3,
    normal: DVec3,
}

/// Sample points of a mesh with their feet on the surface, and points of the surface with theirs on the mesh.
pub(super) struct Match {
    /// By face.
    pulls: Vec<Pull>,
    /// Where the pulls of each face begin.
    starts: Vec<usize>,
    /// Root-mean-square distance of all pairs.
    pub(super) distance: f64,
}

impl Match {
    pub(super) fn of(mesh: &EditableMesh, target: &Target<'_>) -> Self {
        let (mut pulls, onto) = feet_of_samples(mesh, target.surface);
        let (back, from) = feet_of_points(mesh, target.points);
        pulls.extend(back);
        // Stable: those of a face keep their order.
        pulls.sort_by_key(|pull| pull.at.face);
        let starts = (0..=mesh.faces().len())
            .map(|f| pulls.partition_point(|pull| pull.at.face.index() < f))
            .collect();
        let squares = [Some(onto), from].into_iter().flatten();
        let mean = squares.clone().sum::<f64>() / squares.count() as f64;
        Self { pulls, starts, distance: mean.sqrt() }
    }

    fn of_face(&self, face: Face) -> &[Pull] {
        &self.pulls[self.starts[face.index()]..self.starts[face.index() + 1]]
    }
}

/// Six points of every face pulled to their feet on the surface, and their mean squared distance.
fn feet_of_samples(mesh: &EditableMesh, surface: &dyn Surface) -> (Vec<Pull>, f64) {
    let faces = mesh.faces();
    let mut queries = Vec::with_capacity(6 * faces.len());
    let mut samples = Vec::with_capacity(6 * faces.len());
    for face in faces {
        let corners = corners_of(mesh, face);
        let cross = cross(corners);
        for (barycentric, weight) in RULE {
            let at = FacePoint { face, barycentric };
            queries.push(Query { normal: cross.try_normalize(), ..Query::at(at.interpolate(corners)) });
            samples.push((at, weight * 0.5 * cross.length()));
        }
    }
    let (mut sum, mut total, mut pulls) = (0.0, 0.0, Vec::new());
    for ((query, found), (at, weight)) in queries.iter().zip(projected(surface, &queries)).zip(samples) {
        let Ok(found) = found else { continue };
        sum += weight * found.point.distance_squared(query.point);
        total += weight;
        if query.normal.is_some_and(|n| n.dot(found.normal) > LEAST_COSINE) {
            pulls.push(Pull { at, weight, foot: found.point, normal: found.normal });
        }
    }
    (pulls, if total > 0.0 { sum / total } else { 0.0 })
}

/// The points of the mesh closest to points of the surface, pulled to them, and the mean squared distance, if
/// there are points.
fn feet_of_points(mesh: &EditableMesh, points: &[OrientedPoint]) -> (Vec<Pull>, Option<f64>) {
    if points.is_empty() {
        return (Vec::new(), None);
    }
    let coarse = mesh.to_triangle_mesh();
    let tree = TriangleTree::new(&coarse);
    let normals: Vec<DVec3> = coarse.face_indices().map(|f| coarse.face_normal(f)).collect();
    let weight = coarse.area() / points.len() as f64;
    let closest: Vec<Option<(Pull, f64)>> = points
        .par_iter()
        .map(|&OrientedPoint { point: foot, normal }| {
            let alike = |f: Face| normals[f.index()].dot(normal) > LEAST_COSINE;
            let found = tree.closest_point_where(foot, Hint::NONE, alike)?;
            Some((Pull { at: found.at, weight, foot, normal }, found.distance_squared))
        })
        .collect();
    let sum: f64 = closest.iter().flatten().map(|(_, square)| square).sum();
    let pulls: Vec<Pull> = closest.into_iter().flatten().map(|(pull, _)| pull).collect();
    let mean = sum / pulls.len().max(1) as f64;
    (pulls, Some(mean))
}

fn corners_of(mesh: &EditableMesh, face: Face) -> [DVec3; 3] {
    mesh.corners(face.halfedge(0)).map(|v| mesh.position(v))
}

/// Fits the interior vertices and returns the root-mean-square distance then. A fit that does not bring the
/// mesh closer is undone.
pub(super) fn fit(mesh: &mut EditableMesh, target: &Target<'_>) -> f64 {
    let mut pairs = Match::of(mesh, target);
    for _ in 0..FITS {
        let before = mesh.positions.clone();
        for _ in 0..SWEEPS {
            for v in mesh.vertices() {
                if !mesh.is_boundary_vertex(v) {
                    fit_vertex(mesh, v, &pairs);
                }
            }
        }
        let after = Match::of(mesh, target);
        if after.distance >= pairs.distance {
            mesh.positions = before;
            break;
        }
        pairs = after;
    }
    pairs.distance
}

/// Puts a vertex where the points around it are closest to their planes, the other vertices fixed.
fn fit_vertex(mesh: &mut EditableMesh, v: Vertex, pairs: &Match) {
    let position = mesh.position(v);
    let (mut planes, mut reach, mut count) = (Quadric::default(), 0.0, 0.0);
    for o in mesh.outgoing(v) {
        let corners = corners_of(mesh, o.face());
        for pull in pairs.of_face(o.face()) {
            let share = pull.at.barycentric[o.corner()];
            if share > LEAST_SHARE {
                // The point is on the plane when the vertex is on one further out. Relative to the vertex.
                let gap = pull.normal.dot(pull.foot - pull.at.interpolate(corners));
                let weight = pull.weight * share * share;
                planes += Quadric::plane(pull.normal * (gap / share), pull.normal, weight);
            }
        }
        reach += position.distance(mesh.position(mesh.tip(o)));
        count += 1.0;
    }
    let Some(step) = planes.minimiser(DVec3::ZERO, SOFTNESS, 1) else { return };
    let goal = position + step.clamp_length_max(0.25 * reach / count);
    let (Some(before), Some(after)) = (quality_around(mesh, v, position), quality_around(mesh, v, goal))
    else {
        return;
    };
    if after >= before.min(LEAST_QUALITY) {
        mesh.positions[v.index()] = goal;
    }
}
