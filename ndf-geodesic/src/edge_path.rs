//! A path of edges of a triangulation that keeps up with flips.

use std::collections::HashMap;

use ndf_intrinsic::{IntrinsicMesh, IntrinsicTriangulation};
use ndf_mesh::{Edge, Halfedge, NO_HALFEDGE, Vertex};

/// A step along an edge: in the direction of a half-edge, or, at a boundary that has none that way, against it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Step {
    pub(crate) halfedge: Halfedge,
    pub(crate) forward: bool,
}

impl Step {
    /// The step along a half-edge's edge from its tip to its tail.
    pub(crate) fn against(mesh: &IntrinsicMesh, halfedge: Halfedge) -> Self {
        match mesh.topology().raw_twin(halfedge) {
            NO_HALFEDGE => Self { halfedge, forward: false },
            twin => Self { halfedge: twin, forward: true },
        }
    }

    pub(crate) fn from(self, mesh: &IntrinsicMesh) -> Vertex {
        let topology = mesh.topology();
        if self.forward { topology.tail(self.halfedge) } else { topology.tip(self.halfedge) }
    }

    /// The half-edge of its edge that runs along it and has its left face, where it has one.
    pub(crate) fn left(self) -> Option<Halfedge> {
        self.forward.then_some(self.halfedge)
    }

    /// The half-edge of its edge that runs the other way and has its right face, where it has one.
    pub(crate) fn right(self, mesh: &IntrinsicMesh) -> Option<Halfedge> {
        let across = if self.forward { mesh.topology().raw_twin(self.halfedge) } else { self.halfedge };
        (across != NO_HALFEDGE).then_some(across)
    }
}

/// Number of a step of the path; steps keep theirs.
pub(crate) type Id = usize;

/// Steps one after the other, in a loop if the last is followed by the first.
#[derive(Clone, Debug)]
pub(crate) struct EdgePath {
    steps: Vec<Option<Step>>,
    before: Vec<Option<Id>>,
    after: Vec<Option<Id>>,
    /// The steps along every half-edge that has some.
    at: HashMap<Halfedge, Vec<Id>>,
    /// A step that is there, the first unless this is a loop.
    first: Option<Id>,
}

impl EdgePath {
    pub(crate) fn new(steps: &[Step], is_closed: bool) -> Self {
        let count = steps.len();
        let mut path = Self {
            steps: steps.iter().copied().map(Some).collect(),
            before: (0..count).map(|k| k.checked_sub(1)).collect(),
            after: (1..=count).map(|k| (k < count).then_some(k)).collect(),
            at: HashMap::new(),
            first: (count > 0).then_some(0),
        };
        if is_closed && count > 0 {
            (path.before[0], path.after[count - 1]) = (Some(count - 1), Some(0));
        }
        for (id, step) in steps.iter().enumerate() {
            path.at.entry(step.halfedge).or_default().push(id);
        }
        path
    }

    pub(crate) fn step(&self, id: Id) -> Option<Step> {
        self.steps[id]
    }

    pub(crate) fn before(&self, id: Id) -> Option<Id> {
        self.before[id]
    }

    pub(crate) fn after(&self, id: Id) -> Option<Id> {
        self.after[id]
    }

    /// The steps in order, from the first, or from any of a loop.
    pub(crate) fn ids(&self) -> Vec<Id> {
        let next = |id: &Id| self.after[*id].filter(|&next| Some(next) != self.first);
        std::iter::successors(self.first, next).collect()
    }

    /// Whether a step runs along an edge, either way.
    pub(crate) fn has(&self, mesh: &IntrinsicMesh, edge: Edge) -> bool {
        let h = mesh.topology().edge_halfedge(edge);
        [h, mesh.topology().raw_twin(h)].iter().any(|h| self.at.contains_key(h))
    }

    /// Puts steps in the place of two that follow each other. Returns the new ones.
    pub(crate) fn replace(&mut self, [a, b]: [Id; 2], by: &[Step]) -> Vec<Id> {
        let (mut before, mut after) = (self.before[a], self.after[b]);
        // A loop of these two alone is one of the new steps alone.
        let was_all = before == Some(b);
        if was_all {
            (before, after) = (None, None);
        }
        [a, b].into_iter().for_each(|id| self.take(id));
        let ids: Vec<Id> = (self.steps.len()..self.steps.len() + by.len()).collect();
        for (&id, &step) in ids.iter().zip(by) {
            self.steps.push(Some(step));
            self.before.push(Some(id.wrapping_sub(1)));
            self.after.push(Some(id + 1));
            self.at.entry(step.halfedge).or_default().push(id);
        }
        let ends = ids.first().copied().zip(ids.last().copied());
        match ends {
            Some((first, last)) if was_all => {
                (self.before[first], self.after[last]) = (Some(last), Some(first));
            }
            Some((first, last)) => (self.before[first], self.after[last]) = (before, after),
            None => {}
        }
        if let Some(before) = before {
            self.after[before] = ends.map_or(after, |(first, _)| Some(first));
        }
        if let Some(after) = after {
            self.before[after] = ends.map_or(before, |(_, last)| Some(last));
        }
        if self.first == Some(a) || self.first == Some(b) {
            self.first = ends.map(|(first, _)| first).or(after).or(before);
        }
        ids
    }

    fn take(&mut self, id: Id) {
        if let Some(step) = self.steps[id].take() {
            let there = self.at.get_mut(&step.halfedge).expect("every step is listed");
            there.retain(|&other| other != id);
            if there.is_empty() {
                self.at.remove(&step.halfedge);
            }
        }
    }

    /// Flips an edge that no step runs along, if its faces form a convex quad. Whether it did.
    pub(crate) fn flip(&mut self, triangulation: &mut IntrinsicTriangulation<'_>, edge: Edge) -> bool {
        let topology = triangulation.mesh().topology();
        let h = topology.edge_halfedge(edge);
        let t = topology.raw_twin(h);
        if t == NO_HALFEDGE || triangulation.flip(edge).is_err() {
            return false;
        }
        // What came after the edge in either face is now in the slot of the edge in the other.
        let moved = [(h.next(), t), (t.next(), h)].map(|(from, to)| (self.at.remove(&from), to));
        for (ids, to) in moved {
            let Some(ids) = ids else { continue };
            for &id in &ids {
                if let Some(step) = &mut self.steps[id] {
                    step.halfedge = to;
                }
            }
            self.at.insert(to, ids);
        }
        true
    }
}
