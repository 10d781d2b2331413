//! A point on a triangle mesh, said by the smallest element that contains it.

use crate::ManifoldMesh;
use ndf_core::DVec3;

/// A point on a mesh: a vertex, a point inside an edge, or a point inside a face.
///
/// The naming follows geometry-central's `SurfacePoint` (Sharp et al. 2019). Indices refer to a
/// [`ManifoldMesh`]: edges by its edge numbering, faces by its face order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SurfacePoint {
    /// The vertex with this index.
    Vertex(u32),
    /// The point `(1 − t) a + t b` of the edge whose [canonical half-edge](ManifoldMesh::edge_halfedge) runs
    /// from `a` to `b`.
    Edge {
        /// Edge index.
        edge: u32,
        /// Parameter along the edge, in `[0, 1]`.
        t: f64,
    },
    /// The point `Σ bᵢ vᵢ` of a face.
    Face {
        /// Face index.
        face: u32,
        /// Barycentric coordinates; they sum to 1.
        barycentric: [f64; 3],
    },
}

impl SurfacePoint {
    /// The position of this point on `mesh`.
    ///
    /// # Panics
    /// If the element does not exist in `mesh`.
    pub fn position(&self, mesh: &ManifoldMesh) -> DVec3 {
        match *self {
            Self::Vertex(v) => mesh.positions()[v as usize],
            Self::Edge { edge, t } => {
                let [a, b] = mesh.edge_vertices(edge);
                mesh.positions()[a as usize].lerp(mesh.positions()[b as usize], t)
            }
            Self::Face { face, barycentric } => {
                let [a, b, c] = mesh.corner_positions(face);
                a * barycentric[0] + b * barycentric[1] + c * barycentric[2]
            }
        }
    }

    /// The same point as barycentric coordinates in a face that contains it.
    ///
    /// # Panics
    /// If the element does not exist in `mesh`.
    pub fn in_some_face(&self, mesh: &ManifoldMesh) -> (u32, [f64; 3]) {
        let at_corner = |halfedge: u32, along: f64| {
            let mut barycentric = [0.0; 3];
            barycentric[halfedge as usize % 3] = 1.0 - along;
            barycentric[(halfedge as usize + 1) % 3] = along;
            (halfedge / 3, barycentric)
        };
        match *self {
            Self::Vertex(v) => at_corner(mesh.vertex_halfedge(v), 0.0),
            Self::Edge { edge, t } => at_corner(mesh.edge_halfedge(edge), t),
            Self::Face { face, barycentric } => (face, barycentric),
        }
    }

    /// The point of `face` with these barycentric coordinates, said by the smallest element: coordinates
    /// within `tolerance` of 0 are taken as 0.
    ///
    /// # Panics
    /// If `face` does not exist in `mesh`.
    pub fn snapped(mesh: &ManifoldMesh, face: u32, barycentric: [f64; 3], tolerance: f64) -> Self {
        let clamped = barycentric.map(|b| if b <= tolerance { 0.0 } else { b });
        let sum: f64 = clamped.iter().sum();
        let b = clamped.map(|x| x / sum);
        match [b[0] > 0.0, b[1] > 0.0, b[2] > 0.0] {
            [true, false, false] => Self::Vertex(mesh.faces()[face as usize][0]),
            [false, true, false] => Self::Vertex(mesh.faces()[face as usize][1]),
            [false, false, true] => Self::Vertex(mesh.faces()[face as usize][2]),
            [true, true, false] => Self::on_halfedge(mesh, 3 * face, b[1]),
            [false, true, true] => Self::on_halfedge(mesh, 3 * face + 1, b[2]),
            [true, false, true] => Self::on_halfedge(mesh, 3 * face + 2, b[0]),
            _ => Self::Face { face, barycentric: b },
        }
    }

    fn on_halfedge(mesh: &ManifoldMesh, halfedge: u32, t: f64) -> Self {
        let edge = mesh.halfedge_edge(halfedge);
        let t = if mesh.edge_halfedge(edge) == halfedge { t } else { 1.0 - t };
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
        for face in 0..mesh.face_count() as u32 {
            for b in [[0.2, 0.3, 0.5], [0.0, 0.4, 0.6], [0.7, 0.0, 0.3], [0.1, 0.9, 0.0], [0.0, 0.0, 1.0]] {
                let [p, q, r] = mesh.corner_positions(face);
                let truth = p * b[0] + q * b[1] + r * b[2];
                let point = SurfacePoint::snapped(&mesh, face, b, 1e-12);
                assert_abs_diff_eq!((point.position(&mesh) - truth).length(), 0.0, epsilon = 1e-15);
                let (f, c) = point.in_some_face(&mesh);
                let again = SurfacePoint::Face { face: f, barycentric: c };
                assert_abs_diff_eq!((again.position(&mesh) - truth).length(), 0.0, epsilon = 1e-15);
            }
        }
    }
}
