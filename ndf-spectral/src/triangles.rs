//! What the matrices are assembled from: corners and side lengths of triangles.

use ndf_intrinsic::IntrinsicMesh;

/// Triangles by their side lengths, glued at vertices. Any number of triangles may meet along an edge, and the
/// corners of a triangle may be the same vertex.
#[derive(Clone, Debug)]
pub struct MetricTriangles {
    vertex_count: usize,
    faces: Vec<[u32; 3]>,
    sides: Vec<[f64; 3]>,
}

impl MetricTriangles {
    /// Triangles with corners among `vertex_count` vertices and their side lengths; side `c` runs from corner `c` to
    /// the next.
    ///
    /// # Panics
    /// If the numbers of faces and sides differ or a corner is no vertex.
    pub fn new(vertex_count: usize, faces: Vec<[u32; 3]>, sides: Vec<[f64; 3]>) -> Self {
        assert_eq!(faces.len(), sides.len());
        assert!(faces.iter().flatten().all(|&v| (v as usize) < vertex_count));
        Self { vertex_count, faces, sides }
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Corners and side lengths of every triangle.
    pub fn iter(&self) -> impl Iterator<Item = ([u32; 3], [f64; 3])> + Clone + '_ {
        self.faces.iter().copied().zip(self.sides.iter().copied())
    }
}

impl From<&IntrinsicMesh> for MetricTriangles {
    /// The triangles of an intrinsic mesh. O(n).
    fn from(mesh: &IntrinsicMesh) -> Self {
        Self {
            vertex_count: mesh.vertex_count(),
            faces: mesh.faces().map(|f| mesh.face_vertices(f).map(u32::from)).collect(),
            sides: mesh.faces().map(|f| mesh.sides(f)).collect(),
        }
    }
}
