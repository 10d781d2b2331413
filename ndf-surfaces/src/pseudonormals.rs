//! Normals of a mesh at faces, edges and vertices that tell its sides apart.
//!
//! The angle-weighted pseudonormal of the element a closest point lies on always points to the side of the query
//! (Bærentzen and Aanæs 2005, "Signed distance computation using the angle weighted pseudonormal"): the face
//! normal inside a face, the sum of both face normals on an edge, the sum of the face normals weighted by their
//! angles at a vertex.

use ndf_core::DVec3;
use ndf_mesh::repair;
use ndf_mesh::{Face, FacePoint, Halfedge, Sides, TriangleMesh};

/// Barycentric coordinates up to this count as 0, so that rounding does not choose between an edge and the
/// faces beside it.
const ON_EDGE: f64 = 1e-9;

/// Pseudonormals of all faces, edges and vertices of a mesh.
#[derive(Clone, Debug)]
pub struct Pseudonormals {
    /// The mesh, vertices at equal positions being one. Normals of faces are found when asked for.
    welded: TriangleMesh,
    vertices: Vec<DVec3>,
    /// Of every face, the edges from corner 0 to 1, 1 to 2, and 2 to 0.
    sides: Vec<[u32; 3]>,
    /// The two faces of every edge, by which its normal is found when asked for; or else [`OTHER`] and the place of its normal.
    edges: Vec<[u32; 2]>,
    /// Normals of the edges that do not have two faces.
    others: Vec<DVec3>,
    closed: bool,
}

/// In place of a face of an edge that does not have two.
const OTHER: u32 = u32::MAX;

impl Pseudonormals {
    /// Of a mesh with any connectivity; vertices at the same position count as one. O(n log degree).
    pub fn new(mesh: &TriangleMesh) -> Self {
        let welded = repair::welded(mesh, 0.0);
        let corners = welded.faces();
        let mut vertices = vec![DVec3::ZERO; welded.vertex_count()];
        for (face, corners) in welded.face_indices().zip(corners) {
            let normal = normal(&welded, face);
            for k in 0..3 {
                let [p, q, r] = [0, 1, 2].map(|i| welded.positions()[corners[(k + i) % 3] as usize]);
                let angle = (q - p).cross(r - p).length().atan2((q - p).dot(r - p));
                if angle.is_finite() {
                    vertices[corners[k] as usize] += angle * normal;
                }
            }
        }
        let by_edge = Sides::of(welded.vertex_count(), mesh.face_indices().zip(corners.iter().copied()));
        let mut sides = vec![[0; 3]; corners.len()];
        let (mut edges, mut others) = (Vec::with_capacity(3 * corners.len() / 2), Vec::new());
        let mut closed = !corners.is_empty();
        for (a, edge) in by_edge.edges() {
            let mut balance = 0;
            for &(b, halfedge) in edge {
                let (f, k) = (halfedge.face().index(), halfedge.corner());
                sides[f][k] = edges.len() as u32;
                if a != b {
                    balance += if corners[f][k] == a { 1 } else { -1 };
                }
            }
            closed &= balance == 0;
            let face = |side: &(u32, Halfedge)| side.1.face();
            edges.push(match edge {
                [one, other] => [face(one).0, face(other).0],
                _ => {
                    others.push(mean(edge.iter().map(|side| normal(&welded, side.1.face()))));
                    [OTHER, others.len() as u32 - 1]
                }
            });
        }
        vertices.iter_mut().for_each(|normal| *normal = normal.normalize_or_zero());
        Self { welded, vertices, sides, edges, others, closed }
    }

    fn of_edge(&self, edge: u32) -> DVec3 {
        match self.edges[edge as usize] {
            [OTHER, place] => self.others[place as usize],
            pair => mean(pair.into_iter().map(|f| self.of_face(Face(f)))),
        }
    }

    /// Whether every edge is run through as often in one direction as in the other, so that the mesh separates
    /// an inside from an outside.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// The edges of every face by number, from corner 0 to 1, 1 to 2, and 2 to 0. Edges between the same places are one.
    pub(crate) fn sides(&self) -> &[[u32; 3]] {
        &self.sides
    }

    /// Whether every edge has exactly two faces. O(n).
    pub(crate) fn is_sewn(&self) -> bool {
        let mut counts = vec![0_u8; self.edges.len()];
        for &edge in self.sides.as_flattened() {
            counts[edge as usize] = counts[edge as usize].saturating_add(1);
        }
        counts.iter().all(|&count| count == 2)
    }

    /// Unit normal of a face; zero if it has no area.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn of_face(&self, face: Face) -> DVec3 {
        normal(&self.welded, face)
    }

    /// Unit pseudonormal of the smallest element on which a point of a face lies. Where the normals of an
    /// element cancel, as on a sheet glued to its own back, that of the face; zero if that has no area either.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn at(&self, point: &FacePoint) -> DVec3 {
        let f = point.face.index();
        let corner = |k: usize| self.vertices[self.welded.faces()[f][k] as usize];
        let side = |k: usize| self.of_edge(self.sides[f][k]);
        let normal = match point.barycentric.map(|b| b > ON_EDGE) {
            [true, false, false] => corner(0),
            [false, true, false] => corner(1),
            [false, false, true] => corner(2),
            [true, true, false] => side(0),
            [false, true, true] => side(1),
            [true, false, true] => side(2),
            _ => self.of_face(point.face),
        };
        if normal == DVec3::ZERO { self.of_face(point.face) } else { normal }
    }
}

/// The normal of a face; zero if it has a corner that is not finite, or no area.
fn normal(mesh: &TriangleMesh, face: Face) -> DVec3 {
    Some(mesh.face_normal(face)).filter(|n| n.is_finite()).unwrap_or(DVec3::ZERO)
}

/// The direction of the sum of some normals; zero where they cancel.
fn mean(normals: impl Iterator<Item = DVec3>) -> DVec3 {
    normals.fold(DVec3::ZERO, |sum, n| sum + n).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::shapes;

    #[test]
    fn a_cube_has_the_normals_of_its_symmetry() {
        let cube = shapes::cube(1);
        let normals = Pseudonormals::new(&cube);
        assert!(normals.is_closed());
        for f in cube.face_indices() {
            let corners = cube.corner_positions(f);
            for k in 0..3 {
                // Weights by angle do not depend on how the sides are cut into triangles.
                let normal = normals.at(&FacePoint::at_corner(f.halfedge(k)));
                assert!(normal.distance(corners[k].normalize()) < 1e-14);
            }
            assert!(
                normals
                    .at(&FacePoint { face: f, barycentric: [0.2, 0.3, 0.5] })
                    .distance(cube.face_normal(f))
                    < 1e-14
            );
        }
    }

    #[test]
    fn soups_are_welded_and_holes_seen() {
        let sphere = shapes::icosphere(1);
        let corners: Vec<DVec3> = sphere.face_indices().flat_map(|f| sphere.corner_positions(f)).collect();
        let faces = (0..sphere.face_count() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        let soup = Pseudonormals::new(&TriangleMesh::new(corners, faces).unwrap());
        assert!(soup.is_closed());
        let whole = Pseudonormals::new(&sphere);
        for f in sphere.face_indices() {
            for barycentric in [[1.0, 0.0, 0.0], [0.0, 0.5, 0.5], [0.4, 0.3, 0.3]] {
                let point = FacePoint { face: f, barycentric };
                assert!(soup.at(&point).distance(whole.at(&point)) < 1e-14);
            }
        }
        assert!(!Pseudonormals::new(&shapes::grid(2, 2)).is_closed());
    }
}
