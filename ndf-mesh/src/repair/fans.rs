//! Separates fans of faces that meet in one vertex.

use crate::TriangleMesh;
use crate::validation::DisjointSets;

/// Gives every fan of faces at a vertex a vertex of its own, so that no vertex joins several fans.
pub fn split_fans(mesh: &TriangleMesh) -> TriangleMesh {
    let mut sides: Vec<(u32, u32, u32, u32)> = Vec::with_capacity(3 * mesh.face_count());
    for (f, face) in mesh.faces().iter().enumerate() {
        for c in 0..3 {
            let (h, next) = (3 * f as u32 + c as u32, 3 * f as u32 + (c as u32 + 1) % 3);
            let (p, q) = (face[c], face[(c + 1) % 3]);
            sides.push(if p < q { (p, q, h, next) } else { (q, p, next, h) });
        }
    }
    sides.sort_unstable();
    let mut fans = DisjointSets::new(3 * mesh.face_count());
    for pair in sides.windows(2) {
        if (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1) {
            fans.join(pair[0].2 as usize, pair[1].2 as usize);
            fans.join(pair[0].3 as usize, pair[1].3 as usize);
        }
    }
    let mut positions = mesh.positions().to_vec();
    let mut faces = mesh.faces().to_vec();
    // The first fan keeps the vertex; roots come before the other corners of their fan.
    let mut taken = vec![false; mesh.vertex_count()];
    let mut vertex_of_fan = vec![u32::MAX; 3 * mesh.face_count()];
    for corner in 0..3 * mesh.face_count() {
        let v = mesh.faces()[corner / 3][corner % 3];
        let root = fans.root(corner);
        if root == corner {
            vertex_of_fan[corner] = if taken[v as usize] {
                positions.push(mesh.positions()[v as usize]);
                positions.len() as u32 - 1
            } else {
                taken[v as usize] = true;
                v
            };
        }
        faces[corner / 3][corner % 3] = vertex_of_fan[root];
    }
    TriangleMesh::from_parts(positions, faces)
}
