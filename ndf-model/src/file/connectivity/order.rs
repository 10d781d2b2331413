//! In which order a machine comes by the parts of a mesh.

use ndf_mesh::ManifoldMesh;

/// Where the parts of a stored base mesh are in the mesh that it was made from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BaseOrder {
    /// The half-edge of that mesh that became the first of every face: `3 f + c` for corner c of face f.
    pub faces: Vec<u32>,
    /// The vertex of that mesh that became every vertex.
    pub vertices: Vec<u32>,
}

impl BaseOrder {
    /// Everything where it was.
    pub fn identity(mesh: &ManifoldMesh) -> Self {
        let faces = (0..mesh.face_count() as u32).map(|f| 3 * f).collect();
        Self { faces, vertices: (0..mesh.vertex_count() as u32).collect() }
    }
}
