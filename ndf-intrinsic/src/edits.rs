//! Local changes of a Δ-complex: flips, insertions, removals. All O(1) but for renumbering a vertex, which is
//! O(degree).
//!
//! Elements stay numbered without gaps: where one is removed the last of its kind takes its number.

use crate::delta_complex::{DeltaComplex, HalfEdge, NO_HALFEDGE};

impl DeltaComplex {
    /// Moves the record of a half-edge to another slot, whose own record is lost.
    fn relocate(&mut self, from: u32, to: u32) {
        let record = self.halfedges[from as usize];
        self.halfedges[to as usize] = record;
        if record.twin != NO_HALFEDGE {
            self.halfedges[record.twin as usize].twin = to;
        }
        let canonical = &mut self.edge_halfedges[record.edge as usize];
        if *canonical == from {
            *canonical = to;
        }
        let outgoing = &mut self.vertex_halfedges[record.tail as usize];
        if *outgoing == from {
            *outgoing = to;
        }
    }

    /// Writes a half-edge and its twin, which run along `edge`.
    fn glue(&mut self, [h, t]: [u32; 2], [tail, tip]: [u32; 2], edge: u32) {
        self.halfedges[h as usize] = HalfEdge { twin: t, tail, edge, roundabout: 0 };
        self.halfedges[t as usize] = HalfEdge { twin: h, tail: tip, edge, roundabout: 0 };
        self.edge_halfedges[edge as usize] = h;
    }

    fn add_edge(&mut self) -> u32 {
        self.edge_halfedges.push(NO_HALFEDGE);
        (self.edge_halfedges.len() - 1) as u32
    }

    fn add_vertex(&mut self, halfedge: u32) -> u32 {
        self.vertex_halfedges.push(halfedge);
        (self.vertex_halfedges.len() - 1) as u32
    }

    /// Adds a face whose half-edges are yet to be written; returns the first of them.
    fn add_face(&mut self) -> u32 {
        let blank = HalfEdge { twin: NO_HALFEDGE, tail: u32::MAX, edge: u32::MAX, roundabout: 0 };
        self.halfedges.extend([blank; 3]);
        (self.halfedges.len() - 3) as u32
    }

    /// Replaces the edge of half-edge `h`, i → j between k on its left and l on its right, by l → k. The slots
    /// of `h` and its twin keep their tails i and j; the new edge is in the slots after them, returned as
    /// `[l → k, k → l]`.
    ///
    /// The edge must have two different faces.
    pub(crate) fn flip(&mut self, h: u32) -> [u32; 2] {
        let t = self.halfedges[h as usize].twin;
        let edge = self.halfedge_edge(h);
        let (hn, tn) = (self.next(h), self.next(t));
        let (k, l) = (self.tail(self.previous(h)), self.tail(self.previous(t)));
        self.relocate(hn, t);
        self.relocate(tn, h);
        self.glue([hn, tn], [l, k], edge);
        [hn, tn]
    }

    /// Cuts a face (i, j, k) into three around a new vertex p. Half-edge i → j keeps its slot. Returns the new
    /// half-edges `[i → p, j → p, k → p]`; their edges are the last three in this order.
    pub(crate) fn insert_in_face(&mut self, face: u32) -> [u32; 3] {
        let h = 3 * face;
        let [i, j, k] = self.face_vertices(face);
        let (first, second) = (self.add_face(), self.add_face());
        let edges = [self.add_edge(), self.add_edge(), self.add_edge()];
        let p = self.add_vertex(h + 2);
        self.relocate(h + 1, first);
        self.relocate(h + 2, second);
        self.glue([second + 1, h + 2], [i, p], edges[0]);
        self.glue([h + 1, first + 2], [j, p], edges[1]);
        self.glue([first + 1, second + 2], [k, p], edges[2]);
        [second + 1, h + 1, first + 1]
    }

    /// Cuts the edge of half-edge `h`, i → j between k on its left and l on its right, at a new vertex p.
    /// `h` keeps its slot and number of edge as i → p. Returns the new half-edges `[p → j, p → k, p → l]`, whose
    /// edges are the last in this order; on the boundary there is no third.
    ///
    /// Where both sides are one face, j → i must follow i → j there; then p is its own l, by a loop around j.
    pub(crate) fn split_edge(&mut self, h: u32) -> ([u32; 2], Option<u32>) {
        let t = self.twin(h);
        let (hn, hp) = (self.next(h), self.previous(h));
        let (edge, i, j, k) = (self.halfedge_edge(h), self.tail(h), self.tail(hn), self.tail(hp));
        let first = self.add_face();
        let (to_j, to_k) = (self.add_edge(), self.add_edge());
        let p = self.add_vertex(first);
        self.relocate(hn, first + 1);
        self.glue([hn, first + 2], [p, k], to_k);
        let Some(t) = t else {
            self.halfedges[first as usize] =
                HalfEdge { twin: NO_HALFEDGE, tail: p, edge: to_j, roundabout: 0 };
            self.edge_halfedges[to_j as usize] = first;
            return ([first, hn], None);
        };
        let folded = t == hn;
        let t = if folded { first + 1 } else { t };
        let (tn, l) = (self.next(t), if folded { p } else { self.tail(self.previous(t)) });
        let (at_i, at_j) = (self.halfedges[h as usize].roundabout, self.halfedges[t as usize].roundabout);
        let second = self.add_face();
        let to_l = self.add_edge();
        self.relocate(tn, second + 1);
        self.glue([tn, second + 2], [p, l], to_l);
        self.glue([h, second], [i, p], edge);
        self.glue([first, t], [p, j], to_j);
        self.halfedges[h as usize].roundabout = at_i;
        self.halfedges[t as usize].roundabout = at_j;
        ([first, hn], Some(tn))
    }

    /// Merges the three faces around inner vertex `p` into one and removes `p`. Returns the removed edges in the
    /// order to `swap_remove` their attributes.
    ///
    /// The vertex must have three different faces, and the opposite sides must not touch it.
    pub(crate) fn remove_degree_three(&mut self, p: u32) -> [u32; 3] {
        let mut spokes = [0; 3];
        for (spoke, h) in spokes.iter_mut().zip(self.outgoing(p)) {
            *spoke = h;
        }
        let mut edges = spokes.map(|h| self.halfedge_edge(h));
        let outer = spokes.map(|h| self.next(h));
        let (to_second, to_third) = (self.next(outer[0]), self.previous(outer[0]));
        self.settle(outer);
        self.relocate(outer[1], to_second);
        self.relocate(outer[2], to_third);
        self.remove_faces([spokes[1] / 3, spokes[2] / 3]);
        edges.sort_unstable_by(|a, b| b.cmp(a));
        edges.iter().for_each(|&e| self.remove_edge(e));
        self.remove_vertex(p);
        edges
    }

    /// Merges the two faces at boundary vertex `p` into one and removes `p`. Its first boundary edge goes; the
    /// last, from i to p, now leads to the far end. Returns the removed edges in the order to `swap_remove` their
    /// attributes, and i → j.
    ///
    /// The vertex must have two different faces.
    pub(crate) fn remove_boundary_degree_two(&mut self, p: u32) -> [u32; 2] {
        let along = self.vertex_halfedge(p);
        let inward = self.halfedges[self.previous(along) as usize].twin;
        let mut edges = [self.halfedge_edge(along), self.halfedge_edge(inward)];
        let across = self.next(along);
        self.settle([across, self.next(inward), self.previous(inward)]);
        self.relocate(across, inward);
        self.remove_faces([along / 3]);
        edges.sort_unstable_by(|a, b| b.cmp(a));
        edges.iter().for_each(|&e| self.remove_edge(e));
        self.remove_vertex(p);
        edges
    }

    /// Lets the tails of the half-edges that stay point at them where they may point at one that goes.
    fn settle(&mut self, staying: [u32; 3]) {
        for h in staying {
            let v = self.tail(h) as usize;
            // The first half-edge of a boundary fan has no twin and is never one that goes.
            if self.halfedges[self.vertex_halfedges[v] as usize].twin != NO_HALFEDGE {
                self.vertex_halfedges[v] = h;
            }
        }
    }

    fn remove_faces<const N: usize>(&mut self, mut faces: [u32; N]) {
        faces.sort_unstable_by(|a, b| b.cmp(a));
        for face in faces {
            let last = self.face_count() as u32 - 1;
            if face != last {
                for c in 0..3 {
                    self.relocate(3 * last + c, 3 * face + c);
                }
            }
            self.halfedges.truncate(3 * last as usize);
        }
    }

    fn remove_edge(&mut self, edge: u32) {
        let last = self.edge_count() as u32 - 1;
        if edge != last {
            let h = self.edge_halfedge(last);
            self.halfedges[h as usize].edge = edge;
            if let Some(t) = self.twin(h) {
                self.halfedges[t as usize].edge = edge;
            }
        }
        self.edge_halfedges.swap_remove(edge as usize);
    }

    fn remove_vertex(&mut self, vertex: u32) {
        let last = self.vertex_count() as u32 - 1;
        if vertex != last {
            let start = self.vertex_halfedge(last);
            let mut h = start;
            loop {
                self.halfedges[h as usize].tail = vertex;
                match self.twin(self.previous(h)) {
                    Some(next) if next != start => h = next,
                    _ => break,
                }
            }
        }
        self.vertex_halfedges.swap_remove(vertex as usize);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::ManifoldMesh;
    use ndf_mesh::shapes;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    #[test]
    fn random_edits_keep_a_complex_sound() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for mesh in [shapes::icosphere(1), shapes::torus(5, 4, 1.0, 0.4), shapes::grid(3, 2)] {
            let mut complex = DeltaComplex::of_mesh(&ManifoldMesh::try_from(mesh).unwrap());
            let euler = complex.euler_characteristic();
            let inputs = complex.vertex_count() as u32;
            for round in 0..3000 {
                match rng.random_range(0..6) {
                    0 => {
                        complex.insert_in_face(rng.random_range(0..complex.face_count() as u32));
                    }
                    1 => {
                        let e = rng.random_range(0..complex.edge_count() as u32);
                        let h = complex.edge_halfedge(e);
                        let twin = complex.twin(h);
                        complex.split_edge(twin.filter(|&t| t == complex.previous(h)).unwrap_or(h));
                    }
                    2 | 3 => {
                        let h = complex.edge_halfedge(rng.random_range(0..complex.edge_count() as u32));
                        if complex.twin(h).is_some_and(|t| t / 3 != h / 3) {
                            complex.flip(h);
                        }
                    }
                    _ => {
                        let v = rng.random_range(0..complex.vertex_count() as u32);
                        let faces: Vec<u32> = complex.outgoing(v).map(|h| h / 3).collect();
                        let simple = faces.iter().all(|f| faces.iter().filter(|g| f == *g).count() == 1);
                        if v < inputs || !simple {
                            continue;
                        }
                        if complex.is_boundary_vertex(v) && faces.len() == 2 {
                            complex.remove_boundary_degree_two(v);
                        } else if !complex.is_boundary_vertex(v) && faces.len() == 3 {
                            complex.remove_degree_three(v);
                        }
                    }
                }
                if round % 10 == 0 {
                    complex.check().unwrap();
                    assert_eq!(complex.euler_characteristic(), euler);
                }
            }
        }
    }
}
