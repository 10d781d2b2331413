//! The tufted cover (Sharp and Crane 2020, "A Laplacian for nonmanifold triangle meshes", §3.3): any set of
//! triangles, doubled to two sides each and glued to a closed surface on which Delaunay flips are possible.

use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::TriangleMesh;
use ndf_mesh::{Edge, Face, Halfedge, NO_HALFEDGE, Topology};

use crate::error::SpectralError;

/// A closed surface that covers a triangle mesh twice.
#[derive(Clone, Debug)]
pub struct TuftedCover {
    /// The surface. A vertex of the mesh has one vertex here for each fan of sides around it.
    pub mesh: IntrinsicMesh,
    /// The vertex of the mesh that each vertex of the surface lies over.
    pub original: Vec<u32>,
}

impl TuftedCover {
    /// The cover of a triangle mesh, manifold or not, oriented or not. Around an edge, the front of every face is
    /// glued to the back of the next, in the order of their numbers: the order does not matter to the Laplacian's
    /// properties. Faces that name a vertex twice are left out. O(n log n).
    ///
    /// # Errors
    /// If a length is not finite: of edges of vertices that are not, or farther apart than floats reach.
    pub fn new(mesh: &TriangleMesh) -> Result<Self, SpectralError> {
        let faces: Vec<[u32; 3]> =
            mesh.faces().iter().copied().filter(|[a, b, c]| a != b && b != c && c != a).collect();
        // Side f < F is the front of face f, side F + f its back, with corners 0 and 1 swapped.
        let backs = faces.iter().map(|&[a, b, c]| [b, a, c]);
        let sides: Vec<[u32; 3]> = faces.iter().copied().chain(backs).collect();
        let twins = glue(&faces);
        let mut corners = vec![u32::MAX; 3 * sides.len()];
        let mut original = Vec::new();
        for start in (0..corners.len()).map(Halfedge::new) {
            let mut h = start;
            while corners[h.index()] == u32::MAX {
                corners[h.index()] = original.len() as u32;
                // Clockwise: the half-edge after the twin leaves the same vertex.
                h = twins[h.index()].next();
            }
            if h == start && corners[h.index()] == original.len() as u32 {
                original.push(sides[start.face().index()][start.corner()]);
            }
        }
        let complex = Topology::from_gluing(original.len(), &corners, &twins)
            .expect("every side of a face has one twin, and vertices are the orbits around them");
        let length = |e: Edge| {
            let [a, b] = complex.edge_vertices(e).map(|v| original[v.index()] as usize);
            let length = mesh.positions()[a].distance(mesh.positions()[b]);
            if length.is_finite() { Ok(length) } else { Err(SpectralError::NotFinite(a)) }
        };
        let lengths = complex.edges().map(length).collect::<Result<_, _>>()?;
        let mesh = IntrinsicMesh::new(&complex, lengths, f64::INFINITY)
            .expect("every edge has a length, which is finite");
        Ok(Self { mesh, original })
    }
}

/// Twins of the half-edges of fronts and backs.
fn glue(faces: &[[u32; 3]]) -> Vec<Halfedge> {
    let count = faces.len();
    // The half-edge of the back along a half-edge of the front: the back's corners are 1, 0, 2 of the front's.
    let back = |h: Halfedge| Face::new(count + h.face().index()).halfedge([0, 2, 1][h.corner()]);
    let mut by_edge: Vec<(u32, u32, Halfedge)> = (0..3 * count)
        .map(Halfedge::new)
        .map(|h| {
            let face = faces[h.face().index()];
            let (a, b) = (face[h.corner()], face[h.next().corner()]);
            (a.min(b), a.max(b), h)
        })
        .collect();
    by_edge.sort_unstable();
    let mut twins = vec![NO_HALFEDGE; 6 * count];
    for around in by_edge.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        for (i, &(low, _, h)) in around.iter().enumerate() {
            // Of the two half-edges of a face, one runs from the lower vertex to the higher and one against it.
            let half = |h: Halfedge, upward: bool| {
                let front_upward = faces[h.face().index()][h.corner()] == low;
                if front_upward == upward { h } else { back(h) }
            };
            let following = around[(i + 1) % around.len()].2;
            let (a, b) = (half(h, true), half(following, false));
            twins[a.index()] = b;
            twins[b.index()] = a;
        }
    }
    twins
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use glam::DVec3;
    use ndf_mesh::shapes;

    #[test]
    fn covers_are_closed_surfaces_of_twice_the_area() {
        // Three pages of a book, two cones that share their tip, and an open grid.
        let book = TriangleMesh::new(
            vec![DVec3::ZERO, DVec3::Z, DVec3::X, DVec3::Y, -DVec3::X],
            vec![[0, 1, 2], [0, 1, 3], [1, 0, 4]],
        );
        let bow = TriangleMesh::new(
            vec![DVec3::ZERO, DVec3::X, DVec3::Y, -DVec3::X, -DVec3::Y],
            vec![[0, 1, 2], [0, 3, 4]],
        );
        for mesh in [book.unwrap(), bow.unwrap(), shapes::grid(4, 3), shapes::icosphere(1)] {
            let cover = TuftedCover::new(&mesh).unwrap();
            cover.mesh.check().unwrap();
            assert_eq!(cover.mesh.boundary_edge_count(), 0);
            assert_relative_eq!(cover.mesh.total_area(), 2.0 * mesh.area(), max_relative = 1e-12);
            let mut met: Vec<u32> = cover.original.clone();
            met.sort_unstable();
            met.dedup();
            assert_eq!(met.len(), mesh.vertex_count());
        }
    }

    #[test]
    fn lengths_beyond_all_floats_are_refused() {
        let fin = vec![DVec3::ZERO, 1e200 * DVec3::X, DVec3::Y, DVec3::Z, -DVec3::Y];
        let fin = TriangleMesh::new(fin, vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]]).unwrap();
        assert!(matches!(TuftedCover::new(&fin), Err(SpectralError::NotFinite(_))));
    }
}
