//! The orientable double cover of a surface that need not be orientable.

use super::{Origins, RepairOptions, Work};
use crate::validation::DisjointSets;
use crate::{ManifoldMesh, NotManifold, TriangleMesh};

/// The two sides of a surface as one surface: every face twice, once turned, joined with the faces of the same side. It can
/// be oriented also where the surface cannot be (Möbius strips, Klein bottles). Distances on the surface are distances on its cover from both
/// places that lie over a source: a path on the surface is one on the cover.
///
/// # Errors
/// With the report of what is left, if the repaired mesh has edges of three faces.
pub fn double_cover(
    mesh: &TriangleMesh,
    options: &RepairOptions,
) -> Result<(ManifoldMesh, Origins), NotManifold> {
    let Work { mesh: single, kept, places } = Work::new(mesh, options, &mut Vec::new());
    let n = single.face_count();
    // Corners of the second side follow those of the first. Corners that are one vertex are joined across edges.
    let mut joined = DisjointSets::new(6 * n);
    let mut sides: Vec<(u32, u32, usize, usize, bool)> = Vec::with_capacity(3 * n);
    for (f, face) in single.faces().iter().enumerate() {
        for c in 0..3 {
            let (p, q) = (face[c], face[(c + 1) % 3]);
            let (at_p, at_q) = (3 * f + c, 3 * f + (c + 1) % 3);
            let (low, high) = if p < q { (at_p, at_q) } else { (at_q, at_p) };
            sides.push((p.min(q), p.max(q), low, high, p < q));
        }
    }
    sides.sort_unstable();
    for edge in sides.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
        if let [(_, _, low, high, upward), (_, _, other_low, other_high, other_upward)] = *edge {
            // Faces that disagree continue on the other side of each other.
            let across = if upward == other_upward { 3 * n } else { 0 };
            for (here, there) in [(low, other_low), (high, other_high)] {
                joined.join(here, there + across);
                joined.join(here + 3 * n, there + (3 * n - across));
            }
        }
    }
    let mut vertex_of = vec![u32::MAX; 6 * n];
    let mut positions = Vec::new();
    for corner in 0..6 * n {
        let root = joined.root(corner);
        if vertex_of[root] == u32::MAX {
            vertex_of[root] = positions.len() as u32;
            let within = corner % (3 * n);
            positions.push(single.positions()[single.faces()[within / 3][within % 3] as usize]);
        }
        vertex_of[corner] = vertex_of[root];
    }
    let faces = (0..2 * n).map(|f| {
        let [a, b, c] = [0, 1, 2].map(|c| vertex_of[3 * f + c]);
        if f < n { [a, b, c] } else { [a, c, b] }
    });
    let cover = TriangleMesh::from_parts(positions, faces.collect());
    let faces = kept.iter().map(|&f| (f, false)).chain(kept.iter().map(|&f| (f, true))).collect();
    let origins = Origins::new(mesh, &places, &cover, faces);
    Ok((ManifoldMesh::try_from(cover)?, origins))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Vertex, shapes};

    #[test]
    fn a_strip_with_a_half_twist_is_covered_by_one_with_a_whole_twist() {
        let strip = shapes::moebius_strip(40, 4);
        let (cover, origins) = double_cover(&strip, &RepairOptions::default()).unwrap();
        assert_eq!(cover.face_count(), 2 * strip.face_count());
        assert!((cover.area() - 2.0 * strip.area()).abs() < 1e-9);
        // A band: two rims where the strip has one.
        let topology = cover.topology();
        assert_eq!((topology.euler_characteristic(), topology.boundary_edge_count()), (0, 160));
        assert!((0..strip.vertex_count()).all(|v| origins.of_vertex(Vertex::new(v)).len() == 2));
    }

    #[test]
    fn what_can_be_oriented_is_covered_twice() {
        let sphere = shapes::icosphere(1);
        let (cover, _) = double_cover(&sphere, &RepairOptions::default()).unwrap();
        assert_eq!(cover.topology().euler_characteristic(), 4);
        assert!(cover.signed_volume().abs() < 1e-12);
    }
}
