//! Edge collapses in a simplicial complex. They leave holes in the numbering, which [`compact`] closes once all are
//! done: so elements keep their order, which is one of space, and what is near in it stays near in memory.
//!
//! [`compact`]: DeltaComplex::compact

use crate::delta_complex::{DeltaComplex, HalfEdge, NO_HALFEDGE};

/// The elements that are left, by their old numbers.
pub(crate) struct Survivors {
    pub(crate) vertices: Vec<u32>,
    pub(crate) edges: Vec<u32>,
}

impl DeltaComplex {
    /// Whether the edge of `h`, i → j, can be collapsed into i without changing the surface's topology: it has
    /// two faces, j is inside, and the two ends have no other neighbours in common than the two opposite corners
    /// (the link condition). The complex must be simplicial. O(degree²).
    pub(crate) fn can_collapse(&self, h: u32) -> bool {
        let (i, j) = (self.tail(h), self.tip(h));
        let Some(t) = self.twin(h) else { return false };
        if self.is_boundary_vertex(j) {
            return false;
        }
        let mut ring = Vec::with_capacity(16);
        for out in self.outgoing(i) {
            ring.extend([self.tip(out), self.tail(self.previous(out))]);
        }
        let common = self.outgoing(j).filter(|&out| ring.contains(&self.tip(out))).count();
        let degree_three = |corner: u32| {
            let v = self.tail(corner);
            !self.is_boundary_vertex(v) && self.outgoing(v).take(4).count() == 3
        };
        let apexes = [self.previous(h), self.previous(t)];
        // An apex in a single face besides the two would be left with a face that is a flap.
        let bare = |corner: u32| self.outgoing(self.tail(corner)).take(2).count() == 1;
        common == 2 && !apexes.into_iter().any(degree_three) && !apexes.into_iter().any(bare)
    }

    /// Whether an edge joins two vertices. O(degree).
    pub(crate) fn joins(&self, a: u32, b: u32) -> bool {
        self.outgoing(a).any(|h| self.tip(h) == b || self.tail(self.previous(h)) == b)
    }

    /// Collapses the edge of `h`, i → j, into i. The caller [asked](Self::can_collapse). Two faces, j and the
    /// three returned edges are holes then: nothing leads there, and nobody may ask about them.
    pub(crate) fn collapse(&mut self, h: u32) -> [u32; 3] {
        let t = self.halfedges[h as usize].twin;
        let (i, j) = (self.tail(h), self.tip(h));
        let mut around = self.vertex_halfedge(j);
        let start = around;
        loop {
            self.halfedges[around as usize].tail = i;
            around = self.halfedges[self.previous(around) as usize].twin;
            if around == start {
                break;
            }
        }
        let gone = [h / 3, t / 3];
        let mut edges = [self.halfedge_edge(h), 0, 0];
        for (slot, h) in [h, t].into_iter().enumerate() {
            // The sides besides the collapsed one become one edge, that of the side at i.
            let (at_i, at_j) =
                if slot == 0 { (self.previous(h), self.next(h)) } else { (self.next(h), self.previous(h)) };
            let (keep, drop) = (self.halfedge_edge(at_i), self.halfedge_edge(at_j));
            let outer = [at_i, at_j].map(|h| self.halfedges[h as usize].twin);
            edges[1 + slot] = drop;
            for (side, &o) in outer.iter().enumerate() {
                if o != NO_HALFEDGE {
                    self.halfedges[o as usize].twin = outer[1 - side];
                    self.halfedges[o as usize].edge = keep;
                    self.edge_halfedges[keep as usize] = o;
                }
            }
            // The apex and i get an outgoing half-edge that stays; the boundary's first ones do.
            for &o in &outer {
                if o == NO_HALFEDGE {
                    continue;
                }
                for out in [o, self.next(o)] {
                    let v = self.tail(out) as usize;
                    let current = self.vertex_halfedges[v];
                    let goes =
                        gone.contains(&(current / 3)) || self.halfedges[current as usize].tail != v as u32;
                    if goes || self.halfedges[out as usize].twin == NO_HALFEDGE {
                        self.vertex_halfedges[v] = out;
                    }
                }
            }
        }
        let hole = HalfEdge { twin: NO_HALFEDGE, tail: u32::MAX, edge: u32::MAX, roundabout: 0 };
        gone.iter().for_each(|&f| self.halfedges[3 * f as usize..][..3].fill(hole));
        edges.iter().for_each(|&e| self.edge_halfedges[e as usize] = NO_HALFEDGE);
        self.vertex_halfedges[j as usize] = NO_HALFEDGE;
        edges
    }

    /// Closes the holes that collapses left; what remains keeps its order. In place, O(n).
    pub(crate) fn compact(&mut self) -> Survivors {
        let survivors = |halfedges: &[u32]| -> Vec<u32> {
            halfedges.iter().zip(0..).filter(|&(&h, _)| h != NO_HALFEDGE).map(|(_, k)| k).collect()
        };
        let (vertices, edges) = (survivors(&self.vertex_halfedges), survivors(&self.edge_halfedges));
        let faces: Vec<u32> =
            (0..self.face_count() as u32).filter(|&f| self.tail(3 * f) != u32::MAX).collect();
        let new_vertex = numbers(&vertices, self.vertex_count());
        let new_edge = numbers(&edges, self.edge_count());
        let new_face = numbers(&faces, self.face_count());
        let new_halfedge = |h: u32| if h == NO_HALFEDGE { h } else { 3 * new_face[h as usize / 3] + h % 3 };
        for (old, new) in faces.iter().flat_map(|&f| [3 * f, 3 * f + 1, 3 * f + 2]).zip(0..) {
            let HalfEdge { twin, tail, edge, roundabout } = self.halfedges[old as usize];
            let (twin, tail, edge) = (new_halfedge(twin), new_vertex[tail as usize], new_edge[edge as usize]);
            self.halfedges[new] = HalfEdge { twin, tail, edge, roundabout };
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
pub(crate) fn numbers(order: &[u32], count: usize) -> Vec<u32> {
    let mut numbers = vec![u32::MAX; count];
    order.iter().zip(0..).for_each(|(&old, new)| numbers[old as usize] = new);
    numbers
}

/// Keeps the items at these indices, which rise.
pub(crate) fn keep<T: Copy>(items: &mut Vec<T>, survivors: &[u32]) {
    survivors.iter().zip(0..).for_each(|(&old, new): (_, usize)| items[new] = items[old as usize]);
    items.truncate(survivors.len());
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
    fn random_collapses_keep_a_complex_simplicial() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for mesh in [shapes::icosphere(3), shapes::torus(20, 12, 1.0, 0.4), shapes::grid(12, 9)] {
            let mut complex = DeltaComplex::of_mesh(&ManifoldMesh::try_from(mesh).unwrap());
            let (euler, edges) = (complex.euler_characteristic(), complex.edge_count());
            for _ in 0..400 {
                for _ in 0..10 {
                    let e = rng.random_range(0..complex.edge_count() as u32);
                    let h = complex.edge_halfedge(e);
                    if h != NO_HALFEDGE && complex.can_collapse(h) {
                        complex.collapse(h);
                    }
                }
                let survivors = complex.compact();
                assert_eq!(survivors.vertices.len(), complex.vertex_count());
                assert_eq!(survivors.edges.len(), complex.edge_count());
                complex.check().unwrap();
                assert!(complex.is_simplicial());
                assert_eq!(complex.euler_characteristic(), euler);
            }
            assert!(complex.edge_count() < edges / 2);
        }
    }
}
