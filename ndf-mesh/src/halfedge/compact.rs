//! Closing the holes that collapses leave.

use super::{NO_HALFEDGE, NO_VERTEX, Record, Topology};

/// The elements that are left, by their old numbers.
#[derive(Clone, Debug)]
pub struct Survivors {
    /// Vertices, in order.
    pub vertices: Vec<u32>,
    /// Edges, in order.
    pub edges: Vec<u32>,
}

impl<H: Copy + Default> Record<H> {
    /// What is kept of a half-edge that is not there.
    pub(super) fn hole() -> Self {
        Self { twin: NO_HALFEDGE, tail: NO_VERTEX, edge: u32::MAX, data: H::default() }
    }
}

impl<H: Copy> Topology<H> {
    /// Whether the face of a half-edge is gone.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn is_hole(&self, halfedge: u32) -> bool {
        self.tail(halfedge) == NO_VERTEX
    }

    /// Whether a vertex is gone.
    ///
    /// # Panics
    /// If the vertex does not exist.
    #[inline]
    pub fn is_vertex_hole(&self, vertex: u32) -> bool {
        self.vertex_halfedge(vertex) == NO_HALFEDGE
    }

    /// Closes the holes that [collapses](Self::collapse) left; what remains keeps its order. In place, O(n).
    pub fn compact(&mut self) -> Survivors {
        let survivors = |halfedges: &[u32]| -> Vec<u32> {
            halfedges.iter().zip(0..).filter(|&(&h, _)| h != NO_HALFEDGE).map(|(_, k)| k).collect()
        };
        let (vertices, edges) = (survivors(&self.vertex_halfedges), survivors(&self.edge_halfedges));
        let faces: Vec<u32> = (0..self.face_count() as u32).filter(|&f| !self.is_hole(3 * f)).collect();
        let new_vertex = numbers(&vertices, self.vertex_count());
        let new_edge = numbers(&edges, self.edge_count());
        let new_face = numbers(&faces, self.face_count());
        let new_halfedge = |h: u32| if h == NO_HALFEDGE { h } else { 3 * new_face[h as usize / 3] + h % 3 };
        for (old, new) in faces.iter().flat_map(|&f| [3 * f, 3 * f + 1, 3 * f + 2]).zip(0..) {
            let Record { twin, tail, edge, data } = self.halfedges[old as usize];
            let (twin, tail, edge) = (new_halfedge(twin), new_vertex[tail as usize], new_edge[edge as usize]);
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
pub fn numbers(order: &[u32], count: usize) -> Vec<u32> {
    let mut numbers = vec![u32::MAX; count];
    order.iter().zip(0..).for_each(|(&old, new)| numbers[old as usize] = new);
    numbers
}

/// Keeps the items at these indices, which rise.
pub fn keep<T: Copy>(items: &mut Vec<T>, survivors: &[u32]) {
    survivors.iter().zip(0..).for_each(|(&old, new): (_, usize)| items[new] = items[old as usize]);
    items.truncate(survivors.len());
}
