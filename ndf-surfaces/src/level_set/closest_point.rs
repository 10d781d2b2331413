//! From a crossing of the level to the point of the level set closest to the query.

use ndf_core::{DVec3, ImplicitField, Miss};

use super::LevelSearch;
use super::line_search::{Line, converge};
use super::side::Side;

/// Steps straight back to the level after the last step along it.
const RETURNS: u32 = 4;
/// Cosine of the angle from which a normal opposes the guide.
const OPPOSED: f64 = -0.25;
/// What a step that led away from the query leaves of the longest step.
const SHRINKAGE: f64 = 0.25;

/// Whether a normal is turned against a guide.
pub(super) fn opposes(normal: DVec3, guide: DVec3) -> bool {
    normal.dot(guide) <= OPPOSED
}

/// A foot in the making.
pub(super) struct Polish {
    /// Which query it answers.
    query: usize,
    line: Line,
    guide: Option<DVec3>,
    /// Where the line crosses the level.
    crossing: DVec3,
    place: DVec3,
    /// Longest step along the level set.
    radius: f64,
    /// Distance to the query at the last place.
    distance: f64,
    state: State,
}

enum State {
    Moving,
    /// At a point of the level, with its unit normal.
    Arrived(DVec3, DVec3),
    /// The gradient was of no use, or misled.
    Lost,
}

impl Polish {
    pub(super) fn new(query: usize, line: Line, guide: Option<DVec3>) -> Self {
        let crossing = line.crossing();
        let radius = crossing.distance(line.origin());
        let (place, distance) = (crossing, f64::INFINITY);
        Self { query, line, guide, crossing, place, radius, distance, state: State::Moving }
    }

    /// The query's number and its foot with the normal there.
    pub(super) fn into_foot(self) -> (usize, Result<[DVec3; 2], Miss>) {
        match self.state {
            State::Arrived(point, normal) => (self.query, Ok([point, normal])),
            State::Moving | State::Lost => (self.query, Err(Miss::NoCrossing)),
        }
    }

    /// A step from the current place, where the field has this height and gradient.
    fn step(&mut self, height: f64, gradient: DVec3, along: bool, options: &LevelSearch) {
        let slope = gradient.length();
        let back = -height / slope;
        if !(slope > 0.0 && back.is_finite() && gradient.is_finite()) {
            self.state = State::Lost;
            return;
        }
        let normal = gradient / slope;
        let away = self.line.origin() - self.place;
        let aside = away - away.dot(normal) * normal;
        let settled = !along || aside.length() <= 0.5 * options.tolerance;
        if settled && back.abs() <= 0.25 * options.tolerance {
            self.arrive(self.place + back * normal, normal, options);
            return;
        }
        if away.length() > self.distance {
            self.radius *= SHRINKAGE;
        }
        self.distance = away.length();
        self.place += back.clamp(-options.step, options.step) * normal;
        if !settled {
            self.place += aside.clamp_length_max(self.radius);
        }
    }

    /// Takes a point of the level as the foot, if it is better than the crossing.
    fn arrive(&mut self, point: DVec3, normal: DVec3, options: &LevelSearch) {
        let limit = self.crossing.distance(self.line.origin()) + options.tolerance;
        let is_closer = point.distance(self.line.origin()) <= limit;
        let agrees = self.guide.is_none_or(|guide| !opposes(normal, guide));
        self.state = if is_closer && agrees { State::Arrived(point, normal) } else { State::Lost };
    }
}

/// Finds the closest points, or else the exact crossings of the lines.
pub(super) fn polish<F: ImplicitField>(side: &Side<'_, F>, all: &mut [Polish], options: &LevelSearch) {
    for round in 0..=options.polish + RETURNS {
        let mut moving: Vec<&mut Polish> =
            all.iter_mut().filter(|polish| matches!(polish.state, State::Moving)).collect();
        if moving.is_empty() {
            break;
        }
        let points: Vec<DVec3> = moving.iter().map(|polish| polish.place).collect();
        for (polish, (height, gradient)) in moving.iter_mut().zip(side.values_and_gradients(&points)) {
            polish.step(height, gradient, round < options.polish, options);
        }
    }
    let mut lost: Vec<&mut Polish> =
        all.iter_mut().filter(|polish| !matches!(polish.state, State::Arrived(..))).collect();
    converge(side, lost.iter_mut().map(|polish| &mut polish.line), options);
    let points: Vec<DVec3> = lost.iter().map(|polish| polish.line.crossing()).collect();
    for ((polish, &point), (_, gradient)) in
        lost.iter_mut().zip(&points).zip(side.values_and_gradients(&points))
    {
        // Heights rise along the line, whatever the gradient says.
        let direction = polish.line.direction();
        let normal =
            gradient.try_normalize().filter(|normal| normal.dot(direction) > 0.0).unwrap_or(direction);
        polish.state = State::Arrived(point, normal);
    }
}
