//! A manifold mesh whose connectivity can be edited: edges collapsed and flipped.
//!
//! Half-edges are implicit as in [`ManifoldMesh`]: half-edge `3 f + c` runs from corner `c` of face `f` to the
//! next corner. The edits keep the mesh an oriented manifold if their conditions hold; they never move faces
//! or vertices to other indices.

use ndf_core::DVec3;
use ndf_mesh::NO_HALFEDGE;
use ndf_mesh::{ManifoldMesh, TriangleMesh};

/// Marks the corners of a face that is gone.
const NO_VERTEX: u32 = u32::MAX;

/// The mesh. Faces that are gone have no vertices; vertices that are gone have no half-edge.
#[derive(Clone, Debug)]
pub(crate) struct HalfedgeMesh {
    pub(crate) positions: Vec<DVec3>,
    tails: Vec<u32>,
    twins: Vec<u32>,
    /// An outgoing half-edge of every vertex; at the boundary the first of the fan, counter-clockwise.
    outgoing: Vec<u32>,
    face_count: usize,
}

pub(crate) fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

pub(crate) fn previous(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

impl HalfedgeMesh {
    pub(crate) fn new(mesh: &ManifoldMesh) -> Self {
        let halfedges = 0..mesh.halfedge_count() as u32;
        Self {
            positions: mesh.positions().to_vec(),
            tails: mesh.faces().concat(),
            twins: halfedges.map(|h| mesh.twin(h).unwrap_or(NO_HALFEDGE)).collect(),
            outgoing: (0..mesh.vertex_count() as u32).map(|v| mesh.vertex_halfedge(v)).collect(),
            face_count: mesh.face_count(),
        }
    }

    /// The mesh without the gaps that edits left; what remains keeps its order.
    pub(crate) fn into_manifold(self) -> ManifoldMesh {
        let mut new_index = vec![NO_VERTEX; self.positions.len()];
        let mut positions = Vec::new();
        for (v, index) in new_index.iter_mut().enumerate().filter(|(v, _)| self.outgoing[*v] != NO_HALFEDGE) {
            *index = positions.len() as u32;
            positions.push(self.positions[v]);
        }
        let corners = self.tails.chunks_exact(3).filter(|face| face[0] != NO_VERTEX);
        let faces = corners.map(|f| [f[0], f[1], f[2]].map(|v| new_index[v as usize])).collect();
        let mesh = TriangleMesh::new(positions, faces).expect("faces name vertices that remain");
        ManifoldMesh::try_from(mesh).expect("collapses and flips keep a manifold")
    }

    /// The mesh as it is; only where no face or vertex is gone.
    pub(crate) fn to_triangle_mesh(&self) -> TriangleMesh {
        let faces = self.tails.chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect();
        TriangleMesh::new(self.positions.clone(), faces).expect("no face is gone")
    }

    pub(crate) fn face_count(&self) -> usize {
        self.face_count
    }

    pub(crate) fn halfedge_count(&self) -> usize {
        self.tails.len()
    }

    pub(crate) fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Whether the face of a half-edge is still there.
    pub(crate) fn exists(&self, h: u32) -> bool {
        self.tails[h as usize] != NO_VERTEX
    }

    /// Twin, or [`NO_HALFEDGE`] on the boundary.
    pub(crate) fn twin(&self, h: u32) -> u32 {
        self.twins[h as usize]
    }

    pub(crate) fn tail(&self, h: u32) -> u32 {
        self.tails[h as usize]
    }

    pub(crate) fn tip(&self, h: u32) -> u32 {
        self.tails[next(h) as usize]
    }

    pub(crate) fn position(&self, v: u32) -> DVec3 {
        self.positions[v as usize]
    }

    /// Corners of the face of a half-edge, from its tail.
    pub(crate) fn corners(&self, h: u32) -> [u32; 3] {
        [self.tail(h), self.tail(next(h)), self.tail(previous(h))]
    }

    pub(crate) fn is_boundary_vertex(&self, v: u32) -> bool {
        self.twin(self.outgoing[v as usize]) == NO_HALFEDGE
    }

    /// The half-edge that stands for both of its edge.
    pub(crate) fn canonical(&self, h: u32) -> u32 {
        h.min(self.twin(h))
    }

    /// Outgoing half-edges of a vertex, counter-clockwise, one for each of its faces.
    pub(crate) fn fan(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        let start = self.outgoing[v as usize];
        std::iter::successors((start != NO_HALFEDGE).then_some(start), move |&h| {
            let n = self.twin(previous(h));
            (n != NO_HALFEDGE && n != start).then_some(n)
        })
    }

    /// Vertices joined to `v` by an edge, counter-clockwise.
    pub(crate) fn ring(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        self.fan(v).flat_map(move |h| {
            let last = self.twin(previous(h)) == NO_HALFEDGE;
            std::iter::once(self.tip(h)).chain(last.then(|| self.tail(previous(h))))
        })
    }

    /// One half-edge of every edge at `v`: outgoing, but for the last of a boundary vertex.
    pub(crate) fn edges_at(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        self.fan(v).flat_map(move |h| {
            let last = self.twin(previous(h)) == NO_HALFEDGE;
            std::iter::once(h).chain(last.then(|| previous(h)))
        })
    }

    /// Whether the edge of `h` can be collapsed without change of topology: the link condition (Dey et al.
    /// 1999), with all of the boundary joined to one further vertex. `marks` has a zero for every vertex
    /// and gets them back.
    pub(crate) fn is_collapsible(&self, h: u32, marks: &mut [u8]) -> bool {
        let (a, b, twin) = (self.tail(h), self.tip(h), self.twin(h));
        let interior = twin != NO_HALFEDGE;
        if interior && self.is_boundary_vertex(a) && self.is_boundary_vertex(b) {
            return false;
        }
        // A vertex opposite the edge must keep a fan of faces: one at the boundary, three in the interior.
        let keeps_fan = |h: u32| {
            let opposite = self.tail(previous(h));
            let faces = self.fan(opposite).take(4).count();
            if self.is_boundary_vertex(opposite) { faces >= 2 } else { faces >= 4 }
        };
        if !keeps_fan(h) || (interior && !keeps_fan(twin)) {
            return false;
        }
        self.ring(a).for_each(|v| marks[v as usize] = 1);
        let common = self.ring(b).filter(|&v| marks[v as usize] == 1).count();
        self.ring(a).for_each(|v| marks[v as usize] = 0);
        common == if interior { 2 } else { 1 }
    }

    /// Collapses the edge of `h` into its tail, which moves to `position`. The edge must be
    /// [collapsible](Self::is_collapsible).
    pub(crate) fn collapse(&mut self, h: u32, position: DVec3) {
        let (a, b) = (self.tail(h), self.tip(h));
        let around: Vec<u32> = self.fan(b).collect();
        around.into_iter().for_each(|o| self.tails[o as usize] = a);
        let mut start = NO_HALFEDGE;
        for side in [h, self.twin(h)].into_iter().filter(|&s| s != NO_HALFEDGE) {
            let (n, p) = (next(side), previous(side));
            // The first runs from the opposite vertex to the merged one, the second back; now they are twins.
            let (outer_n, outer_p) = (self.twin(n), self.twin(p));
            if outer_n != NO_HALFEDGE {
                self.twins[outer_n as usize] = outer_p;
            }
            if outer_p != NO_HALFEDGE {
                self.twins[outer_p as usize] = outer_n;
            }
            start = if outer_p == NO_HALFEDGE { next(outer_n) } else { outer_p };
            let opposite = self.tail(p) as usize;
            if self.outgoing[opposite] == p {
                self.outgoing[opposite] = outer_n;
            }
            for corner in [side, n, p] {
                self.tails[corner as usize] = NO_VERTEX;
            }
            self.face_count -= 1;
        }
        self.outgoing[a as usize] = self.first_of_fan(start);
        self.outgoing[b as usize] = NO_HALFEDGE;
        self.positions[a as usize] = position;
    }

    /// Turns clockwise to the boundary, if there is one.
    fn first_of_fan(&self, start: u32) -> u32 {
        let mut h = start;
        while self.twin(h) != NO_HALFEDGE {
            h = next(self.twin(h));
            if h == start {
                break;
            }
        }
        h
    }

    /// Splits the edge of `h`, from a to b, at a new vertex, which is returned. Afterwards `h` runs from a to it.
    pub(crate) fn split(&mut self, h: u32, position: DVec3) -> u32 {
        let middle = self.positions.len() as u32;
        self.positions.push(position);
        let t = self.twin(h);
        // On either side: the half that keeps the face, and the first half-edge of the face of the other half.
        let first = self.halve(h, middle, true);
        self.outgoing.push(first);
        if t != NO_HALFEDGE {
            let second = self.halve(t, middle, false);
            self.twins[first as usize] = second;
            self.twins[second as usize] = first;
        }
        middle
    }

    /// Cuts the face left of `side`, from x to y, through its opposite corner. The old face keeps the half at x
    /// if `at_tail`, otherwise that at y. Returns the half-edge of the new face along the edge.
    fn halve(&mut self, side: u32, middle: u32, at_tail: bool) -> u32 {
        let (n, p) = (next(side), previous(side));
        let (y, apex) = (self.tail(n), self.tail(p));
        let new = self.tails.len() as u32;
        // New face: from the middle to y and the apex, or from x to the middle and the apex.
        let (moved, cut, corners) = if at_tail {
            (n, [n, new + 2], [middle, y, apex])
        } else {
            (p, [p, new + 1], [self.tail(side), middle, apex])
        };
        let copy = if at_tail { new + 1 } else { new + 2 };
        self.tails.extend(corners);
        self.twins.extend([NO_HALFEDGE; 3]);
        // The side away from the kept half goes to the new face; in its place comes the cut.
        let outer = self.twin(moved);
        self.twins[copy as usize] = outer;
        if outer != NO_HALFEDGE {
            self.twins[outer as usize] = copy;
        }
        self.twins[cut[0] as usize] = cut[1];
        self.twins[cut[1] as usize] = cut[0];
        if at_tail {
            self.tails[n as usize] = middle;
            if self.outgoing[y as usize] == n {
                self.outgoing[y as usize] = copy;
            }
        } else {
            let x = self.tail(side);
            self.tails[side as usize] = middle;
            if self.outgoing[apex as usize] == p {
                self.outgoing[apex as usize] = copy;
            }
            if self.outgoing[x as usize] == side {
                self.outgoing[x as usize] = new;
            }
        }
        self.face_count += 1;
        new
    }

    /// Whether the edge of `h` has two faces and their opposite corners are not joined yet.
    pub(crate) fn is_flippable(&self, h: u32) -> bool {
        let twin = self.twin(h);
        twin != NO_HALFEDGE && {
            let (c, d) = (self.tail(previous(h)), self.tail(previous(twin)));
            c != d && self.ring(c).all(|v| v != d)
        }
    }

    /// Replaces the edge of `h`, from a to b, by the edge from d to c between the opposite corners: c left of
    /// `h`, d right of it. The edge must be [flippable](Self::is_flippable). Afterwards `h` runs from d to c.
    pub(crate) fn flip(&mut self, h: u32) {
        let t = self.twin(h);
        let (hn, hp, tn, tp) = (next(h), previous(h), next(t), previous(t));
        let [a, b, c, d] = [self.tail(h), self.tail(t), self.tail(hp), self.tail(tp)];
        let outer = [hn, hp, tn, tp].map(|side| self.twin(side));
        // Old sides: hn from b to c, hp from c to a, tn from a to d, tp from d to b.
        // New faces: h d→c, hn c→a, hp a→d; t c→d, tn d→b, tp b→c.
        for (side, tail) in [(h, d), (hn, c), (hp, a), (t, c), (tn, d), (tp, b)] {
            self.tails[side as usize] = tail;
        }
        for (side, twin) in [tp, hn, hp, tn].into_iter().zip(outer) {
            self.twins[side as usize] = twin;
            if twin != NO_HALFEDGE {
                self.twins[twin as usize] = side;
            }
        }
        for (vertex, old, new) in [(a, [h, tn], hp), (b, [t, hn], tp), (c, [hp, hp], hn), (d, [tp, tp], tn)] {
            if old.contains(&self.outgoing[vertex as usize]) {
                self.outgoing[vertex as usize] = new;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::shapes;

    /// Everything the structure promises, and that it is still the mesh a manifold is made of.
    fn check(mesh: &HalfedgeMesh) {
        for h in (0..mesh.halfedge_count() as u32).filter(|&h| mesh.exists(h)) {
            let twin = mesh.twin(h);
            if twin != NO_HALFEDGE {
                assert_eq!(mesh.twin(twin), h);
                assert_eq!((mesh.tail(twin), mesh.tip(twin)), (mesh.tip(h), mesh.tail(h)));
            }
        }
        let mut met = 0;
        for v in 0..mesh.vertex_count() as u32 {
            met += mesh.fan(v).inspect(|&h| assert_eq!(mesh.tail(h), v)).count();
        }
        assert_eq!(met, 3 * mesh.face_count());
    }

    #[test]
    fn collapses_keep_topology_until_none_is_possible() {
        for shape in
            [shapes::icosphere(2), shapes::torus(12, 8, 1.0, 0.4), shapes::grid(5, 4), shapes::cube(2)]
        {
            let manifold = ManifoldMesh::try_from(shape).unwrap();
            let mut mesh = HalfedgeMesh::new(&manifold);
            let mut marks = vec![0; mesh.vertex_count()];
            loop {
                let open = (0..mesh.halfedge_count() as u32).filter(|&h| mesh.exists(h));
                let Some(h) = open.into_iter().find(|&h| mesh.is_collapsible(h, &mut marks)) else { break };
                mesh.collapse(h, mesh.position(mesh.tail(h)));
                check(&mesh);
            }
            let loops = usize::from(manifold.boundary_edge_count() > 0);
            let fewest = match (manifold.euler_characteristic(), loops) {
                (2, 0) => 4,
                (0, 0) => 14,
                _ => 1,
            };
            // Greedy collapses may stop a little short of the smallest triangulation of a torus.
            assert!((fewest..=fewest + 8).contains(&mesh.face_count()), "{}", mesh.face_count());
            let rest = mesh.into_manifold();
            assert_eq!(rest.euler_characteristic(), manifold.euler_characteristic());
        }
    }

    #[test]
    fn splits_keep_topology() {
        for shape in [shapes::icosphere(1), shapes::grid(4, 3), shapes::torus(7, 6, 1.0, 0.4)] {
            let manifold = ManifoldMesh::try_from(shape).unwrap();
            let mut mesh = HalfedgeMesh::new(&manifold);
            for k in 0..300_u32 {
                let h = k.wrapping_mul(2_654_435_761) % mesh.halfedge_count() as u32;
                let middle = mesh.position(mesh.tail(h)).midpoint(mesh.position(mesh.tip(h)));
                let (tail, m) = (mesh.tail(h), mesh.split(h, middle));
                assert_eq!((mesh.tail(h), mesh.tip(h)), (tail, m));
                check(&mesh);
            }
            let area = manifold.area();
            let split = mesh.into_manifold();
            assert_eq!(split.euler_characteristic(), manifold.euler_characteristic());
            assert!((split.area() - area).abs() < 1e-9);
        }
    }

    #[test]
    fn flips_keep_topology() {
        for shape in [shapes::icosphere(1), shapes::grid(4, 4), shapes::torus(7, 6, 1.0, 0.4)] {
            let manifold = ManifoldMesh::try_from(shape).unwrap();
            let mut mesh = HalfedgeMesh::new(&manifold);
            let mut flipped = 0;
            for k in 0..2_000_u32 {
                let h = k.wrapping_mul(2_654_435_761) % mesh.halfedge_count() as u32;
                if mesh.is_flippable(h) {
                    mesh.flip(h);
                    flipped += 1;
                }
            }
            assert!(flipped > 100);
            check(&mesh);
            assert_eq!(mesh.into_manifold().euler_characteristic(), manifold.euler_characteristic());
        }
    }
}
