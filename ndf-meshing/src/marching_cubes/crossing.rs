//! Where on its edge the field crosses the level: a bracketed search, many edges at a time.

use ndf_core::DVec3;
use rayon::prelude::*;

use super::grid::{Grid, Oriented};
use super::slab::Crossing;

/// Vertices keep this distance from the ends of their edge, in edge lengths, so that no face is without area
/// when the level meets a corner.
const CLEARANCE: f64 = 1e-4;
/// A crossing is found when the value there is this small, relative to the change along the edge.
const SMALL: f64 = 1e-3;

/// A bracket of the crossing: parameters and values of an end inside (value above 0) and one outside.
#[derive(Clone, Copy)]
struct Bracket {
    inner: (f64, f64),
    outer: (f64, f64),
    /// The values that steer the search: that of an end that stays is halved (Illinois method; Dowell and
    /// Jarratt 1971).
    steering: (f64, f64),
    /// Which end moved last: −1 the outer, 1 the inner.
    moved: i8,
    small: f64,
}

impl Bracket {
    fn new([start, end]: [f64; 2]) -> Self {
        let (inner, outer) =
            if start > 0.0 { ((0.0, start), (1.0, end)) } else { ((1.0, end), (0.0, start)) };
        let small = SMALL * (inner.1 - outer.1);
        Self { inner, outer, steering: (inner.1, outer.1), moved: 0, small }
    }

    /// Where a line through the values crosses zero; the middle where a value is NaN or infinite.
    fn line(&self, inner: f64, outer: f64) -> f64 {
        let share = inner / (inner - outer);
        let share = if share.is_finite() && outer.is_finite() { share } else { 0.5 };
        self.inner.0 + share * (self.outer.0 - self.inner.0)
    }

    /// The next place to look at: never so close to an end that the bracket hardly shrinks.
    fn guess(&self) -> f64 {
        let span = self.outer.0 - self.inner.0;
        let t = self.line(self.steering.0, self.steering.1);
        let (a, b) = (self.inner.0 + 0.01 * span, self.outer.0 - 0.01 * span);
        t.clamp(a.min(b), a.max(b))
    }

    fn learn(&mut self, t: f64, value: f64) {
        if value > 0.0 {
            self.inner = (t, value);
            self.steering = (value, if self.moved == 1 { 0.5 * self.steering.1 } else { self.outer.1 });
            self.moved = 1;
        } else {
            self.outer = (t, value);
            self.steering = (if self.moved == -1 { 0.5 * self.steering.0 } else { self.inner.1 }, value);
            self.moved = -1;
        }
    }

    fn is_found(&self) -> bool {
        self.inner.1 <= self.small || -self.outer.1 <= self.small
    }

    /// The best estimate of the crossing.
    fn crossing(&self) -> f64 {
        self.line(self.inner.1, self.outer.1).clamp(CLEARANCE, 1.0 - CLEARANCE)
    }
}

/// Positions of all crossings after at most `steps` looks at the field each, and how many there were in all.
/// Vertices in the middle of a cell get the middle of its first edge, to be replaced.
pub(crate) fn positions(
    field: Oriented<'_>,
    grid: Grid,
    crossings: &[Crossing],
    steps: u32,
) -> (Vec<DVec3>, u64) {
    let batches: Vec<(Vec<DVec3>, u64)> = crossings
        .par_chunks(field.batch())
        .map(|batch| positions_of_batch(field, grid, batch, steps))
        .collect();
    let looks = batches.iter().map(|batch| batch.1).sum();
    (batches.into_iter().flat_map(|batch| batch.0).collect(), looks)
}

fn positions_of_batch(
    field: Oriented<'_>,
    grid: Grid,
    crossings: &[Crossing],
    steps: u32,
) -> (Vec<DVec3>, u64) {
    let mut brackets: Vec<Bracket> = crossings.iter().map(|c| Bracket::new(c.values)).collect();
    let place = |crossing: &Crossing, t: f64| {
        grid.corner(crossing.corner) + DVec3::AXES[usize::from(crossing.axis) % 3] * (t * grid.cell)
    };
    let mut open: Vec<usize> = (0..crossings.len()).filter(|&i| crossings[i].axis < 3).collect();
    let mut looks = 0;
    for _ in 0..steps {
        open.retain(|&i| !brackets[i].is_found());
        if open.is_empty() {
            break;
        }
        let guesses: Vec<f64> = open.iter().map(|&i| brackets[i].guess()).collect();
        let points: Vec<DVec3> = open.iter().zip(&guesses).map(|(&i, &t)| place(&crossings[i], t)).collect();
        let mut values = vec![0.0; points.len()];
        field.values(&points, &mut values);
        looks += points.len() as u64;
        for ((&i, &t), &value) in open.iter().zip(&guesses).zip(&values) {
            brackets[i].learn(t, value);
        }
    }
    let positions =
        crossings.iter().zip(&brackets).map(|(c, bracket)| place(c, bracket.crossing())).collect();
    (positions, looks)
}
