//! Least-squares fit of a coarse mesh to a surface.
//!
//! A mesh whose vertices lie on the surface is not the closest one: its faces cut the curved parts off. Here
//! the vertices go where the squared distances of the faces' sample points from the tangent planes at their
//! feet add up to the least (point to plane; Chen and Medioni 1992).

use ndf_core::projection::projected;
use ndf_core::{DVec3, Foot, Query, Surface};

use super::quality_around;
use crate::halfedge_mesh::HalfedgeMesh;
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
/// Feet on a part of the surface that faces elsewhere are of no use.
const LEAST_COSINE: f64 = 0.3;

/// Feet of the sample points of all faces.
pub(super) struct Feet {
    /// Foot and area weight of every sample, six a face.
    feet: Vec<(Option<Foot>, f64)>,
    distance: f64,
}

impl Feet {
    pub(super) fn of(mesh: &HalfedgeMesh, surface: &dyn Surface) -> Self {
        let faces = 0..mesh.halfedge_count() as u32 / 3;
        let mut queries = Vec::with_capacity(6 * faces.len());
        let mut weights = Vec::with_capacity(6 * faces.len());
        for face in faces {
            let corners = mesh.corners(3 * face).map(|v| mesh.position(v));
            let cross = cross(corners);
            for (barycentric, weight) in RULE {
                queries.push(Query { normal: cross.try_normalize(), ..Query::at(at(corners, barycentric)) });
                weights.push(weight * 0.5 * cross.length());
            }
        }
        let found = projected(surface, &queries);
        let (mut sum, mut total) = (0.0, 0.0);
        let mut feet = Vec::with_capacity(found.len());
        for ((query, foot), weight) in queries.iter().zip(found).zip(weights) {
            if let Ok(foot) = foot {
                sum += weight * foot.point.distance_squared(query.point);
                total += weight;
            }
            let faces_alike = |f: &Foot| query.normal.is_some_and(|n| n.dot(f.normal) > LEAST_COSINE);
            feet.push((foot.ok().filter(faces_alike), weight));
        }
        let distance = if total > 0.0 { (sum / total).sqrt() } else { 0.0 };
        Self { feet, distance }
    }

    /// Root-mean-square distance of the samples from their feet.
    pub(super) fn distance(&self) -> f64 {
        self.distance
    }
}

fn at(corners: [DVec3; 3], barycentric: [f64; 3]) -> DVec3 {
    corners[0] * barycentric[0] + corners[1] * barycentric[1] + corners[2] * barycentric[2]
}

/// Fits the interior vertices and returns the root-mean-square distance then. Where the fit does not bring
/// the mesh closer, it is undone.
pub(super) fn fit(mesh: &mut HalfedgeMesh, surface: &dyn Surface) -> f64 {
    let mut feet = Feet::of(mesh, surface);
    for _ in 0..2 {
        let before = mesh.positions.clone();
        for _ in 0..SWEEPS {
            for v in 0..mesh.vertex_count() as u32 {
                if !mesh.is_boundary_vertex(v) {
                    fit_vertex(mesh, v, &feet);
                }
            }
        }
        let after = Feet::of(mesh, surface);
        if after.distance >= feet.distance {
            mesh.positions = before;
            break;
        }
        feet = after;
    }
    feet.distance
}

/// Puts a vertex where the samples around it are closest to the planes at their feet, the other vertices fixed.
fn fit_vertex(mesh: &mut HalfedgeMesh, v: u32, feet: &Feet) {
    let position = mesh.position(v);
    let (mut planes, mut reach, mut count) = (Quadric::default(), 0.0, 0.0);
    for o in mesh.fan(v) {
        let face = o / 3;
        let corners = mesh.corners(3 * face).map(|w| mesh.position(w));
        for (k, (barycentric, _)) in RULE.into_iter().enumerate() {
            let (Some(foot), weight) = feet.feet[6 * face as usize + k] else { continue };
            let share = barycentric[o as usize % 3];
            let gap = foot.normal.dot(foot.point - at(corners, barycentric));
            // The sample is on the plane when the vertex is on one further out. Relative to the vertex.
            planes += Quadric::plane(foot.normal * (gap / share), foot.normal, weight * share * share);
        }
        reach += position.distance(mesh.position(mesh.tip(o)));
        count += 1.0;
    }
    let Some(step) = planes.minimiser(DVec3::ZERO, SOFTNESS) else { return };
    let goal = position + step.clamp_length_max(0.25 * reach / count);
    let (Some(before), Some(after)) = (quality_around(mesh, v, position), quality_around(mesh, v, goal))
    else {
        return;
    };
    if after >= before.min(LEAST_QUALITY) {
        mesh.positions[v as usize] = goal;
    }
}
