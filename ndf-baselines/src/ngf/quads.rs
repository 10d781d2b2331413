//! Triangles paired to quadrilaterals.
//!
//! Pairs are taken greedily, the best shape first; then triangles left over are paired along alternating paths, as in
//! maximum matching (Berge 1957), but for those that only a blossom would pair.

use std::collections::VecDeque;

use ndf_core::DVec3;
use ndf_mesh::{Edge, Face, Halfedge, ManifoldMesh, Topology};
use ndf_meshing::triangle_shape::{cross, quality};

/// Quadrilaterals, and how many of them are single triangles.
pub(crate) struct Paired {
    pub(crate) quads: Vec<[u32; 4]>,
    pub(crate) triangles: usize,
}

/// Pairs the triangles of a mesh. A triangle that is left over has its last corner twice.
pub(crate) fn paired(mesh: &ManifoldMesh) -> Paired {
    let topology = mesh.topology();
    let mut matching = Matching { topology, mates: vec![None; mesh.face_count()] };
    let mut edges: Vec<(f64, Edge)> = topology.edges().filter_map(|e| Some((shape(mesh, e)?, e))).collect();
    edges.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for (_, edge) in edges {
        let h = topology.edge_halfedge(edge);
        let faces = [h.face(), topology.raw_twin(h).face()];
        if faces.iter().all(|f| matching.mates[f.index()].is_none()) {
            matching.join(faces);
        }
    }
    for face in topology.faces() {
        if matching.mates[face.index()].is_none() {
            matching.augment(face);
        }
    }
    let mut quads = Vec::with_capacity(mesh.face_count() / 2);
    let mut triangles = 0;
    for face in topology.faces() {
        match matching.mates[face.index()] {
            None => {
                let [a, b, c] = topology.face_vertices(face).map(u32::from);
                quads.push([a, b, c, c]);
                triangles += 1;
            }
            Some(mate) if mate > face => {
                let shared = face
                    .halfedges()
                    .into_iter()
                    .find(|&h| topology.twin(h).is_some_and(|twin| twin.face() == mate));
                let h = shared.expect("mates share an edge");
                let twin = topology.raw_twin(h);
                let corners = [h.next(), h.previous(), twin.next(), twin.previous()];
                quads.push(corners.map(|h| topology.tail(h).into()));
            }
            Some(_) => {}
        }
    }
    Paired { quads, triangles }
}

/// How good a quadrilateral the faces at an edge make: flat, and convex with triangles of good shape along both
/// diagonals. None on the boundary.
fn shape(mesh: &ManifoldMesh, edge: Edge) -> Option<f64> {
    let topology = mesh.topology();
    let h = topology.edge_halfedge(edge);
    let twin = topology.twin(h)?;
    let corner = |h| mesh.positions()[topology.tail(h).index()];
    let [a, b, c, d] = [h.next(), h.previous(), twin.next(), twin.previous()].map(corner);
    let along = |triangles: [[DVec3; 3]; 2]| {
        let flat = triangles.map(|t| cross(t).normalize_or_zero());
        triangles.map(quality).into_iter().fold(1.0, f64::min) * flat[0].dot(flat[1])
    };
    Some(along([[a, b, c], [a, c, d]]).min(along([[a, b, d], [b, c, d]])))
}

struct Matching<'a> {
    topology: &'a Topology,
    mates: Vec<Option<Face>>,
}

impl Matching<'_> {
    fn join(&mut self, [a, b]: [Face; 2]) {
        self.mates[a.index()] = Some(b);
        self.mates[b.index()] = Some(a);
    }

    /// Looks for the shortest alternating path from a face without a mate to another, and exchanges the pairs on it.
    fn augment(&mut self, start: Face) {
        // The face from which each was reached; every face is reached once, so that paths are simple.
        let mut from: Vec<Option<Face>> = vec![None; self.mates.len()];
        from[start.index()] = Some(start);
        let mut queue = VecDeque::from([start]);
        while let Some(face) = queue.pop_front() {
            let neighbours = face.halfedges().into_iter().filter_map(|h| self.topology.twin(h));
            for next in neighbours.map(Halfedge::face) {
                if from[next.index()].is_some() {
                    continue;
                }
                from[next.index()] = Some(face);
                match self.mates[next.index()] {
                    Some(mate) if from[mate.index()].is_none() => {
                        from[mate.index()] = Some(next);
                        queue.push_back(mate);
                    }
                    Some(_) => {}
                    None => return self.exchange(next, start, &from),
                }
            }
        }
    }

    fn exchange(&mut self, end: Face, start: Face, from: &[Option<Face>]) {
        let mut odd = end;
        loop {
            let even = from[odd.index()].expect("the path leads back");
            let freed = self.mates[even.index()];
            self.join([odd, even]);
            match freed {
                Some(next) if even != start => odd = next,
                _ => return,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::shapes;
    use ndf_meshing::{DecimationOptions, decimate};

    #[test]
    fn nearly_all_triangles_are_paired_and_the_surface_stays() {
        for shape in [shapes::icosphere(3), shapes::torus(40, 20, 1.0, 0.4), shapes::grid(9, 7)] {
            let mesh = ManifoldMesh::try_from(shape).unwrap();
            let coarse =
                decimate(&mesh, &DecimationOptions::to_faces(mesh.face_count() / 3), &ndf_core::NoProgress)
                    .mesh;
            let Paired { quads, triangles } = paired(&coarse);
            assert!(triangles * 50 <= coarse.face_count(), "{triangles} of {}", coarse.face_count());
            assert_eq!(2 * quads.len() - triangles, coarse.face_count());
            // Cut along a diagonal they have the sides of the mesh, each twice in opposite directions but at its border.
            let mut sides: Vec<[u32; 2]> = Vec::new();
            for &[a, b, c, d] in &quads {
                sides.extend([[a, b], [b, c], [c, d], [d, a]].into_iter().filter(|[p, q]| p != q));
            }
            let count = sides.len();
            sides.sort_unstable();
            sides.dedup();
            assert_eq!(sides.len(), count, "no side comes twice in one direction");
            let open = sides.iter().filter(|[p, q]| sides.binary_search(&[*q, *p]).is_err()).count();
            assert_eq!(open, coarse.topology().boundary_edge_count());
        }
    }

    #[test]
    fn a_strip_that_greed_would_break_is_paired_throughout() {
        // In the middle of a strip of four triangles is the best pair; the outer two are left over at first.
        let positions = [[0.0, 0.0], [0.1, 1.0], [1.0, 0.0], [1.1, 1.0], [2.9, 0.0], [4.0, 1.0]];
        let positions = positions.map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec();
        let faces = vec![[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]];
        let mesh = ndf_mesh::TriangleMesh::new(positions, faces).unwrap();
        let Paired { quads, triangles } = paired(&ManifoldMesh::try_from(mesh).unwrap());
        assert_eq!((quads.len(), triangles), (2, 0));
    }
}
