//! Edge collapses in a simplicial complex.
//!
//! They leave holes in the numbering, which [`Topology::compact`] closes once all are done: so elements keep their
//! order, which often is one of space, and what is near in it stays near in memory.

use super::{NO_HALFEDGE, Record, Topology};
use crate::{Edge, Face, Halfedge};

impl<H: Copy + Default> Topology<H> {
    /// Whether the edge of `h` can be collapsed without changing the topology of the surface. The complex must be
    /// simplicial. O(degree · log degree).
    ///
    /// This is the link condition of Dey, Edelsbrunner, Guha and Nekhayev (1999) for surfaces with boundary: let a
    /// cone join all of the boundary to one further vertex ω; then the links of the ends may share nothing but the
    /// link of the edge. In terms of the surface itself:
    ///
    /// - An inner edge has at most one end on the boundary, or else ω were in both links.
    /// - The ends have no neighbours in common but the corners opposite the edge.
    /// - A corner opposite the edge keeps three faces inside and one on the boundary. With fewer it has degree
    ///   three in the closed complex, so that an edge is in both links.
    pub fn is_collapsible(&self, h: Halfedge) -> bool {
        let (i, j, t) = (self.tail(h), self.tip(h), self.twin(h));
        if t.is_some() && self.is_boundary_vertex(i) && self.is_boundary_vertex(j) {
            return false;
        }
        let keeps_fan = |side: Halfedge| {
            let opposite = self.tail(side.previous());
            let least = if self.is_boundary_vertex(opposite) { 2 } else { 4 };
            self.outgoing(opposite).take(least).count() == least
        };
        if !keeps_fan(h) || t.is_some_and(|t| !keeps_fan(t)) {
            return false;
        }
        let mut ring = Vec::with_capacity(16);
        ring.extend(self.ring(i));
        ring.sort_unstable();
        let common = self.ring(j).filter(|v| ring.binary_search(v).is_ok()).count();
        common == 1 + usize::from(t.is_some())
    }

    /// Collapses the edge of `h`, i → j, into i. It must be [collapsible](Self::is_collapsible). The one or two faces
    /// at the edge, j and the edges returned are holes then: nothing leads there, and nobody may ask about them but
    /// [`is_hole`](Self::is_hole).
    pub fn collapse(&mut self, h: Halfedge) -> [Option<Edge>; 3] {
        let (i, j, t) = (self.tail(h), self.tip(h), self.raw_twin(h));
        let gone = [h.face(), t.face()];
        let first = self.vertex_halfedge(j);
        self.rename_fan(j, i);
        if self.raw_twin(first) == NO_HALFEDGE && !gone.contains(&first.face()) {
            // Now i is on the boundary, where j was.
            self.vertex_halfedges[i.index()] = first;
        }
        let mut edges = [Some(self.halfedge_edge(h)), None, None];
        for (slot, side) in [h, t].into_iter().enumerate().filter(|s| s.1 != NO_HALFEDGE) {
            // The sides besides the collapsed one become one edge, that of the side at i.
            let (at_i, at_j) =
                if slot == 0 { (side.previous(), side.next()) } else { (side.next(), side.previous()) };
            edges[1 + slot] = Some(self.halfedge_edge(at_j));
            self.merge(self.halfedge_edge(at_i), [at_i, at_j].map(|h| self.raw_twin(h)), gone);
        }
        gone.iter()
            .filter(|&&f| f != NO_HALFEDGE.face())
            .for_each(|&f| self.halfedges[3 * f.index()..][..3].fill(Record::hole()));
        self.vertex_halfedges[j.index()] = NO_HALFEDGE;
        edges.into_iter().flatten().for_each(|e| self.edge_halfedges[e.index()] = NO_HALFEDGE);
        edges
    }

    /// Glues two half-edges along `edge`; one may be missing. Vertices at them whose half-edge is in a face that
    /// goes get another.
    fn merge(&mut self, edge: Edge, outer: [Halfedge; 2], gone: [Face; 2]) {
        for (h, twin) in
            [(outer[0], outer[1]), (outer[1], outer[0])].into_iter().filter(|o| o.0 != NO_HALFEDGE)
        {
            let record = &mut self.halfedges[h.index()];
            (record.twin, record.edge) = (twin, edge);
            self.edge_halfedges[edge.index()] = h;
        }
        for h in outer.into_iter().filter(|&h| h != NO_HALFEDGE).flat_map(|h| [h, h.next()]) {
            let first = &mut self.vertex_halfedges[self.halfedges[h.index()].tail.index()];
            // A half-edge without twin begins the fan.
            if gone.contains(&first.face()) || self.halfedges[h.index()].twin == NO_HALFEDGE {
                *first = h;
            }
        }
    }
}
