//! Closing the holes that collapses leave.

use super::{NO_EDGE, NO_HALFEDGE, NO_VERTEX, Record, Topology};
use crate::{Edge, Face, Halfedge, Vertex};

/// The elements that are left, by their old numbers.
#[derive(Clone, Debug)]
pub struct Survivors {
    /// Vertices, in order.
    pub vertices: Vec<Vertex>,
    /// Edges, in order.
    pub edges: Vec<Edge>,
}

impl<H: Copy + Default> Record<H> {
    /// What is kept of a half-edge that is not there.
    pub(super) fn hole() -> Self {
        Self { twin: NO_HALFEDGE, tail: NO_VERTEX, edge: NO_EDGE, data: H::default() }
    }
}

impl<H: Copy> Topology<H> {
    /// Whether the face of a half-edge is gone.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn is_hole(&self, halfedge: Halfedge) -> bool {
        self.tail(halfedge) == NO_VERTEX
    }

    /// Whether a vertex is gone.
    ///
    /// # Panics
    /// If the vertex does not exist.
    #[inline]
    pub fn is_vertex_hole(&self, vertex: Vertex) -> bool {
        self.vertex_halfedge(vertex) == NO_HALFEDGE
    }

    /// Closes the holes that [collapses](Self::collapse) left; what remains keeps its order. In place, O(n).
    pub fn compact(&mut self) -> Survivors {
        let vertices: Vec<Vertex> = self.vertices().filter(|&v| !self.is_vertex_hole(v)).collect();
        let edges: Vec<Edge> = self.edges().filter(|&e| self.edge_halfedge(e) != NO_HALFEDGE).collect();
        let faces: Vec<Face> = self.faces().filter(|&f| !self.is_hole(f.halfedge(0))).collect();
        let new_vertex = numbers(&vertices, self.vertex_count());
        let new_edge = numbers(&edges, self.edge_count());
        let new_face = numbers(&faces, self.face_count());
        let new_halfedge = |h: Halfedge| {
            if h == NO_HALFEDGE { h } else { Face(new_face[h.face().index()]).halfedge(h.corner()) }
        };
        for (old, new) in faces.iter().flat_map(|f| f.halfedges()).zip(0..) {
            let Record { twin, tail, edge, data } = self.halfedges[old.index()];
            let (tail, edge) = (Vertex(new_vertex[tail.index()]), Edge(new_edge[edge.index()]));
            let twin = new_halfedge(twin);
            self.halfedges[new] = Record { twin, tail, edge, data };
        }
        self.halfedges.truncate(3 * faces.len());
        keep(&mut self.edge_halfedges, &edges);
        keep(&mut self.vertex_halfedges, &vertices);
        self.edge_halfedges.iter_mut().for_each(|h| *h = new_halfedge(*h));
        self.vertex_halfedges.iter_mut().for_each(|h| *h = new_halfedge(*h));
        Survivors { vertices, edges }
    }
}

/// Where each number stands in an order; `u32::MAX` where it does not.
pub fn numbers<I: Copy + Into<u32>>(order: &[I], count: usize) -> Vec<u32> {
    let mut numbers = vec![u32::MAX; count];
    order.iter().zip(0..).for_each(|(&old, new)| numbers[old.into() as usize] = new);
    numbers
}

/// Keeps the items at these indices, which rise.
pub fn keep<T: Copy, I: Copy + Into<u32>>(items: &mut Vec<T>, survivors: &[I]) {
    survivors.iter().zip(0..).for_each(|(&old, new): (_, usize)| items[new] = items[old.into() as usize]);
    items.truncate(survivors.len());
}
