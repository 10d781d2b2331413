//! Local changes that keep a complex a complex: flips, insertions, removals. All O(1) but for renumbering a vertex,
//! which is O(degree).
//!
//! Elements stay numbered without gaps: where one is removed the last of its kind takes its number. New half-edges
//! carry default data.

use super::{NO_HALFEDGE, Record, Topology, next, previous};

impl<H: Copy + Default> Topology<H> {
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
        self.halfedges[h as usize] = Record { twin: t, tail, edge, data: H::default() };
        self.halfedges[t as usize] = Record { twin: h, tail: tip, edge, data: H::default() };
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
        self.halfedges.extend([Record::hole(); 3]);
        (self.halfedges.len() - 3) as u32
    }

    /// Whether the edge of `h` has two faces and the corners opposite it are not joined yet, so that a simplicial
    /// complex stays one when the edge is [flipped](Self::flip). O(degree).
    pub fn is_flippable(&self, h: u32) -> bool {
        self.twin(h).is_some_and(|t| {
            let (k, l) = (self.tail(previous(h)), self.tail(previous(t)));
            k != l && !self.joins(k, l)
        })
    }

    /// Replaces the edge of half-edge `h`, i → j between k on its left and l on its right, by l → k. The slots
    /// of `h` and its twin keep their tails i and j; the new edge is in the slots after them, returned as
    /// `[l → k, k → l]`.
    ///
    /// The edge must have two different faces.
    pub fn flip(&mut self, h: u32) -> [u32; 2] {
        let t = self.raw_twin(h);
        let edge = self.halfedge_edge(h);
        let (hn, tn) = (next(h), next(t));
        let (k, l) = (self.tail(previous(h)), self.tail(previous(t)));
        self.relocate(hn, t);
        self.relocate(tn, h);
        self.glue([hn, tn], [l, k], edge);
        [hn, tn]
    }

    /// Cuts a face (i, j, k) into three around a new vertex p. Half-edge i → j keeps its slot. Returns the new
    /// half-edges `[i → p, j → p, k → p]`; their edges are the last three in this order.
    pub fn insert_in_face(&mut self, face: u32) -> [u32; 3] {
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
    pub fn split_edge(&mut self, h: u32) -> ([u32; 2], Option<u32>) {
        let t = self.twin(h);
        let (hn, hp) = (next(h), previous(h));
        let (edge, i, j, k) = (self.halfedge_edge(h), self.tail(h), self.tail(hn), self.tail(hp));
        let first = self.add_face();
        let (to_j, to_k) = (self.add_edge(), self.add_edge());
        let p = self.add_vertex(first);
        self.relocate(hn, first + 1);
        self.glue([hn, first + 2], [p, k], to_k);
        let Some(t) = t else {
            self.halfedges[first as usize] =
                Record { twin: NO_HALFEDGE, tail: p, edge: to_j, data: H::default() };
            self.edge_halfedges[to_j as usize] = first;
            return ([first, hn], None);
        };
        let folded = t == hn;
        let t = if folded { first + 1 } else { t };
        let (tn, l) = (next(t), if folded { p } else { self.tail(previous(t)) });
        let (at_i, at_j) = (self.data(h), self.data(t));
        let second = self.add_face();
        let to_l = self.add_edge();
        self.relocate(tn, second + 1);
        self.glue([tn, second + 2], [p, l], to_l);
        self.glue([h, second], [i, p], edge);
        self.glue([first, t], [p, j], to_j);
        self.set_data(h, at_i);
        self.set_data(t, at_j);
        ([first, hn], Some(tn))
    }

    /// Merges the three faces around inner vertex `p` into one and removes `p`. Returns the removed edges in the
    /// order to `swap_remove` their attributes.
    ///
    /// The vertex must have three different faces, and the opposite sides must not touch it.
    pub fn remove_degree_three(&mut self, p: u32) -> [u32; 3] {
        let mut spokes = [0; 3];
        for (spoke, h) in spokes.iter_mut().zip(self.outgoing(p)) {
            *spoke = h;
        }
        let mut edges = spokes.map(|h| self.halfedge_edge(h));
        let outer = spokes.map(next);
        let (to_second, to_third) = (next(outer[0]), previous(outer[0]));
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
    /// attributes.
    ///
    /// The vertex must have two different faces.
    pub fn remove_boundary_degree_two(&mut self, p: u32) -> [u32; 2] {
        let along = self.vertex_halfedge(p);
        let inward = self.raw_twin(previous(along));
        let mut edges = [self.halfedge_edge(along), self.halfedge_edge(inward)];
        let across = next(along);
        self.settle([across, next(inward), previous(inward)]);
        self.relocate(across, inward);
        self.remove_faces([along / 3]);
        edges.sort_unstable_by(|a, b| b.cmp(a));
        edges.iter().for_each(|&e| self.remove_edge(e));
        self.remove_vertex(p);
        edges
    }

    /// Makes the second corner of a face the first: its half-edges move to the slots before theirs.
    pub fn rotate_face(&mut self, face: u32) {
        let slots = [0, 1, 2].map(|c| 3 * face + c);
        let moved = |h: u32| if h / 3 == face { previous(h) } else { h };
        let records = slots.map(|h| self.halfedges[h as usize]);
        let canonical = records.map(|record| moved(self.edge_halfedge(record.edge)));
        let outgoing = records.map(|record| moved(self.vertex_halfedge(record.tail)));
        for (slot, record) in slots.into_iter().zip(records) {
            let to = moved(slot);
            self.halfedges[to as usize] = Record { twin: moved(record.twin), ..record };
            if record.twin != NO_HALFEDGE {
                self.halfedges[moved(record.twin) as usize].twin = to;
            }
        }
        for ((record, canonical), outgoing) in records.into_iter().zip(canonical).zip(outgoing) {
            self.edge_halfedges[record.edge as usize] = canonical;
            self.vertex_halfedges[record.tail as usize] = outgoing;
        }
    }

    /// Lets the tails of the half-edges that stay point at them where they may point at one that goes.
    fn settle(&mut self, staying: [u32; 3]) {
        for h in staying {
            let v = self.tail(h) as usize;
            // The first half-edge of a boundary fan has no twin and is never one that goes.
            if self.raw_twin(self.vertex_halfedges[v]) != NO_HALFEDGE {
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
            self.rename_fan(last, vertex);
        }
        self.vertex_halfedges.swap_remove(vertex as usize);
    }

    /// Lets all half-edges that leave `vertex` leave `name`.
    pub(super) fn rename_fan(&mut self, vertex: u32, name: u32) {
        let start = self.vertex_halfedge(vertex);
        let mut h = start;
        while h != NO_HALFEDGE {
            self.halfedges[h as usize].tail = name;
            let around = self.raw_twin(previous(h));
            h = if around == start { NO_HALFEDGE } else { around };
        }
    }
}
