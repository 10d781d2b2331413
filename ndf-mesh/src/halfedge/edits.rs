//! Local changes that keep a complex a complex: flips, insertions, removals. All O(1) but for renumbering a vertex,
//! which is O(degree).
//!
//! Elements stay numbered without gaps: where one is removed the last of its kind takes its number. New half-edges
//! carry default data.

use super::{NO_HALFEDGE, Record, Topology};
use crate::{Edge, Face, Halfedge, Vertex};

impl<H: Copy + Default> Topology<H> {
    /// Moves the record of a half-edge to another slot, whose own record is lost.
    fn relocate(&mut self, from: Halfedge, to: Halfedge) {
        let record = self.halfedges[from.index()];
        self.halfedges[to.index()] = record;
        if record.twin != NO_HALFEDGE {
            self.halfedges[record.twin.index()].twin = to;
        }
        let canonical = &mut self.edge_halfedges[record.edge.index()];
        if *canonical == from {
            *canonical = to;
        }
        let outgoing = &mut self.vertex_halfedges[record.tail.index()];
        if *outgoing == from {
            *outgoing = to;
        }
    }

    /// Writes a half-edge and its twin, which run along `edge`.
    fn glue(&mut self, [h, t]: [Halfedge; 2], [tail, tip]: [Vertex; 2], edge: Edge) {
        self.halfedges[h.index()] = Record { twin: t, tail, edge, data: H::default() };
        self.halfedges[t.index()] = Record { twin: h, tail: tip, edge, data: H::default() };
        self.edge_halfedges[edge.index()] = h;
    }

    fn add_edge(&mut self) -> Edge {
        self.edge_halfedges.push(NO_HALFEDGE);
        Edge::new(self.edge_halfedges.len() - 1)
    }

    fn add_vertex(&mut self, halfedge: Halfedge) -> Vertex {
        self.vertex_halfedges.push(halfedge);
        Vertex::new(self.vertex_halfedges.len() - 1)
    }

    /// Adds a face and returns its half-edges, which are yet to be written.
    fn add_face(&mut self) -> [Halfedge; 3] {
        self.halfedges.extend([Record::hole(); 3]);
        Face::new(self.face_count() - 1).halfedges()
    }

    /// Whether the edge of `h` has two faces and the corners opposite it are not joined yet, so that a simplicial
    /// complex stays one when the edge is [flipped](Self::flip). O(degree).
    pub fn is_flippable(&self, h: Halfedge) -> bool {
        self.twin(h).is_some_and(|t| {
            let (k, l) = (self.tail(h.previous()), self.tail(t.previous()));
            k != l && !self.joins(k, l)
        })
    }

    /// Replaces the edge of half-edge `h`, i → j between k on its left and l on its right, by l → k. The slots
    /// of `h` and its twin keep their tails i and j; the new edge is in the slots after them, returned as
    /// `[l → k, k → l]`.
    ///
    /// The edge must have two different faces.
    pub fn flip(&mut self, h: Halfedge) -> [Halfedge; 2] {
        let t = self.raw_twin(h);
        let edge = self.halfedge_edge(h);
        let (hn, tn) = (h.next(), t.next());
        let (k, l) = (self.tail(h.previous()), self.tail(t.previous()));
        self.relocate(hn, t);
        self.relocate(tn, h);
        self.glue([hn, tn], [l, k], edge);
        [hn, tn]
    }

    /// Cuts a face (i, j, k) into three around a new vertex p. Half-edge i → j keeps its slot. Returns the new
    /// half-edges `[i → p, j → p, k → p]`; their edges are the last three in this order.
    pub fn insert_in_face(&mut self, face: Face) -> [Halfedge; 3] {
        let [_, from_j, to_i] = face.halfedges();
        let [i, j, k] = self.face_vertices(face);
        let ([at_j, from_k, to_j], [at_k, from_i, to_k]) = (self.add_face(), self.add_face());
        let edges = [self.add_edge(), self.add_edge(), self.add_edge()];
        let p = self.add_vertex(to_i);
        self.relocate(from_j, at_j);
        self.relocate(to_i, at_k);
        self.glue([from_i, to_i], [i, p], edges[0]);
        self.glue([from_j, to_j], [j, p], edges[1]);
        self.glue([from_k, to_k], [k, p], edges[2]);
        [from_i, from_j, from_k]
    }

    /// Cuts the edge of half-edge `h`, i → j between k on its left and l on its right, at a new vertex p.
    /// `h` keeps its slot and number of edge as i → p. Returns the new half-edges `[p → j, p → k, p → l]`, whose
    /// edges are the last in this order; on the boundary there is no third.
    ///
    /// Where both sides are one face, j → i must follow i → j there; then p is its own l, by a loop around j.
    pub fn split_edge(&mut self, h: Halfedge) -> ([Halfedge; 2], Option<Halfedge>) {
        let t = self.twin(h);
        let (hn, hp) = (h.next(), h.previous());
        let (edge, i, j, k) = (self.halfedge_edge(h), self.tail(h), self.tail(hn), self.tail(hp));
        let [first, first_next, first_last] = self.add_face();
        let (to_j, to_k) = (self.add_edge(), self.add_edge());
        let p = self.add_vertex(first);
        self.relocate(hn, first_next);
        self.glue([hn, first_last], [p, k], to_k);
        let Some(t) = t else {
            self.halfedges[first.index()] =
                Record { twin: NO_HALFEDGE, tail: p, edge: to_j, data: H::default() };
            self.edge_halfedges[to_j.index()] = first;
            return ([first, hn], None);
        };
        let folded = t == hn;
        let t = if folded { first_next } else { t };
        let (tn, l) = (t.next(), if folded { p } else { self.tail(t.previous()) });
        let (at_i, at_j) = (self.data(h), self.data(t));
        let [second, second_next, second_last] = self.add_face();
        let to_l = self.add_edge();
        self.relocate(tn, second_next);
        self.glue([tn, second_last], [p, l], to_l);
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
    pub fn remove_degree_three(&mut self, p: Vertex) -> [Edge; 3] {
        let mut spokes = [NO_HALFEDGE; 3];
        for (spoke, h) in spokes.iter_mut().zip(self.outgoing(p)) {
            *spoke = h;
        }
        let mut edges = spokes.map(|h| self.halfedge_edge(h));
        let outer = spokes.map(Halfedge::next);
        let (to_second, to_third) = (outer[0].next(), outer[0].previous());
        self.settle(outer);
        self.relocate(outer[1], to_second);
        self.relocate(outer[2], to_third);
        self.remove_faces([spokes[1].face(), spokes[2].face()]);
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
    pub fn remove_boundary_degree_two(&mut self, p: Vertex) -> [Edge; 2] {
        let along = self.vertex_halfedge(p);
        let inward = self.raw_twin(along.previous());
        let mut edges = [self.halfedge_edge(along), self.halfedge_edge(inward)];
        let across = along.next();
        self.settle([across, inward.next(), inward.previous()]);
        self.relocate(across, inward);
        self.remove_faces([along.face()]);
        edges.sort_unstable_by(|a, b| b.cmp(a));
        edges.iter().for_each(|&e| self.remove_edge(e));
        self.remove_vertex(p);
        edges
    }

    /// Makes the second corner of a face the first: its half-edges move to the slots before theirs.
    pub fn rotate_face(&mut self, face: Face) {
        let slots = face.halfedges();
        let moved = |h: Halfedge| if h.face() == face { h.previous() } else { h };
        let records = slots.map(|h| self.halfedges[h.index()]);
        let canonical = records.map(|record| moved(self.edge_halfedge(record.edge)));
        let outgoing = records.map(|record| moved(self.vertex_halfedge(record.tail)));
        for (slot, record) in slots.into_iter().zip(records) {
            let to = moved(slot);
            self.halfedges[to.index()] = Record { twin: moved(record.twin), ..record };
            if record.twin != NO_HALFEDGE {
                self.halfedges[moved(record.twin).index()].twin = to;
            }
        }
        for ((record, canonical), outgoing) in records.into_iter().zip(canonical).zip(outgoing) {
            self.edge_halfedges[record.edge.index()] = canonical;
            self.vertex_halfedges[record.tail.index()] = outgoing;
        }
    }

    /// Lets the tails of the half-edges that stay point at them where they may point at one that goes.
    fn settle(&mut self, staying: [Halfedge; 3]) {
        for h in staying {
            let v = self.tail(h).index();
            // The first half-edge of a boundary fan has no twin and is never one that goes.
            if self.raw_twin(self.vertex_halfedges[v]) != NO_HALFEDGE {
                self.vertex_halfedges[v] = h;
            }
        }
    }

    fn remove_faces<const N: usize>(&mut self, mut faces: [Face; N]) {
        faces.sort_unstable_by(|a, b| b.cmp(a));
        for face in faces {
            let last = Face::new(self.face_count() - 1);
            if face != last {
                for (from, to) in last.halfedges().into_iter().zip(face.halfedges()) {
                    self.relocate(from, to);
                }
            }
            self.halfedges.truncate(3 * last.index());
        }
    }

    fn remove_edge(&mut self, edge: Edge) {
        let last = Edge::new(self.edge_count() - 1);
        if edge != last {
            let h = self.edge_halfedge(last);
            self.halfedges[h.index()].edge = edge;
            if let Some(t) = self.twin(h) {
                self.halfedges[t.index()].edge = edge;
            }
        }
        self.edge_halfedges.swap_remove(edge.index());
    }

    fn remove_vertex(&mut self, vertex: Vertex) {
        let last = Vertex::new(self.vertex_count() - 1);
        if vertex != last {
            self.rename_fan(last, vertex);
        }
        self.vertex_halfedges.swap_remove(vertex.index());
    }

    /// Lets all half-edges that leave `vertex` leave `name`.
    pub(super) fn rename_fan(&mut self, vertex: Vertex, name: Vertex) {
        let start = self.vertex_halfedge(vertex);
        let mut h = start;
        while h != NO_HALFEDGE {
            self.halfedges[h.index()].tail = name;
            let around = self.raw_twin(h.previous());
            h = if around == start { NO_HALFEDGE } else { around };
        }
    }
}
