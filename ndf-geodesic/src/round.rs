//! Rounds of the wavefront: the half-edges nearest to the sources, crossed side by side.
//!
//! Windows of one half-edge enter a face and leave it through the other two. What waits beyond these comes from this face
//! alone, so the crossings of different faces touch different lists. Which of them run at once decides nothing: a round sees
//! the distances that were known when it began.

use std::ops::Range;

use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::Halfedge;
use rayon::prelude::*;

use crate::envelope::{cut_by_left_rival, cut_by_right_rival, cut_by_tail, cut_by_tip};
use crate::pending::Waiting;
use crate::unfolding::{ApexArrival, Shapes};
use crate::windows::{TIE, Window};

/// Fewer crossings than this are not worth handing over to another thread.
const PART: usize = 8;
/// The most parts of a round, for each thread: crossings take unequal times.
const PARTS: usize = 6;

/// What every crossing of a round sees.
pub(crate) struct Before<'a> {
    pub(crate) mesh: &'a IntrinsicMesh,
    pub(crate) shapes: &'a Shapes,
    pub(crate) distances: &'a [f64],
    pub(crate) bound: f64,
}

/// The windows of a half-edge on their way across its face.
pub(crate) struct Crossing {
    pub(crate) halfedge: Halfedge,
    /// The windows.
    pub(crate) entering: Waiting,
    /// Those of them that were worth carrying.
    pub(crate) carried: Range<usize>,
    /// The shortest way to the apex through them.
    pub(crate) arrival: Option<ApexArrival>,
    /// The left side and the right one, where there are faces beyond.
    pub(crate) exits: [Option<Exit>; 2],
}

/// A side through which windows leave a face.
pub(crate) struct Exit {
    /// The half-edge by which they enter the next face.
    pub(crate) entered: Halfedge,
    /// What waits there, lent to this crossing.
    pub(crate) waiting: Option<Waiting>,
}

/// Buffers of a thread.
#[derive(Default)]
struct Scratch {
    left: Vec<Window>,
    right: Vec<Window>,
    merged: Vec<Window>,
}

/// Crosses the half-edges of a round.
#[derive(Default)]
pub(crate) struct Carrier {
    scratch: Vec<Scratch>,
}

impl Carrier {
    /// Carries the windows of all crossings, on the threads of the current pool.
    pub(crate) fn carry(&mut self, before: &Before<'_>, crossings: &mut [Crossing]) {
        let parts = (crossings.len() / PART).clamp(1, PARTS * rayon::current_num_threads());
        self.scratch.resize_with(parts.max(self.scratch.len()), Scratch::default);
        if parts == 1 || rayon::current_num_threads() == 1 {
            crossings.iter_mut().for_each(|crossing| crossing.carry(before, &mut self.scratch[0]));
            return;
        }
        let size = crossings.len().div_ceil(parts);
        crossings.par_chunks_mut(size).zip(&mut self.scratch).for_each(|(part, scratch)| {
            part.iter_mut().for_each(|crossing| crossing.carry(before, scratch));
        });
    }
}

impl Crossing {
    pub(crate) fn new(mesh: &IntrinsicMesh, halfedge: Halfedge, entering: Waiting) -> Self {
        let exits = [halfedge.previous(), halfedge.next()]
            .map(|side| mesh.twin(side).map(|entered| Exit { entered, waiting: None }));
        Self { halfedge, entering, carried: 0..0, arrival: None, exits }
    }

    /// Carries the windows across the face.
    fn carry(&mut self, before: &Before<'_>, scratch: &mut Scratch) {
        let Before { mesh, shapes, distances, bound } = *before;
        let halfedge = self.halfedge;
        let (next, previous) = (halfedge.next(), halfedge.previous());
        let [at_tail, at_tip, at_apex] = [halfedge, next, previous].map(|h| distances[mesh.tail(h).index()]);
        let layout = shapes.layout(halfedge);
        let list = &mut self.entering.windows;
        let gone = cut_by_tail(list, at_tail);
        let kept = cut_by_tip(&mut list[gone..], layout.length, at_tip);
        self.carried = gone..gone + kept;
        let Scratch { left, right, merged } = scratch;
        left.clear();
        right.clear();
        self.arrival = layout.propagate(&list[self.carried.clone()], left, right);
        let at_apex = match &self.arrival {
            Some(arrival) if is_improved(at_apex, arrival.distance, bound) => arrival.distance,
            _ => at_apex,
        };
        let [left_exit, right_exit] =
            self.exits.each_mut().map(|exit| exit.as_mut().and_then(|e| e.waiting.as_mut()));
        if let Some(waiting) = left_exit {
            let kept = cut_by_right_rival(left, &layout.tip_from_left(at_tip));
            let kept = cut_by_tip(&mut left[..kept], shapes.length(previous), at_apex);
            let gone = cut_by_tail(&mut left[..kept], at_tail);
            waiting.add(within(&left[gone..kept], bound), merged);
        }
        if let Some(waiting) = right_exit {
            let gone = cut_by_left_rival(right, &layout.tail_from_right(at_tail));
            let gone = gone + cut_by_tail(&mut right[gone..], at_apex);
            let kept = cut_by_tip(&mut right[gone..], shapes.length(next), at_tip);
            waiting.add(within(&right[gone..gone + kept], bound), merged);
        }
    }
}

/// Whether a distance is less than the one before and within the bound. What round-off gains would only send the same windows
/// out again.
pub(crate) fn is_improved(before: f64, distance: f64, bound: f64) -> bool {
    distance < before * (1.0 - TIE) && distance <= bound
}

/// Windows without those at both ends that lie beyond the bound.
pub(crate) fn within(mut windows: &[Window], bound: f64) -> &[Window] {
    if bound < f64::INFINITY {
        while let [first, rest @ ..] = windows
            && first.nearest() > bound
        {
            windows = rest;
        }
        while let [rest @ .., last] = windows
            && last.nearest() > bound
        {
            windows = rest;
        }
    }
    windows
}
