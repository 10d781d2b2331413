//! What several tests share.

use std::collections::HashMap;

use ndf_mesh::TriangleMesh;

/// Every face split into four by its edges' midpoints: the same surface with many flat vertices.
pub(crate) fn subdivided(mesh: &TriangleMesh) -> TriangleMesh {
    let mut positions = mesh.positions().to_vec();
    let mut midpoints = HashMap::new();
    let mut midpoint = |a: u32, b: u32| {
        *midpoints.entry((a.min(b), a.max(b))).or_insert_with(|| {
            positions.push(positions[a as usize].midpoint(positions[b as usize]));
            positions.len() as u32 - 1
        })
    };
    let mut faces = Vec::new();
    for &[a, b, c] in mesh.faces() {
        let (ab, bc, ca) = (midpoint(a, b), midpoint(b, c), midpoint(c, a));
        faces.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    TriangleMesh::new(positions, faces).unwrap()
}
