//! Tangent planes at the vertices of an intrinsic mesh, and parallel transport between them.

use std::f64::consts::{PI, TAU};

use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Face, Halfedge, Vertex};
use num_complex::Complex64;

use crate::faces::{Layout, direction_in_face};

/// Faces without area are widened by this fraction of the mean edge length: cotangents must be finite.
const MOLLIFICATION: f64 = 1e-8;

/// A surface with a tangent plane at every vertex, in which vectors are complex numbers.
///
/// The plane of a vertex inside is its fan of triangles with all angles scaled by one factor so that they sum to 2π (Polthier
/// and Schmies 1998; Knöppel, Crane, Pinkall and Schröder 2013, §5.1). Fans of boundary vertices are taken as they are: they need
/// not close up, and flat surfaces are then flat to their corners. The real axis points along the
/// [first half-edge](ndf_mesh::Topology::vertex_halfedge) of the vertex in the mesh that was given, whatever flips followed.
///
/// The mesh is the intrinsic Delaunay triangulation of the given one, with the same vertices, so that all cotangent weights are
/// non-negative; the directions of its edges are kept through the flips (signposts: Sharp, Soliman and Crane 2019).
#[derive(Clone, Debug)]
pub struct TangentBundle {
    mesh: IntrinsicMesh,
    /// The direction of every half-edge in the plane of its tail, in radians.
    directions: Vec<f64>,
    /// Radians in the plane of a vertex for a radian of its fan.
    scales: Vec<f64>,
    /// Where the fan of a boundary vertex ends, in radians.
    ends: Vec<f64>,
}

impl TangentBundle {
    /// The tangent planes of a mesh and its Delaunay triangulation. About O(n).
    pub fn new(mesh: &IntrinsicMesh) -> Self {
        let mut mesh = mesh.clone();
        mesh.mollify(MOLLIFICATION);
        let mut bundle = Self::as_given(mesh);
        let Self { mesh, directions, scales, .. } = &mut bundle;
        mesh.flip_to_delaunay_watched(|mesh, edge| {
            // Where a flip puts half-edges: the new ones in the slots of those that went before, which go before the new ones.
            let first = mesh.edge_halfedge(edge);
            let second = mesh.raw_twin(first);
            directions[second.previous().index()] = directions[first.index()];
            directions[first.previous().index()] = directions[second.index()];
            for halfedge in [first, second] {
                // The half-edge clockwise beside it, whose direction is known.
                let before = mesh.raw_twin(halfedge).next();
                let turn = scales[mesh.tail(halfedge).index()] * mesh.corner_angle(before);
                directions[halfedge.index()] = directions[before.index()] + turn;
            }
        });
        bundle
    }

    /// The tangent planes of a mesh, which is not flipped. O(n).
    pub fn as_given(mesh: IntrinsicMesh) -> Self {
        let sums = mesh.angle_sums();
        let is_inside = |v: &Vertex| !mesh.is_boundary_vertex(*v);
        let scale = |v: Vertex| if is_inside(&v) { TAU / sums[v.index()] } else { 1.0 };
        let scales: Vec<f64> = mesh.vertices().map(scale).collect();
        let mut directions = vec![0.0; mesh.halfedge_count()];
        for v in mesh.vertices() {
            let mut direction = 0.0;
            for h in mesh.outgoing(v) {
                directions[h.index()] = direction;
                direction += scales[v.index()] * mesh.corner_angle(h);
            }
        }
        Self { mesh, directions, scales, ends: sums }
    }

    /// The triangulation.
    pub fn mesh(&self) -> &IntrinsicMesh {
        &self.mesh
    }

    /// The direction of a half-edge in the plane of its tail, in radians.
    pub fn direction(&self, halfedge: Halfedge) -> f64 {
        self.directions[halfedge.index()]
    }

    /// The direction of a half-edge in the plane of its tip: onwards, away from its tail.
    pub fn onward_direction(&self, halfedge: Halfedge) -> f64 {
        let back = match self.mesh.twin(halfedge) {
            Some(twin) => self.direction(twin),
            // A half-edge on the boundary is the last of the fan at its tip.
            None => self.ends[self.mesh.tip(halfedge).index()],
        };
        back + PI
    }

    /// Parallel transport along a half-edge: the rotation that takes vectors at its tail to vectors at its tip.
    pub fn transport(&self, halfedge: Halfedge) -> Complex64 {
        Complex64::cis(self.onward_direction(halfedge) - self.direction(halfedge))
    }

    /// The gradient of a piecewise linear function in the planes of the vertices: the mean of the gradients of the faces around, weighted by
    /// their areas at the vertex. Faces where the function is not finite do not count. O(n).
    ///
    /// # Panics
    /// If there is not one value for every vertex.
    pub fn gradient(&self, values: &[f64]) -> Vec<Complex64> {
        let mesh = &self.mesh;
        assert_eq!(values.len(), mesh.vertex_count());
        let mut sums = vec![Complex64::default(); values.len()];
        let mut areas = vec![0.0; values.len()];
        for face in mesh.faces() {
            let layout = Layout::of(mesh, face);
            let slope = layout.gradient(mesh.face_vertices(face).map(|v| values[v.index()]));
            if !slope.is_finite() {
                continue;
            }
            for h in face.halfedges() {
                let v = mesh.tail(h).index();
                let turned = slope * Complex64::cis(-direction_in_face(mesh, h));
                // The inverse of the way into the face.
                sums[v] += layout.area() * turned / self.in_face(h, Complex64::ONE);
                areas[v] += layout.area();
            }
        }
        let mean =
            |(sum, area): (&Complex64, &f64)| if *area > 0.0 { sum / area } else { Complex64::default() };
        sums.iter().zip(&areas).map(mean).collect()
    }

    /// By how much parallel transport counter-clockwise around a face turns vectors, in radians: the curvature of the face. Those of a
    /// closed surface sum to 2πχ.
    pub fn curvature(&self, face: Face) -> f64 {
        let scaled = |h: Halfedge| self.scales[self.mesh.tail(h).index()] * self.mesh.corner_angle(h);
        face.halfedges().map(scaled).iter().sum::<f64>() - PI
    }

    /// By how much the boundary turns to the left at a vertex of it, in radians. With the curvatures of the faces these sum to 2πχ.
    ///
    /// # Panics
    /// If the vertex is not on the boundary.
    pub fn boundary_turn(&self, vertex: Vertex) -> f64 {
        assert!(self.mesh.is_boundary_vertex(vertex), "vertex {vertex} is inside");
        PI - self.ends[vertex.index()]
    }

    /// A vector at the tail of a half-edge in the frame of its face whose x axis is the half-edge. The middle of the corner stays in the
    /// middle.
    pub(crate) fn in_face(&self, halfedge: Halfedge, vector: Complex64) -> Complex64 {
        let corner = self.mesh.corner_angle(halfedge);
        let scaled = self.scales[self.mesh.tail(halfedge).index()] * corner;
        vector * Complex64::cis(0.5 * (corner - scaled) - self.direction(halfedge))
    }

    /// The direction in a vertex's plane of an angle to the left of an outgoing half-edge in its face.
    pub(crate) fn direction_in_corner(&self, halfedge: Halfedge, angle: f64) -> f64 {
        self.direction(halfedge) + self.scales[self.mesh.tail(halfedge).index()] * angle
    }
}

#[cfg(test)]
mod tests {
    use ndf_mesh::{ManifoldMesh, TriangleMesh, shapes};

    use super::*;

    fn bundle_of(mesh: TriangleMesh) -> TangentBundle {
        TangentBundle::new(&IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh).unwrap()))
    }

    #[test]
    fn curvatures_and_turns_sum_to_the_euler_characteristic() {
        for (mesh, euler) in
            [(shapes::icosphere(2), 2.0), (shapes::torus(20, 10, 1.0, 0.4), 0.0), (shapes::grid(5, 3), 1.0)]
        {
            let bundle = bundle_of(mesh);
            let mesh = bundle.mesh();
            let curvature: f64 = mesh.faces().map(|f| bundle.curvature(f)).sum();
            let boundary = mesh.vertices().filter(|v| mesh.is_boundary_vertex(*v));
            let turns: f64 = boundary.map(|v| bundle.boundary_turn(v)).sum();
            approx::assert_abs_diff_eq!(curvature + turns, TAU * euler, epsilon = 1e-9);
        }
    }

    #[test]
    fn transport_around_a_face_turns_by_its_curvature_after_flips_too() {
        let stretched = shapes::icosphere(2).map_positions(|p| p * ndf_core::DVec3::new(4.0, 1.0, 1.0));
        for mesh in [stretched, shapes::grid(6, 5).map_positions(|p| p * ndf_core::DVec3::new(9.0, 1.0, 1.0))]
        {
            let bundle = bundle_of(mesh);
            for face in bundle.mesh().faces() {
                let around: Complex64 = face.halfedges().map(|h| bundle.transport(h)).iter().product();
                let difference = around * Complex64::cis(-bundle.curvature(face));
                approx::assert_abs_diff_eq!(difference.arg(), 0.0, epsilon = 1e-9);
            }
        }
    }
}
