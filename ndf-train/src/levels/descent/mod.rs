//! Rate–distortion coordinate descent: one integer after the other takes the value of least `D + λ · bits`.
//!
//! D is the area-weighted mean of the squared distances of the points of the finest level from the surface, linearised
//! around the feet of their projections: moving point i by x changes its distance by `n_i · x`. Points on boundaries
//! count a second time, with what is missing to the end of the surface in the direction in which they look outwards:
//! distances from the surface alone would let boundaries shrink. Lengths here are in ten-thousandths of the surface's
//! diagonal.

mod control;
mod measuring;

use std::sync::Arc;

use ndf_core::glam::Vec3;
use ndf_core::{DVec3, Hint, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::subdivision::Creases;
use ndf_model::Similarity;
use ndf_model::levels::{GateWeights, Hierarchy, Level, Levels, Predictor};

use super::influence::Influence;
use super::rate::Rate;
use super::stop::Stop;
use control::Gridded;

/// Share of the squared influence that is added to curvatures: the linearisation holds nearby alone. It grows where it did
/// not hold (Levenberg 1944, Marquardt 1963).
const MIN_PROXIMITY: f64 = 0.05;
const MAX_PROXIMITY: f64 = 1e3;
/// By what the objective may grow in an iteration: the steps of levels change, too.
const MAX_GROWTH: f64 = 1.02;
const MAX_GROWTH_ON_GRID: f64 = 1.002;
/// The farthest that a displacement moves in a sweep, unless the surface is farther away.
const MAX_MOVE: f64 = 15.0;

/// One level.
struct DescentLevel {
    step: f64,
    integers: Vec<i32>,
    /// Displacements: integers times step, at the start anything.
    values: Vec<f64>,
    normals: Vec<DVec3>,
    influence: Influence,
}

/// All that a sweep changes.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) control: Vec<DVec3>,
    pub(super) gridded: Option<Vec<[i32; 3]>>,
    pub(super) levels: Vec<LevelState>,
}

/// Where a step began.
pub(super) struct Before {
    state: State,
    feet: Arc<Feet>,
    is_fresh: bool,
    objective: f64,
}

/// The numbers of a level: its step, integers, and displacements.
pub(super) type LevelState = (f64, Vec<i32>, Vec<f64>);

/// Where the points are on the surface, the normals there, and the direction in which they are away from it, if they have
/// a foot.
pub(super) type Feet = Vec<Option<[DVec3; 3]>>;

/// A descent between two iterations, without what follows from it and the base mesh.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    pub(super) state: State,
    /// Spacing and predictor of control vertices that are on a grid.
    pub(super) grid: Option<(f64, GateWeights)>,
    pub(super) proximity: f64,
    pub(super) hints: Vec<Hint>,
    pub(super) feet: Arc<Feet>,
    pub(super) is_fresh: bool,
}

/// A point of the finest level.
#[derive(Clone, Copy)]
struct Row {
    /// Direction in which its distance grows.
    direction: Vec3,
    /// Signed distance along it.
    distance: f32,
    /// Share of the area, and what of it counts.
    area: f32,
    weight: f32,
}

/// The state of a descent.
pub(super) struct Descent<'a> {
    /// What is projected onto.
    pub(super) surface: &'a dyn Surface,
    similarity: Similarity,
    /// Length of a unit in the box.
    unit: f64,
    /// Mean length of the edges of the base mesh, in units.
    pub(super) mean_edge: f64,
    creases: Creases,
    hierarchy: Hierarchy,
    control: Vec<DVec3>,
    control_influence: Influence,
    predictor: Predictor,
    gridded: Option<Gridded>,
    spacing: f64,
    proximity: f64,
    levels: Vec<DescentLevel>,
    rate: Rate,
    points: Vec<DVec3>,
    /// The points that are on a boundary.
    boundary_points: Vec<u32>,
    /// Of all points, and after them of those of the boundary.
    rows: Vec<Row>,
    hints: Vec<Hint>,
    /// Of all points, and after them of where the end of the surface is looked for.
    feet: Arc<Feet>,
    /// Whether they are those of the present points.
    is_fresh: bool,
    stop: Arc<Stop<'a>>,
    /// Mean and root mean square of the distances, area-weighted, and the share of the area that has no foot.
    pub(super) mean: f64,
    pub(super) rms: f64,
    pub(super) missed: f64,
    /// The weighted squares of what is missing along the boundary.
    pub(super) boundary_error: f64,
}

impl<'a> Descent<'a> {
    /// A descent from a base mesh in the box, sharp at its creases, towards a surface, with `levels` levels. Projects until
    /// it is to stop.
    pub(super) fn new(
        surface: &'a dyn Surface,
        similarity: Similarity,
        base: &ManifoldMesh,
        creases: &Creases,
        levels: usize,
        stop: Arc<Stop<'a>>,
    ) -> Self {
        let mut descent = Self::without_feet(surface, similarity, base, creases, levels, stop);
        descent.project();
        descent
    }

    /// The same, before it is measured.
    fn without_feet(
        surface: &'a dyn Surface,
        similarity: Similarity,
        base: &ManifoldMesh,
        creases: &Creases,
        levels: usize,
        stop: Arc<Stop<'a>>,
    ) -> Self {
        let unit = 1e-4 * similarity.scale() * surface.bounds().diagonal();
        let hierarchy = Hierarchy::new(base, creases, levels + 1);
        let boundary = hierarchy.level(levels + 1).edges().iter().filter(|side| side.is_boundary());
        let mut boundary_points: Vec<u32> = boundary.flat_map(|side| side.ends).collect();
        boundary_points.sort_unstable();
        boundary_points.dedup();
        let mut influences = Influence::of(&hierarchy, &boundary_points).into_iter();
        let control_influence = influences.next().expect("level 0 is always there");
        let base_positions: Vec<DVec3> = base.positions().iter().map(|&p| p / unit).collect();
        let levels = influences.map(|influence| DescentLevel {
            step: 1.0,
            integers: vec![0; influence.len()],
            values: vec![0.0; influence.len()],
            normals: vec![DVec3::Z; influence.len()],
            influence,
        });
        let levels: Vec<DescentLevel> = levels.collect();
        let edges = hierarchy.level(0).edges();
        let length = |[a, b]: [u32; 2]| base_positions[a as usize].distance(base_positions[b as usize]);
        let mean_edge = edges.iter().map(|side| length(side.ends)).sum::<f64>() / edges.len() as f64;
        let mut control = base_positions.clone();
        // The limit surface is to go through the base vertices.
        for _ in 0..6 {
            let limit = hierarchy.level(0).limit(&control);
            for ((c, p), l) in control.iter_mut().zip(&base_positions).zip(limit) {
                *c += 0.9 * (*p - l);
            }
        }
        let count = hierarchy.level(hierarchy.levels()).vertex_count() + boundary_points.len();
        let row = Row { direction: Vec3::Z, distance: 0.0, area: 0.0, weight: 0.0 };
        Self {
            surface,
            similarity,
            unit,
            mean_edge,
            creases: creases.clone(),
            control,
            control_influence,
            predictor: Predictor::new(base),
            gridded: None,
            spacing: 1.0,
            proximity: MIN_PROXIMITY,
            rate: Rate::new(&hierarchy, levels.len()),
            hierarchy,
            levels,
            points: Vec::new(),
            boundary_points,
            rows: vec![row; count],
            hints: vec![Hint::NONE; count],
            feet: Arc::new(vec![None; count]),
            is_fresh: true,
            stop,
            mean: 0.0,
            rms: 0.0,
            missed: 0.0,
            boundary_error: 0.0,
        }
    }

    /// Goes on from what was [kept](Self::kept) of a descent between these. Its parts must have the sizes that go with them.
    pub(super) fn resumed(
        surface: &'a dyn Surface,
        similarity: Similarity,
        base: &ManifoldMesh,
        creases: &Creases,
        kept: Kept,
        stop: Arc<Stop<'a>>,
    ) -> Self {
        let levels = kept.state.levels.len();
        let mut descent = Self::without_feet(surface, similarity, base, creases, levels, stop);
        if let (Some((spacing, weights)), Some(integers)) = (kept.grid, &kept.state.gridded) {
            descent.spacing = spacing;
            descent.gridded = Some(Gridded::new(&descent.predictor, integers.clone(), weights));
        }
        descent.restore(kept.state);
        (descent.proximity, descent.hints) = (kept.proximity, kept.hints);
        (descent.feet, descent.is_fresh) = (kept.feet, kept.is_fresh);
        descent.measure();
        descent
    }

    /// Enough to go on exactly from here. O(n).
    pub(super) fn kept(&self) -> Kept {
        Kept {
            state: self.state(),
            grid: self.gridded.as_ref().map(|gridded| (self.spacing, gridded.weights)),
            proximity: self.proximity,
            hints: self.hints.clone(),
            feet: Arc::clone(&self.feet),
            is_fresh: self.is_fresh,
        }
    }

    /// Steps of all levels for this λ: they grow with the number of vertices, so that an integer of every level is
    /// worth as much.
    pub(super) fn set_steps(&mut self, lambda: f64, factor: f64) {
        for (l, level) in (1..).zip(&mut self.levels) {
            level.step = factor * (lambda * self.hierarchy.level(l).vertex_count() as f64 / 0.2).sqrt();
        }
    }

    /// The numbers as they are now.
    pub(super) fn state(&self) -> State {
        State {
            control: self.control.clone(),
            gridded: self.gridded.as_ref().map(|gridded| gridded.integers.clone()),
            levels: self.levels.iter().map(|l| (l.step, l.integers.clone(), l.values.clone())).collect(),
        }
    }

    /// Takes the present numbers, whose objective is `after`, and dares more from then on; or goes back to those of
    /// before with their feet, if theirs was clearly better, and makes smaller moves. Whether it took them.
    pub(super) fn trust(&mut self, after: f64, before: Before) -> bool {
        let most = if self.gridded.is_some() { MAX_GROWTH_ON_GRID } else { MAX_GROWTH };
        if after <= most * before.objective {
            self.proximity = (0.5 * self.proximity).max(MIN_PROXIMITY);
            return true;
        }
        self.proximity = (8.0 * self.proximity).min(MAX_PROXIMITY);
        self.restore(before.state);
        (self.feet, self.is_fresh) = (before.feet, before.is_fresh);
        self.measure();
        false
    }

    /// What there is before a step, to go back to.
    pub(super) fn before(&self, objective: f64) -> Before {
        let (state, feet) = (self.state(), Arc::clone(&self.feet));
        Before { state, feet, is_fresh: self.is_fresh, objective }
    }

    /// Goes back to these numbers, without projecting.
    pub(super) fn restore(&mut self, state: State) {
        self.control = state.control;
        match (&mut self.gridded, state.gridded) {
            (Some(gridded), Some(integers)) => gridded.integers = integers,
            (gridded, _) => *gridded = None,
        }
        for (level, (step, integers, values)) in self.levels.iter_mut().zip(state.levels) {
            (level.step, level.integers, level.values) = (step, integers, values);
        }
    }

    /// Goes on towards another surface.
    pub(super) fn turn_to(&mut self, surface: &'a dyn Surface) {
        self.surface = surface;
        self.hints.fill(Hint::NONE);
        self.project();
    }

    /// Goes on with one level more.
    pub(super) fn refine(&mut self, base: &ManifoldMesh) {
        let count = self.levels.len() + 1;
        let stop = Arc::clone(&self.stop);
        let mut finer = Self::without_feet(self.surface, self.similarity, base, &self.creases, count, stop);
        finer.control = std::mem::take(&mut self.control);
        finer.proximity = self.proximity;
        for (to, from) in finer.levels.iter_mut().zip(self.levels.drain(..)) {
            (to.step, to.integers, to.values) = (from.step, from.integers, from.values);
        }
        finer.project();
        *self = finer;
    }

    /// Number of levels.
    pub(super) fn level_count(&self) -> usize {
        self.levels.len()
    }

    /// The prices of the present displacements, with contexts fitted anew if asked for.
    pub(super) fn price(&mut self, refit: bool) {
        let integers = self.levels.iter().map(|level| &*level.integers);
        self.rate.update(&self.hierarchy, integers, refit);
    }

    /// One sweep over the displacements of all levels.
    pub(super) fn sweep(&mut self, lambda: f64) {
        let farthest = MAX_MOVE.max(self.rms);
        for (level, prices) in self.levels.iter_mut().zip(&self.rate.prices) {
            for j in 0..level.integers.len() {
                let entries = level.influence.of_vertex(j);
                let normal = level.normals[j].as_vec3();
                let [mut slope, mut curvature, mut near] = [0.0_f32; 3];
                for &(i, t) in entries {
                    let row = &self.rows[i as usize];
                    let moved = t * normal.dot(row.direction);
                    slope += row.weight * moved * row.distance;
                    curvature += row.weight * moved * moved;
                    near += row.area * t * t;
                }
                let (slope, curvature) =
                    (f64::from(slope), f64::from(curvature) + self.proximity * f64::from(near));
                if curvature <= 0.0 {
                    continue;
                }
                let best = level.values[j] + (-slope / curvature).clamp(-farthest, farthest);
                let ratio = best / level.step;
                let nearest = ratio.round() as i32;
                let towards_zero = if ratio > 0.0 { -1 } else { 1 };
                let cost = |q: i32| {
                    let off = f64::from(q) * level.step - best;
                    curvature * off * off + lambda * prices.bits(j, q)
                };
                let mut chosen = (cost(nearest), nearest);
                for q in [nearest + towards_zero, nearest + 2 * towards_zero, 0] {
                    let passed = q * towards_zero > 0;
                    let cost = cost(q);
                    if !passed && cost < chosen.0 {
                        chosen = (cost, q);
                    }
                }
                let value = f64::from(chosen.1) * level.step;
                let change = value - level.values[j];
                level.integers[j] = chosen.1;
                level.values[j] = value;
                if change != 0.0 {
                    let moved = change as f32 * normal;
                    for &(i, t) in entries {
                        let row = &mut self.rows[i as usize];
                        row.distance += t * moved.dot(row.direction);
                    }
                }
            }
        }
    }

    /// Moves the step of every level half way to the one that is best for its integers.
    pub(super) fn fit_steps(&mut self) {
        for level in &mut self.levels {
            let mut moved = vec![0.0_f32; self.rows.len()];
            for (j, &q) in level.integers.iter().enumerate().filter(|(_, q)| **q != 0) {
                let by = q as f32 * level.normals[j].as_vec3();
                for &(i, t) in level.influence.of_vertex(j) {
                    moved[i as usize] += t * by.dot(self.rows[i as usize].direction);
                }
            }
            let (slope, curvature) = self.rows.iter().zip(&moved).fold((0.0, 0.0), |(s, c), (row, m)| {
                (s + f64::from(row.weight * row.distance * m), c + f64::from(row.weight * m * m))
            });
            if curvature <= 0.0 {
                continue;
            }
            let most = 0.1 * level.step;
            let change = 0.5 * (-slope / curvature).clamp(-most, most);
            // What the file will say.
            let step = f64::from(((level.step + change) * self.unit) as f32) / self.unit;
            let change = step - level.step;
            level.step = step;
            level.values = level.integers.iter().map(|&q| f64::from(q) * step).collect();
            self.rows.iter_mut().zip(&moved).for_each(|(row, m)| row.distance += m * change as f32);
        }
    }

    /// The levels as they are now. Control vertices that are free are taken to a grid of this spacing, in units.
    pub(super) fn levels(&self, spacing: f64) -> Levels {
        let (spacing, control) = match &self.gridded {
            Some(gridded) => (self.spacing, gridded.integers.clone()),
            None => (spacing, self.on_grid(spacing)),
        };
        let levels = self.levels.iter().map(|level| Level {
            step: (level.step * self.unit) as f32,
            displacements: level.integers.clone(),
        });
        Levels {
            spacing: (spacing * self.unit) as f32,
            control,
            creases: self.creases.clone(),
            levels: levels.collect(),
        }
    }

    fn on_grid(&self, spacing: f64) -> Vec<[i32; 3]> {
        self.control.iter().map(|p| (*p / spacing).round().to_array().map(|x| x as i32)).collect()
    }
}
