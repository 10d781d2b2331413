//! What a block shares with others while it is decimated by itself.

use ndf_mesh::{Halfedge, Vertex};

use crate::editable_mesh::EditableMesh;

/// In place of the label of a vertex that no other block has.
pub(super) const INNER: u32 = u32::MAX;

/// The vertices on the border of a block. They stay where they are, as do the edges between them, so that the blocks can be sewn
/// together again along them.
#[derive(Clone, Debug)]
pub(super) struct Seams {
    /// Of every vertex on the border, its number in the whole mesh; [`INNER`] of others.
    labels: Vec<u32>,
    /// Whether the block has another vertex with the same label: where its faces around one make several fans.
    is_pinched: Vec<bool>,
}

impl Seams {
    pub(super) fn new(labels: Vec<u32>) -> Self {
        let mut order: Vec<usize> = (0..labels.len()).filter(|&v| labels[v] != INNER).collect();
        order.sort_unstable_by_key(|&v| labels[v]);
        let mut is_pinched = vec![false; labels.len()];
        for same in order.chunk_by(|&v, &w| labels[v] == labels[w]).filter(|same| same.len() > 1) {
            same.iter().for_each(|&v| is_pinched[v] = true);
        }
        Self { labels, is_pinched }
    }

    pub(super) fn label(&self, v: Vertex) -> u32 {
        self.labels[v.index()]
    }

    fn is_on_border(&self, v: Vertex) -> bool {
        self.label(v) != INNER
    }

    /// Whether what is sewn together stays simplicial if the edge of `h` is collapsed: no second edge may join two vertices of the
    /// border, which another block could join, too, or two vertices of which one has become several here.
    pub(super) fn allow(&self, mesh: &EditableMesh, h: Halfedge) -> bool {
        let (a, b) = (mesh.tail(h), mesh.tip(h));
        let (kept, gone) = match (self.is_on_border(a), self.is_on_border(b)) {
            (true, true) => return false,
            (true, false) => (a, b),
            (false, true) => (b, a),
            (false, false) => {
                let around = [a, b].into_iter().flat_map(|v| mesh.ring(v));
                let mut pinched: Vec<Vertex> = around.filter(|v| self.is_pinched[v.index()]).collect();
                pinched.sort_unstable_by_key(|&v| (self.label(v), v));
                pinched.dedup();
                return pinched.windows(2).all(|pair| self.label(pair[0]) != self.label(pair[1]));
            }
        };
        let is_joined = |v: Vertex| v == kept || !self.is_on_border(v) || mesh.joins(kept, v);
        !self.is_pinched[kept.index()] && mesh.ring(gone).all(is_joined)
    }

    /// The vertex `a` takes the place of `b`, if that is on the border.
    pub(super) fn merge(&mut self, a: Vertex, b: Vertex) {
        if self.is_on_border(b) {
            self.labels[a.index()] = self.labels[b.index()];
            self.is_pinched[a.index()] = self.is_pinched[b.index()];
        }
    }
}
