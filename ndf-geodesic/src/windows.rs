//! Windows: intervals of edges that see one pseudo-source along straight lines.
//!
//! A window lives in the frame of the half-edge through which its rays *enter* a face: the half-edge's tail
//! is the origin, its tip lies on the positive x axis, the face above. The root of the rays, unfolded into
//! that plane, lies below. (Mitchell, Mount and Papadimitriou 1987, §3; Surazhsky et al. 2005, §3.)
//!
//! Two windows on one half-edge are *ordered*: where their unfolded face strips part, going back, one comes
//! from the left. Shortest paths do not cross, therefore a left window that is nearer at some point is nearer
//! everywhere left of it, and a right window everywhere right of it, even outside of the other's interval.
//! All trimming here rests on that.

/// An interval of a half-edge and the root of the straight lines that cross it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Window {
    /// Where the interval begins, as a length from the half-edge's tail.
    pub(crate) start: f64,
    /// Where it ends; `start < end`.
    pub(crate) end: f64,
    /// Coordinate of the root along the half-edge.
    pub(crate) x: f64,
    /// How far below the half-edge the root lies; not negative.
    pub(crate) depth: f64,
    /// Distance of the root from its source.
    pub(crate) offset: f64,
    /// What the root is: an encoded `Root`.
    pub(crate) root: u32,
}

/// What became of two windows that contested an interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Survivors {
    Both,
    Left,
    Right,
}

/// Distances that differ by less than this, relatively, tie: some thousand unfoldings round that much.
pub(crate) const TIE: f64 = 1e-13;

/// Overlaps shorter than this fraction of the coordinates around them may be round-off, where one window begins
/// where the other ends: then their lines run along each other, and their order is round-off too.
const SEAM: f64 = 1e-9;

/// Intervals shorter than this fraction of the coordinates around them are points.
const NARROW: f64 = 1e-14;

impl Window {
    /// Distance from the source to the point `x` of the half-edge.
    #[inline]
    pub(crate) fn at(&self, x: f64) -> f64 {
        let dx = x - self.x;
        self.offset + (dx * dx + self.depth * self.depth).sqrt()
    }

    /// Least distance over the interval.
    #[inline]
    pub(crate) fn nearest(&self) -> f64 {
        self.at(self.x.clamp(self.start, self.end))
    }

    /// Length from the root to the point `(x, y)` of the face.
    #[inline]
    pub(crate) fn length_to(&self, x: f64, y: f64) -> f64 {
        let (dx, dy) = (x - self.x, y + self.depth);
        (dx * dx + dy * dy).sqrt()
    }

    /// Where the line from the root to the point `(x, y)` of the face crosses the half-edge.
    #[inline]
    pub(crate) fn crossing(&self, x: f64, y: f64) -> f64 {
        let sum = y + self.depth;
        // A root and a point on the line of the half-edge: the line crosses everywhere between, so also here.
        if sum <= 0.0 { self.x } else { self.x + (x - self.x) * (self.depth / sum) }
    }

    /// Shortest distance to the point `(x, y)` of the face by a line through the interval, bent at its end
    /// where the straight line misses it, and where it crosses.
    pub(crate) fn reach(&self, x: f64, y: f64) -> (f64, f64) {
        let crossing = self.crossing(x, y);
        if crossing > self.start && crossing < self.end {
            return (self.offset + self.length_to(x, y), crossing);
        }
        let bend = crossing.clamp(self.start, self.end);
        (self.at(bend) + ((x - bend) * (x - bend) + y * y).sqrt(), bend)
    }

    /// Whether the interval has shrunk to a point.
    #[inline]
    pub(crate) fn is_narrow(&self) -> bool {
        self.end - self.start <= NARROW * self.end
    }
}

/// The `x` between `low` and `high` where both windows are equally far, given that `left` is nearer by
/// `-at_low` at `low` and farther by `at_high` at `high`.
///
/// `a + |x − p| = b + |x − q|` squared twice is a quadratic in `x`; of its roots one lies in the bracket up
/// to round-off, and where round-off is all there is, linear interpolation stands in.
fn bisector(left: &Window, right: &Window, low: f64, high: f64, at_low: f64, at_high: f64) -> f64 {
    let interpolated = || low + (high - low) * (at_low / (at_low - at_high));
    // Coordinates around the right window's root.
    let e = left.x - right.x;
    let difference = right.offset - left.offset;
    // With r the distance from the right root: 2 difference r = alpha x + beta.
    let alpha = -2.0 * e;
    let depth2 = right.depth * right.depth;
    let beta = e * e + (left.depth - right.depth) * (left.depth + right.depth) - difference * difference;
    let inside = |x: f64| x >= low && x <= high;
    if difference == 0.0 {
        let x = right.x - beta / alpha;
        return if inside(x) { x } else { interpolated() };
    }
    let four = 4.0 * difference * difference;
    let a = alpha * alpha - four;
    let half_b = alpha * beta;
    let c = beta * beta - four * depth2;
    let discriminant = (half_b * half_b - a * c).max(0.0).sqrt();
    // The stable pair of roots.
    let q = -(half_b + discriminant.copysign(half_b));
    let (first, second) = (right.x + q / a, right.x + c / q);
    match (inside(first), inside(second)) {
        (true, false) => first,
        (false, true) => second,
        (true, true) => {
            let error = |x: f64| (left.at(x) - right.at(x)).abs();
            if error(first) <= error(second) { first } else { second }
        }
        (false, false) => interpolated(),
    }
}

/// Divides the overlap of two windows, `left` before `right` in the order of windows, between them.
///
/// The intervals must overlap. Afterwards they do not, but where they see the same root the order says
/// nothing and either may come first.
#[inline]
pub(crate) fn divide(left: &mut Window, right: &mut Window) -> Survivors {
    let low = left.start.max(right.start);
    let high = left.end.min(right.end);
    let left_at_high = left.at(high);
    let tie = TIE * left_at_high;
    let at_high = left_at_high - right.at(high);
    if high - low <= SEAM * high && (left.start < right.start) == (left.end < right.end) {
        part(left, right, at_high <= 0.0);
        return survivors(left, right);
    }
    if at_high < -tie {
        right.start = high;
        return survivors(left, right);
    }
    let at_low = left.at(low) - right.at(low);
    if at_high > tie {
        if at_low >= -tie {
            left.end = low;
        } else {
            let x = bisector(left, right, low, high, at_low, at_high);
            left.end = x;
            right.start = x;
        }
    } else if at_low < -tie {
        right.start = high;
    } else if at_low > tie {
        // A tie at `high` and right nearer elsewhere: round-off has confused the order.
        left.start = high;
    } else {
        unite(left, right);
    }
    survivors(left, right)
}

/// Gives the overlap of two windows, one of which begins and ends before the other, to the nearer.
fn part(left: &mut Window, right: &mut Window, left_is_nearer: bool) {
    let left_is_first = left.start < right.start;
    let (first, second) = if left_is_first { (left, right) } else { (right, left) };
    if left_is_first == left_is_nearer {
        second.start = first.end;
    } else {
        first.end = second.start;
    }
}

/// Divides the overlap of two windows whose order is unknown: only if they see the same root.
pub(crate) fn divide_unordered(a: &mut Window, b: &mut Window) -> Survivors {
    let low = a.start.max(b.start);
    let high = a.end.min(b.end);
    let tie = |x: f64| {
        let at = a.at(x);
        (at - b.at(x)).abs() <= TIE * at
    };
    if tie(low) && tie(high) {
        unite(a, b);
    }
    survivors(a, b)
}

/// Makes two windows that are equally far on their overlap disjoint, with the same union.
fn unite(a: &mut Window, b: &mut Window) {
    let (first, second) = if a.start <= b.start { (a, b) } else { (b, a) };
    second.start = first.end.min(second.end);
}

#[inline]
fn survivors(left: &Window, right: &Window) -> Survivors {
    match (left.is_narrow(), right.is_narrow()) {
        (true, _) => Survivors::Right,
        (_, true) => Survivors::Left,
        _ => Survivors::Both,
    }
}

/// Which of two windows survives whose rays all cross before they reach the half-edge: `left` comes first in
/// the order of windows, yet its interval lies beyond that of `right`.
pub(crate) fn crossed(left: &Window, right: &Window) -> Survivors {
    // The rays that meet last: from left to its start, from right to its end.
    let (ax, ay) = (left.start - left.x, left.depth);
    let (bx, by) = (right.end - right.x, right.depth);
    let cross = ax * by - ay * bx;
    if cross <= 0.0 {
        return Survivors::Both;
    }
    // How much of the left ray, from its end back, lies beyond the crossing.
    let back = (left.start - right.end) * by / cross;
    let (px, py) = (left.start - back * ax, -back * ay);
    if !(0.0..=1.0).contains(&back) || py < -right.depth {
        return Survivors::Both;
    }
    let from_left = left.offset + left.length_to(px, py);
    let from_right = right.offset + right.length_to(px, py);
    if from_left < from_right * (1.0 - TIE) {
        Survivors::Left
    } else if from_right < from_left * (1.0 - TIE) {
        Survivors::Right
    } else {
        Survivors::Both
    }
}

/// Crossings of two lines through one point count as none below this sine of their angle, roughly: some
/// thousand unfoldings turn a line that much.
const COLLINEAR: f64 = 1e-12;

/// Which of two windows comes first in the order of windows, seen from a point `x` of both intervals: the one
/// whose line arrives from further left. `None` where the lines coincide.
#[inline]
pub(crate) fn comes_from_left(a: &Window, b: &Window, x: f64) -> Option<bool> {
    let (from_a, from_b) = ((x - a.x) * b.depth, (x - b.x) * a.depth);
    ((from_a - from_b).abs() > COLLINEAR * (from_a.abs() + from_b.abs())).then_some(from_a > from_b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seen from a root one unit below the half-edge.
    fn window(start: f64, end: f64, x: f64, offset: f64) -> Window {
        Window { start, end, x, depth: 1.0, offset, root: 0 }
    }

    #[test]
    fn windows_that_start_where_they_end_lose() {
        // Nearer on all of the overlap, the left one leaves a point of the right one, and the other way round.
        let (mut left, mut right) = (window(0.0, 2.0, 1.0, 0.0), window(1.0, 2.0, 1.5, 3.0));
        assert_eq!(divide(&mut left, &mut right), Survivors::Left);
        assert_eq!(right.start, right.end);
        let (mut left, mut right) = (window(0.0, 1.0, 0.5, 3.0), window(0.0, 2.0, 1.0, 0.0));
        assert_eq!(divide(&mut left, &mut right), Survivors::Right);
        assert_eq!(left.start, left.end);
        // Equal distances: one window, and not both.
        let (mut left, mut right) = (window(0.0, 1.0, 0.5, 0.0), window(0.0, 1.0, 0.5, 0.0));
        assert_ne!(divide(&mut left, &mut right), Survivors::Both);
        assert!(window(1.0, 1.0, 0.5, 0.0).is_narrow() && !window(1.0, 1.1, 0.5, 0.0).is_narrow());
    }

    /// Neighbours that overlap by round-off are parted where they meet, whichever of them the order of their lines,
    /// round-off too, calls the left one.
    #[test]
    fn windows_that_meet_stay() {
        let depth = 2e-4;
        let near = Window { start: 0.0, end: 1e-4 + 1e-16, x: -1e-4, depth, offset: 0.0, root: 65 };
        let far = Window { start: 1e-4, end: 3.0, x: -1e-4 - 4e-16, depth, offset: 0.0, root: 65 };
        for (mut left, mut right) in [(near, far), (far, near)] {
            assert_eq!(divide(&mut left, &mut right), Survivors::Both);
            let (near, far) = if left.start == 0.0 { (left, right) } else { (right, left) };
            assert_eq!((near.start, near.end, far.end), (0.0, far.start, 3.0));
        }
    }

    #[test]
    fn windows_are_divided_where_they_tie() {
        let (mut left, mut right) = (window(0.0, 4.0, 1.0, 0.0), window(0.0, 4.0, 3.0, 0.0));
        assert_eq!(divide(&mut left, &mut right), Survivors::Both);
        assert_eq!((left.start, left.end, right.start, right.end), (0.0, 2.0, 2.0, 4.0));
        let (mut left, mut right) = (window(0.0, 4.0, 1.0, 0.5), window(0.0, 4.0, 3.0, 0.0));
        assert_eq!(divide(&mut left, &mut right), Survivors::Both);
        assert_eq!(left.end, right.start);
        assert!((left.at(left.end) - right.at(left.end)).abs() < 1e-14);
    }
}
