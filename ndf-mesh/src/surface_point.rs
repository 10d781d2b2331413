//! A point on a triangle mesh, said by the smallest element that contains it.

use std::fmt;

use crate::{Edge, FacePoint, Halfedge, ManifoldMesh, Vertex};
use ndf_core::DVec3;

/// A point on a mesh: a vertex, a point inside an edge, or a point inside a face.
///
/// The naming follows geometry-central's `SurfacePoint` (Sharp et al. 2019). Indices refer to a
/// [`ManifoldMesh`]: edges by its edge numbering, faces by its face order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SurfacePoint {
    /// The vertex with this index.
    Vertex(Vertex),
    /// The point `(1 − t) a + t b` of the edge whose [canonical half-edge](crate::Topology::edge_halfedge) runs
    /// from `a` to `b`.
    Edge {
        /// Edge index.
        edge: Edge,
        /// Parameter along the edge, in `[0, 1]`.
        t: f64,
    },
    /// A point of a face.
    Face(FacePoint),
}

impl fmt::Display for SurfacePoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Vertex(vertex) => write!(f, "vertex {}", vertex.0),
            Self::Edge { edge, t } => write!(f, "the point {t} of edge {}", edge.0),
            Self::Face(FacePoint { face, barycentric }) => {
                write!(f, "the point {barycentric:?} of face {}", face.0)
            }
        }
    }
}

impl SurfacePoint {
    /// The position of this point on `mesh`.
    ///
    /// # Panics
    /// If the element does not exist in `mesh`.
    pub fn position(&self, mesh: &ManifoldMesh) -> DVec3 {
        match *self {
            Self::Vertex(v) => mesh.positions()[v.index()],
            Self::Edge { edge, t } => {
                let [a, b] = mesh.topology().edge_vertices(edge);
                mesh.positions()[a.index()].lerp(mesh.positions()[b.index()], t)
            }
            Self::Face(point) => point.position(mesh),
        }
    }

    /// The same point in a face that contains it.
    ///
    /// # Panics
    /// If the element does not exist in `mesh`.
    pub fn in_some_face(&self, mesh: &ManifoldMesh) -> FacePoint {
        match *self {
            Self::Vertex(v) => FacePoint::at_corner(mesh.topology().vertex_halfedge(v)),
            Self::Edge { edge, t } => FacePoint::on_halfedge(mesh.topology().edge_halfedge(edge), t),
            Self::Face(point) => point,
        }
    }

    /// A point of a face, said by the smallest element: barycentric coordinates within `tolerance` of 0 are taken
    /// as 0.
    ///
    /// # Panics
    /// If the face does not exist in `mesh`.
    pub fn snapped(mesh: &ManifoldMesh, point: FacePoint, tolerance: f64) -> Self {
        let face = point.face;
        let [ab, bc, ca] = face.halfedges();
        let clamped = point.barycentric.map(|b| if b <= tolerance { 0.0 } else { b });
        let sum: f64 = clamped.iter().sum();
        let b = clamped.map(|x| x / sum);
        match [b[0] > 0.0, b[1] > 0.0, b[2] > 0.0] {
            [true, false, false] => Self::Vertex(mesh.topology().tail(ab)),
            [false, true, false] => Self::Vertex(mesh.topology().tail(bc)),
            [false, false, true] => Self::Vertex(mesh.topology().tail(ca)),
            [true, true, false] => Self::on_halfedge(mesh, ab, b[1]),
            [false, true, true] => Self::on_halfedge(mesh, bc, b[2]),
            [true, false, true] => Self::on_halfedge(mesh, ca, b[0]),
            _ => Self::Face(FacePoint { face, barycentric: b }),
        }
    }

    fn on_halfedge(mesh: &ManifoldMesh, halfedge: Halfedge, t: f64) -> Self {
        let edge = mesh.topology().halfedge_edge(halfedge);
        let t = if mesh.topology().edge_halfedge(edge) == halfedge { t } else { 1.0 - t };
        Self::Edge { edge, t }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use approx::assert_abs_diff_eq;

    #[test]
    fn every_form_of_a_point_has_the_same_position() {
        let mesh = ManifoldMesh::try_from(shapes::icosphere(1)).unwrap();
        for face in mesh.topology().faces() {
            for b in [[0.2, 0.3, 0.5], [0.0, 0.4, 0.6], [0.7, 0.0, 0.3], [0.1, 0.9, 0.0], [0.0, 0.0, 1.0]] {
                let [p, q, r] = mesh.corner_positions(face);
                let truth = p * b[0] + q * b[1] + r * b[2];
                let point = SurfacePoint::snapped(&mesh, FacePoint { face, barycentric: b }, 1e-12);
                assert_abs_diff_eq!((point.position(&mesh) - truth).length(), 0.0, epsilon = 1e-15);
                let again = point.in_some_face(&mesh);
                assert_abs_diff_eq!((again.position(&mesh) - truth).length(), 0.0, epsilon = 1e-15);
            }
        }
    }
}
