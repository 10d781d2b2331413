//! Tangent planes of an embedded mesh in space.

use ndf_core::DVec3;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::ManifoldMesh;
use num_complex::Complex64;

use crate::bundle::TangentBundle;

/// The tangent plane of every vertex in space: two orthonormal vectors for the real and the imaginary axis of a
/// [`TangentBundle`], perpendicular to the vertex normal.
#[derive(Clone, Debug, PartialEq)]
pub struct Frames {
    axes: Vec<[DVec3; 2]>,
}

impl Frames {
    /// The frames that fit the edges around every vertex best, on average. O(n).
    pub fn of(mesh: &ManifoldMesh) -> Self {
        let bundle = TangentBundle::as_given(IntrinsicMesh::from_mesh(mesh));
        let (positions, normals) = (mesh.positions(), mesh.vertex_normals());
        let topology = mesh.topology();
        let frame = |v: ndf_mesh::Vertex| {
            let normal = normals[v.index()];
            let mut axis = DVec3::ZERO;
            for h in topology.edges_at(v) {
                let (other, direction) = if topology.tail(h) == v {
                    (topology.tip(h), bundle.direction(h))
                } else {
                    (topology.tail(h), bundle.onward_direction(h) + std::f64::consts::PI)
                };
                let edge =
                    (positions[other.index()] - positions[v.index()]).reject_from(normal).normalize_or_zero();
                // The edge turned back by its direction.
                let (sin, cos) = direction.sin_cos();
                axis += edge * cos - normal.cross(edge) * sin;
            }
            let axis = axis.reject_from(normal).try_normalize().unwrap_or(normal.any_orthonormal_vector());
            [axis, normal.cross(axis)]
        };
        Self { axes: topology.vertices().map(frame).collect() }
    }

    /// The axes of every vertex.
    pub fn axes(&self) -> &[[DVec3; 2]] {
        &self.axes
    }

    /// Tangent vectors in space.
    ///
    /// # Panics
    /// If there is not one for every vertex.
    pub fn embed(&self, vectors: &[Complex64]) -> Vec<DVec3> {
        assert_eq!(vectors.len(), self.axes.len());
        self.axes.iter().zip(vectors).map(|([x, y], z)| *x * z.re + *y * z.im).collect()
    }

    /// Vectors in space projected into the tangent planes.
    ///
    /// # Panics
    /// If there is not one for every vertex.
    pub fn project(&self, vectors: &[DVec3]) -> Vec<Complex64> {
        assert_eq!(vectors.len(), self.axes.len());
        self.axes.iter().zip(vectors).map(|([x, y], v)| Complex64::new(v.dot(*x), v.dot(*y))).collect()
    }
}
