//! Edge collapses in the order of their cost.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use ndf_core::{Cancelled, Progress};
use ndf_mesh::Halfedge;
use ndf_mesh::halfedge::NO_HALFEDGE;
use ndf_meshing::EditableMesh;
use rayon::prelude::*;

/// A mesh whose edges can be collapsed at a cost.
pub(crate) trait Collapses: Sync {
    /// Where the merged vertex goes.
    type Place: Copy + Default + Send;

    fn mesh(&self) -> &EditableMesh;

    /// The cost of collapsing an edge, and the place at which it is least; none if it cannot be collapsed.
    fn cheapest(&self, h: Halfedge) -> Option<(f64, Self::Place)>;

    /// Collapses the edge of `h`, which is [collapsible](ndf_mesh::Topology::is_collapsible), into its tail. Returns one
    /// half-edge of each edge whose cost has changed; none, and nothing is done, if the place serves no more.
    fn collapse(&mut self, h: Halfedge, place: Self::Place) -> Option<Vec<Halfedge>>;
}

/// A collapse in the queue: its cost in an order of integers, canonical half-edge, and the state of that edge.
type Entry = Reverse<(i64, Halfedge, u32)>;

/// The queue over a mesh.
pub(crate) struct Greedy<C: Collapses> {
    /// The mesh, and what its costs follow from.
    pub(crate) state: C,
    queue: BinaryHeap<Entry>,
    /// Current state of every edge, at its canonical half-edge; entries of other states are void.
    states: Vec<u32>,
    places: Vec<C::Place>,
    pub(crate) collapses: usize,
    /// The number of collapses when all edges were last put into the queue.
    filled_at: Option<usize>,
}

/// Collapses between two looks at the observer.
const REPORT: usize = 256;

impl<C: Collapses> Greedy<C> {
    pub(crate) fn new(state: C) -> Self {
        let halfedges = state.mesh().halfedge_count();
        Self {
            state,
            queue: BinaryHeap::new(),
            states: vec![0; halfedges],
            places: vec![C::Place::default(); halfedges],
            collapses: 0,
            filled_at: None,
        }
    }

    /// Collapses edges, the cheapest first, until there are no more than so many faces or no edge can be collapsed.
    pub(crate) fn run(
        &mut self,
        faces: usize,
        stage: &str,
        progress: &dyn Progress,
    ) -> Result<(), Cancelled> {
        let before = self.state.mesh().face_count();
        while self.state.mesh().face_count() > faces {
            if self.collapses.is_multiple_of(REPORT) {
                progress.check()?;
                let done = before - self.state.mesh().face_count();
                progress.report(stage, done as f64 / (before - faces) as f64);
            }
            if !self.collapse_cheapest() {
                break;
            }
        }
        progress.report(stage, 1.0);
        Ok(())
    }

    /// Collapses the cheapest edge; false if there is none that can be.
    fn collapse_cheapest(&mut self) -> bool {
        loop {
            let Some(Reverse((_, h, state))) = self.queue.pop() else {
                // What was refused may be possible after collapses around it.
                if self.filled_at == Some(self.collapses) {
                    return false;
                }
                self.filled_at = Some(self.collapses);
                let mesh = self.state.mesh();
                let edges = mesh.halfedges().filter(|&h| !mesh.is_hole(h) && mesh.canonical(h) == h);
                let edges: Vec<Halfedge> = edges.collect();
                self.queue_all(&edges);
                continue;
            };
            let mesh = self.state.mesh();
            let is_current = !mesh.is_hole(h) && mesh.canonical(h) == h && self.states[h.index()] == state;
            if is_current && mesh.is_collapsible(h) && self.collapse(h) {
                return true;
            }
        }
    }

    /// Puts edges into the queue, with new costs.
    fn queue_all(&mut self, edges: &[Halfedge]) {
        let cheapest: Vec<Option<(f64, C::Place)>> =
            edges.par_iter().with_min_len(4).map(|&h| self.state.cheapest(h)).collect();
        for (&h, cheapest) in edges.iter().zip(cheapest) {
            self.states[h.index()] += 1;
            if let Some((cost, place)) = cheapest {
                self.places[h.index()] = place;
                self.queue.push(Reverse((ordered(cost), h, self.states[h.index()])));
            }
        }
    }

    /// Collapses an edge at the place that was found for it; false if it serves no more.
    fn collapse(&mut self, h: Halfedge) -> bool {
        let mesh = self.state.mesh();
        let gone: Vec<Halfedge> = [h, mesh.raw_twin(h)]
            .into_iter()
            .filter(|&side| side != NO_HALFEDGE)
            .flat_map(|side| side.face().halfedges())
            .collect();
        let Some(changed) = self.state.collapse(h, self.places[h.index()]) else { return false };
        gone.into_iter().for_each(|h| self.states[h.index()] += 1);
        self.collapses += 1;
        let mesh = self.state.mesh();
        let mut edges: Vec<Halfedge> = changed.into_iter().map(|h| mesh.canonical(h)).collect();
        edges.sort_unstable();
        edges.dedup();
        self.queue_all(&edges);
        true
    }
}

/// An integer that is ordered like a number.
fn ordered(x: f64) -> i64 {
    let bits = x.to_bits() as i64;
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

#[cfg(test)]
mod tests {
    use super::ordered;

    #[test]
    fn integers_are_ordered_like_numbers() {
        let numbers = [f64::NEG_INFINITY, -2.0, -1e-300, 0.0, 1e-300, 1.0, 3.5, f64::INFINITY];
        assert!(numbers.windows(2).all(|pair| ordered(pair[0]) < ordered(pair[1])));
    }
}
