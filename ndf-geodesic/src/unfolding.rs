//! A face laid out in the plane of the half-edge through which windows enter it, and windows carried across
//! it.
//!
//! # The distance of the apex
//! A shortest path to the apex runs straight from a root through a point of its window, and that point may be an
//! end: the last ray of a window that vertices bound meets the apex exactly wherever straight lines join
//! vertices, as on lattices. Another window may contain its own line to the apex and be longer, or shorter. So
//! *every* window whose line to the apex passes its interval, ends included, offers the apex its distance,
//! whatever the others offer. Ends are rounded: windows that the line misses by a hair are asked too, for the
//! line that bends at the end. It is a path on the surface like all others, and asking too many does no harm.
//!
//! # One angle, two sides
//! Of two windows in a list, let the later be no nearer at the apex than the earlier. Its lines to the left
//! side cross the earlier one's path to the apex. Where they do, they are no shorter than that path, or they
//! would lead to the apex on a shorter way: the later window does not reach the left side. (Chen and Han 1990;
//! for whole lists Qin et al. 2016.)

use ndf_intrinsic::{IntrinsicMesh, triangle};

use crate::envelope::push_ordered;
use crate::windows::Window;
use ndf_mesh::{Face, Halfedge};
use rayon::prelude::*;

/// A face above the x axis: tail of the entered half-edge at the origin, tip at `(length, 0)`.
///
/// The *left* side joins tail and apex, the *right* side apex and tip.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    pub(crate) length: f64,
    pub(crate) apex: [f64; 2],
    left_length: f64,
    right_length: f64,
    /// Unit vector from tail to apex.
    left: [f64; 2],
    /// Unit vector from tip to apex, mirrored in x.
    right: [f64; 2],
}

/// Sides and area of every face, side by side: what laying out takes, without its square root.
pub(crate) struct Shapes(Vec<([f64; 3], f64)>);

impl Shapes {
    pub(crate) fn of(mesh: &IntrinsicMesh) -> Self {
        let shape = |f| {
            let sides = mesh.sides(f);
            (sides, triangle::area(sides))
        };
        Self((0..mesh.face_count()).into_par_iter().map(|f| shape(Face::new(f))).collect())
    }

    /// The face of a half-edge, laid out above it.
    #[inline]
    pub(crate) fn layout(&self, halfedge: Halfedge) -> Layout {
        let (sides, area) = self.0[halfedge.face().index()];
        let [a, b, c] = sides;
        let sides = match halfedge.corner() {
            0 => [a, b, c],
            1 => [b, c, a],
            _ => [c, a, b],
        };
        Layout::new(sides, area)
    }

    /// Length of a half-edge.
    #[inline]
    pub(crate) fn length(&self, halfedge: Halfedge) -> f64 {
        self.0[halfedge.face().index()].0[halfedge.corner()]
    }

    /// Cosine and sine of the angle at the tail of a half-edge in its face, times one number.
    #[inline]
    pub(crate) fn corner(&self, halfedge: Halfedge) -> [f64; 2] {
        let (sides, area) = self.0[halfedge.face().index()];
        let c = halfedge.corner();
        let (ahead, behind, opposite) = (sides[c], sides[(c + 2) % 3], sides[(c + 1) % 3]);
        let (longer, shorter) = if ahead > behind { (ahead, behind) } else { (behind, ahead) };
        [shorter * shorter + (longer - opposite) * (longer + opposite), 4.0 * area]
    }
}

fn unit([x, y]: [f64; 2]) -> [f64; 2] {
    let length = (x * x + y * y).sqrt();
    // A side without length: no window crosses it, any direction will do.
    if length > 0.0 { [x / length, y / length] } else { [0.0, 1.0] }
}

/// Lines that miss a window by less than this fraction of the half-edge may owe it to round-off.
const HAIR: f64 = 1e-3;

/// Where the windows of a list arrive at the apex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ApexArrival {
    /// Distance of the apex.
    pub(crate) distance: f64,
    /// Where the path crosses the entered half-edge.
    pub(crate) crossing: f64,
    /// Where the path's last line begins, an encoded `Root`.
    pub(crate) root: u32,
}

impl Layout {
    /// Lays out a triangle by its sides, beginning with the one on the x axis, counter-clockwise, and its
    /// area.
    #[inline]
    fn new(sides: [f64; 3], area: f64) -> Self {
        let [length, right_length, left_length] = sides;
        let (sum, difference) = (left_length + right_length, left_length - right_length);
        let apex = if length == 0.0 {
            [0.0, left_length]
        } else {
            [0.5 * (length + difference * (sum / length)), 2.0 * area / length]
        };
        Self {
            length,
            apex,
            left_length,
            right_length,
            left: unit(apex),
            right: unit([length - apex[0], apex[1]]),
        }
    }

    /// The face of a half-edge, laid out above it.
    pub(crate) fn of(mesh: &IntrinsicMesh, halfedge: Halfedge) -> Self {
        let sides = mesh.sides_from(halfedge);
        Self::new(sides, triangle::area(sides))
    }

    /// The part of a window that crosses the left side, in the frame of the half-edge that enters the next
    /// face there: from tail to apex. `crossing` is where the line from the root to the apex crosses the x
    /// axis.
    #[inline]
    pub(crate) fn left_part(&self, w: &Window, crossing: f64) -> Option<Window> {
        across(self.left, self.left_length, w.x, w.depth, w.start, w.end, crossing)
            .map(|(start, end, x, depth)| Window { start, end, x, depth, ..*w })
    }

    /// The part of a window that crosses the right side, in the frame of the half-edge from apex to tip.
    #[inline]
    pub(crate) fn right_part(&self, w: &Window, crossing: f64) -> Option<Window> {
        let l = self.length;
        across(self.right, self.right_length, l - w.x, w.depth, l - w.end, l - w.start, l - crossing).map(
            |(start, end, x, depth)| {
                let l = self.right_length;
                Window { start: l - end, end: l - start, x: l - x, depth, ..*w }
            },
        )
    }

    /// The tip as seen from the left side's frame: a root of offset `distance`.
    pub(crate) fn tip_from_left(&self, distance: f64) -> Window {
        let [ux, uy] = self.left;
        let (x, depth) = (self.length * ux, self.length * uy);
        Window { start: 0.0, end: self.left_length, x, depth, offset: distance, root: 0 }
    }

    /// The tail as seen from the right side's frame: a root of offset `distance`.
    pub(crate) fn tail_from_right(&self, distance: f64) -> Window {
        let [ux, uy] = self.right;
        let (x, depth) = (self.right_length - self.length * ux, self.length * uy);
        Window { start: 0.0, end: self.right_length, x, depth, offset: distance, root: 0 }
    }

    /// Carries a list of windows across the face, onto its left and right side, each trimmed to the nearest
    /// windows. Returns the shortest way to the apex through the list. See the [module](self).
    pub(crate) fn propagate(
        &self,
        list: &[Window],
        left: &mut Vec<Window>,
        right: &mut Vec<Window>,
    ) -> Option<ApexArrival> {
        let [apex_x, apex_y] = self.apex;
        let hair = HAIR * self.length;
        let mut best: Option<ApexArrival> = None;
        let mut offer = |w: &Window| {
            let (distance, crossing) = w.reach(apex_x, apex_y);
            let is_nearest = best.is_none_or(|b| distance < b.distance);
            if is_nearest {
                best = Some(ApexArrival { distance, crossing, root: w.root });
            }
            is_nearest
        };
        // The windows on both sides of the line to the apex, for where round-off leaves a gap between them.
        let (mut is_reached, mut before, mut after) = (false, None, None);
        for w in list {
            let line = w.crossing(apex_x, apex_y);
            let (mut goes_left, goes_right) = (line > w.start, line < w.end);
            if line > w.start - hair && line < w.end + hair {
                goes_left &= offer(w);
                is_reached = true;
            } else if goes_left {
                before = Some(w);
            } else if after.is_none() {
                after = Some(w);
            }
            if goes_left && let Some(part) = self.left_part(w, line) {
                push_ordered(left, 0, part);
            }
            if goes_right && let Some(part) = self.right_part(w, line) {
                push_ordered(right, 0, part);
            }
        }
        if !is_reached {
            for w in [before, after].into_iter().flatten() {
                offer(w);
            }
        }
        best
    }
}

/// The part of an interval `start … end` seen from `(x, −depth)` whose lines cross the ray from the origin
/// along the unit vector `u` before `length`: the interval on that ray, and the root in its frame. Lines up
/// to `crossing` do.
#[inline]
fn across(
    u: [f64; 2],
    length: f64,
    x: f64,
    depth: f64,
    start: f64,
    end: f64,
    crossing: f64,
) -> Option<(f64, f64, f64, f64)> {
    if start >= crossing {
        return None;
    }
    let new_depth = u[0] * depth + u[1] * x;
    let at = |s: f64| depth * s / (new_depth - u[1] * s);
    let new_start = if start > 0.0 { at(start).max(0.0) } else { 0.0 };
    let new_end = if end >= crossing { length } else { at(end).min(length) };
    // Also refuses NaN, which lines along the x axis can bring.
    (new_end - new_start > 1e-14 * new_end && new_depth >= 0.0)
        .then(|| (new_start, new_end, u[0] * x - u[1] * depth, new_depth))
}
