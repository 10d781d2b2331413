//! Where a line crosses the level: first a bracket, then the crossing in it.

use ndf_core::{DVec3, ImplicitField};

use super::LevelSearch;
use super::side::{Side, is_inside};

/// How much farther than where a tangent meets the level the next look is, so that it lies behind the level.
const OVERSHOOT: f64 = 1.1;
/// How much a step may exceed the last one.
const GROWTH: f64 = 2.0;
/// The first step, in longest steps.
const FIRST: f64 = 1.0 / 16.0;
/// Looks into a bracket before the crossing is polished with gradients.
const LOOKS: u32 = 4;
/// Looks into a bracket where the polish does not lead to the level: enough for bisection down to rounding.
const LAST_LOOKS: u32 = 100;
/// A crossing is known when the height there is this small, relative to that of the ends of the bracket.
const SMALL: f64 = 1e-3;

/// A point on a line: its parameter, a length, and the height of the field there.
type Place = (f64, f64);

/// A line on its way to the level.
#[derive(Clone, Debug)]
pub(super) struct Line {
    origin: DVec3,
    /// Unit vector. The search goes along it from a point inside, against it from one outside.
    direction: DVec3,
    /// The place looked at last and the step that led there.
    at: Place,
    step: f64,
    /// Where the next look is, at the least and by the slope.
    guess: f64,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    /// No crossing yet.
    Searching,
    /// A crossing lies between a place inside and one outside.
    Bracketed { inner: Place, outer: Place },
    /// Nothing within reach.
    Missed,
}

impl Line {
    /// A line through a point of height `height`, where the field has the given gradient.
    pub(super) fn new(
        origin: DVec3,
        direction: DVec3,
        height: f64,
        gradient: DVec3,
        options: &LevelSearch,
    ) -> Self {
        // From an inner point outward, where heights rise along the direction; from an outer one the reverse.
        let slope = gradient.dot(direction);
        let guess = if slope > 0.0 { height.abs() / slope } else { f64::INFINITY };
        Self {
            origin,
            direction,
            at: (0.0, height),
            step: FIRST * options.step,
            guess,
            state: State::Searching,
        }
    }

    pub(super) fn is_bracketed(&self) -> bool {
        matches!(self.state, State::Bracketed { .. })
    }

    pub(super) fn origin(&self) -> DVec3 {
        self.origin
    }

    pub(super) fn direction(&self) -> DVec3 {
        self.direction
    }

    fn place(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }

    /// The best estimate of the crossing of a bracketed line.
    pub(super) fn crossing(&self) -> DVec3 {
        match self.state {
            State::Bracketed { inner, outer } => {
                self.place(inner.0 + chord_share(inner.1, outer.1) * (outer.0 - inner.0))
            }
            _ => self.origin,
        }
    }

    /// Distance from the origin to the crossing.
    pub(super) fn length(&self) -> f64 {
        self.crossing().distance(self.origin)
    }

    /// The parameter of the next look while searching.
    fn next(&self, lipschitz: Option<f64>, options: &LevelSearch) -> f64 {
        let (t, height) = self.at;
        let forward = if is_inside(height) { 1.0 } else { -1.0 };
        let guess = OVERSHOOT * self.guess + 4.0 * options.tolerance;
        let step = guess.clamp(self.step.min(options.step), options.step);
        // Nothing is crossed within what the bound forbids.
        let free = lipschitz.map_or(0.0, |bound| height.abs() / bound);
        t + forward * step.max(if free.is_finite() { free + options.tolerance } else { 0.0 })
    }

    /// Takes in the height at the next look.
    fn advance(&mut self, t: f64, height: f64, options: &LevelSearch) {
        let last = std::mem::replace(&mut self.at, (t, height));
        if is_inside(last.1) != is_inside(height) {
            let (inner, outer) = if is_inside(height) { (self.at, last) } else { (last, self.at) };
            self.state = State::Bracketed { inner, outer };
            return;
        }
        if t.abs() >= options.reach {
            self.state = State::Missed;
            return;
        }
        self.step = GROWTH * (t - last.0).abs();
        let descent = (last.1.abs() - height.abs()) / (t - last.0).abs();
        self.guess = if descent > 0.0 { height.abs() / descent } else { f64::INFINITY };
    }
}

/// Where, between an inner and an outer place, their chord crosses zero; the middle where a height is not finite.
fn chord_share(inner: f64, outer: f64) -> f64 {
    let share = inner / (inner - outer);
    if share.is_finite() && outer.is_finite() { share } else { 0.5 }
}

/// Brackets the crossings of all lines and narrows the brackets; lines without a crossing in reach are left without.
pub(super) fn search<F: ImplicitField>(
    side: &Side<'_, F>,
    lines: &mut [Option<Line>],
    options: &LevelSearch,
) {
    let lipschitz = side.lipschitz();
    let mut open: Vec<&mut Line> = lines.iter_mut().flatten().collect();
    while !open.is_empty() {
        let looks: Vec<f64> = open.iter().map(|line| line.next(lipschitz, options)).collect();
        let points: Vec<DVec3> = open.iter().zip(&looks).map(|(line, &t)| line.place(t)).collect();
        for ((line, &t), height) in open.iter_mut().zip(&looks).zip(side.values(&points)) {
            line.advance(t, height, options);
        }
        open.retain(|line| line.state == State::Searching);
    }
    let bracketed = lines.iter_mut().flatten().filter(|line| line.is_bracketed());
    narrow(side, bracketed, LOOKS, SMALL, options.tolerance);
}

/// Narrows brackets until they are shorter than the tolerance.
pub(super) fn converge<'a, F: ImplicitField>(
    side: &Side<'_, F>,
    lines: impl Iterator<Item = &'a mut Line>,
    options: &LevelSearch,
) {
    narrow(side, lines, LAST_LOOKS, 0.0, 0.25 * options.tolerance);
}

/// Chords and bisection in turn: the former find where the field is nearly linear, the latter bounds the looks where
/// it is not. Ends where an end is as low as `small` of the bracket's height, or both ends are within `tolerance`.
fn narrow<'a, F: ImplicitField>(
    side: &Side<'_, F>,
    lines: impl Iterator<Item = &'a mut Line>,
    looks: u32,
    small: f64,
    tolerance: f64,
) {
    let mut open: Vec<Narrowing<'a>> = lines.filter_map(|line| Narrowing::of(line, small)).collect();
    for look in 0..looks {
        open.retain(|narrowing| !narrowing.is_narrow(tolerance));
        if open.is_empty() {
            return;
        }
        let places: Vec<f64> = open.iter().map(|narrowing| narrowing.next(look % 2 == 1)).collect();
        let points: Vec<DVec3> = open.iter().zip(&places).map(|(n, &t)| n.origin + t * n.direction).collect();
        for ((narrowing, &t), height) in open.iter_mut().zip(&places).zip(side.values(&points)) {
            *(if is_inside(height) { &mut *narrowing.inner } else { &mut *narrowing.outer }) = (t, height);
        }
    }
}

/// The bracket of a line.
struct Narrowing<'a> {
    origin: DVec3,
    direction: DVec3,
    inner: &'a mut Place,
    outer: &'a mut Place,
    /// The height of an end at which it is the crossing.
    small: f64,
}

impl<'a> Narrowing<'a> {
    fn of(line: &'a mut Line, small: f64) -> Option<Self> {
        let State::Bracketed { inner, outer } = &mut line.state else { return None };
        let small = small * (outer.1 - inner.1);
        Some(Self { origin: line.origin, direction: line.direction, inner, outer, small })
    }

    fn is_narrow(&self, tolerance: f64) -> bool {
        let low = -self.inner.1 <= self.small || self.outer.1 <= self.small;
        low || (self.inner.0 - self.outer.0).abs() <= tolerance
    }

    /// The next look: never so close to an end that the bracket hardly shrinks.
    fn next(&self, by_halves: bool) -> f64 {
        let share = if by_halves { 0.5 } else { chord_share(self.inner.1, self.outer.1).clamp(0.01, 0.99) };
        self.inner.0 + share * (self.outer.0 - self.inner.0)
    }
}
