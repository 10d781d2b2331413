//! What the wavefront has yet to do, nearest first.

use ndf_mesh::{Halfedge, Vertex};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A task of the wavefront.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Task {
    /// Carry the windows waiting at a half-edge across its face.
    Edge(Halfedge),
    /// Relax the edges of a vertex and, where it bends paths, make it a pseudo-source.
    Vertex(Vertex),
}

/// A priority queue of tasks by distance; equal distances in the order of numbers, so that runs repeat.
#[derive(Default)]
pub(crate) struct Front {
    heap: BinaryHeap<Reverse<(u64, u64)>>,
}

impl Front {
    pub(crate) fn push(&mut self, distance: f64, task: Task) {
        debug_assert!(distance >= 0.0, "bits order only numbers that are not negative");
        let code = match task {
            Task::Vertex(v) => u64::from(v.0) << 1,
            Task::Edge(h) => u64::from(h.0) << 1 | 1,
        };
        self.heap.push(Reverse((distance.to_bits(), code)));
    }

    pub(crate) fn len(&self) -> usize {
        self.heap.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.heap.is_empty()
    }

    pub(crate) fn pop(&mut self) -> Option<(f64, Task)> {
        self.heap.pop().map(|Reverse((bits, code))| {
            let index = (code >> 1) as u32;
            let task = if code & 1 == 1 { Task::Edge(Halfedge(index)) } else { Task::Vertex(Vertex(index)) };
            (f64::from_bits(bits), task)
        })
    }
}
