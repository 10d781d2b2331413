//! Rate–distortion coordinate descent: one integer after the other takes the value of least `D + λ · bits`.
//!
//! D is the area-weighted mean of the squared distances of the points of the finest level from the surface, linearised
//! around the feet of their projections: moving point i by x changes its distance by `n_i · x`. Points on boundaries
//! count a second time, with what is missing to the end of the surface in the direction in which they look outwards:
//! distances from the surface alone would let boundaries shrink. Lengths here are in ten-thousandths of the surface's
//! diagonal.

mod control;

use ndf_core::glam::Vec3;
use ndf_core::{Answer, DVec3, Hint, Miss, Query, Surface, project_all};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::subdivision::Creases;
use ndf_model::Similarity;
use ndf_model::levels::{Hierarchy, Level, Levels, Predictor};

use super::influence::Influence;
use super::rate::Rate;
use control::Gridded;

/// Distances beyond this multiple of their root mean square weigh less (Huber 1964).
const HUBER: f64 = 4.0;
/// Points closer to the surface than this are moved along its normal, others towards their foot.
const CLOSE: f64 = 0.05;
/// A point whose normal and that of its foot enclose an angle of a smaller cosine is on the wrong side.
const OPPOSED: f64 = -0.2;
/// Share of the squared influence that is added to curvatures: the linearisation holds nearby alone. It grows where it did
/// not hold (Levenberg 1944, Marquardt 1963).
const MIN_PROXIMITY: f64 = 0.05;
const MAX_PROXIMITY: f64 = 1e3;
/// The least area of a point, as a multiple of the mean, where moves are to be small.
const MIN_SHARE: f64 = 0.01;
/// By what the objective may grow in an iteration: the steps of levels change, too.
const MAX_GROWTH: f64 = 1.02;
const MAX_GROWTH_ON_GRID: f64 = 1.002;
/// The farthest that a displacement moves in a sweep, unless the surface is farther away.
const MAX_MOVE: f64 = 15.0;

/// How far outwards the end of the surface is looked for, as a multiple of the mean edge of the base mesh.
const REACH: f64 = 0.5;
/// A surface that comes as close as this to where it was looked for, as a share of that reach, goes on there.
const GOES_ON: f64 = 0.25;

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
#[derive(Clone)]
pub(super) struct State {
    control: Vec<DVec3>,
    gridded: Option<Vec<[i32; 3]>>,
    levels: Vec<(f64, Vec<i32>, Vec<f64>)>,
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
    surface: &'a dyn Surface,
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
    /// Mean and root mean square of the distances, area-weighted, and the share of the area that has no foot.
    pub(super) mean: f64,
    pub(super) rms: f64,
    pub(super) missed: f64,
    /// The weighted squares of what is missing along the boundary.
    pub(super) boundary_error: f64,
}

impl<'a> Descent<'a> {
    /// A descent from a base mesh in the box, sharp at its creases, towards a surface, with `levels` levels.
    pub(super) fn new(
        surface: &'a dyn Surface,
        similarity: Similarity,
        base: &ManifoldMesh,
        creases: &Creases,
        levels: usize,
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
        let mut descent = Self {
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
            mean: 0.0,
            rms: 0.0,
            missed: 0.0,
            boundary_error: 0.0,
        };
        descent.project();
        descent
    }

    /// Steps of all levels for this λ: they grow with the number of vertices, so that an integer of every level is
    /// worth as much.
    pub(super) fn set_steps(&mut self, lambda: f64, factor: f64) {
        for (l, level) in (1..).zip(&mut self.levels) {
            level.step = factor * (lambda * self.hierarchy.level(l).vertex_count() as f64 / 0.2).sqrt();
        }
    }

    /// The surface anew from its numbers, and its distances.
    pub(super) fn project(&mut self) {
        let mut control = self.control.clone();
        for (l, level) in (1..).zip(&mut self.levels) {
            (control, level.normals) = self.hierarchy.displaced(l, &control, |i| level.values[i]);
        }
        let depth = self.hierarchy.levels();
        let finest = self.hierarchy.level(depth);
        self.points = finest.limit(&self.hierarchy.level(depth - 1).subdivide(&control));
        let normals = finest.normals(&self.points);
        let to_world = |p: DVec3| self.similarity.to_world(p * self.unit);
        let query = |((&p, &n), &hint): ((&DVec3, &DVec3), &Hint)| Query {
            point: to_world(p),
            normal: (n != DVec3::ZERO).then_some(n),
            hint,
        };
        let outwards = self.outwards();
        let reach = REACH * self.mean_edge;
        let on_boundary = self.boundary_points.iter().zip(&outwards);
        let beyond: Vec<DVec3> = on_boundary.map(|(&v, t)| self.points[v as usize] + reach * *t).collect();
        let boundary_normals = self.boundary_points.iter().map(|&v| &normals[v as usize]);
        let places = self.points.iter().chain(&beyond).zip(normals.iter().chain(boundary_normals));
        let queries: Vec<Query> = places.zip(&self.hints).map(query).collect();
        let mut feet: Vec<Answer> = vec![Err(Miss::OutOfReach); queries.len()];
        project_all(self.surface, &queries, &mut feet);
        let mut areas = vec![0.0; self.points.len()];
        for face in finest.faces() {
            let [a, b, c] = face.map(|v| self.points[v as usize]);
            let area = (b - a).cross(c - a).length();
            face.iter().for_each(|&v| areas[v as usize] += area);
        }
        let total: f64 = areas.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let least = MIN_SHARE / self.points.len() as f64;
        let [mut mean, mut square, mut missed] = [0.0; 3];
        let (rows, boundary_rows) = self.rows.split_at_mut(self.points.len());
        for (i, (row, foot)) in rows.iter_mut().zip(&feet).enumerate() {
            let area = areas[i] / total;
            // Vertices of faces without area are not free to go anywhere.
            let held = area.max(least);
            *row = Row { direction: row.direction, distance: 0.0, area: held as f32, weight: 0.0 };
            let Ok(foot) = foot else {
                missed += area;
                continue;
            };
            self.hints[i] = foot.hint;
            let away = self.points[i] - self.similarity.to_normalised(foot.point) / self.unit;
            let distance = away.length();
            let direction = if distance < CLOSE { foot.normal } else { away / distance };
            (row.direction, row.distance) = (direction.as_vec3(), away.dot(direction) as f32);
            mean += area * distance;
            square += area * distance * distance;
            if normals[i].dot(foot.normal) >= OPPOSED {
                row.weight = area as f32;
            }
        }
        let found = (1.0 - missed).max(1e-9);
        (self.mean, self.rms, self.missed) = (mean / found, (square / found).sqrt(), missed);
        self.boundary_error = 0.0;
        let boundary =
            self.boundary_points.iter().zip(&outwards).zip(feet[self.points.len()..].iter().zip(&beyond));
        let boundary_hints = &mut self.hints[self.points.len()..];
        for ((row, hint), ((&v, &direction), (foot, &beyond))) in
            boundary_rows.iter_mut().zip(boundary_hints).zip(boundary)
        {
            let area = (areas[v as usize] / total) as f32;
            *row = Row { direction: direction.as_vec3(), distance: 0.0, area: 0.0, weight: 0.0 };
            let Ok(foot) = foot else { continue };
            *hint = foot.hint;
            let end = self.similarity.to_normalised(foot.point) / self.unit;
            // A surface that goes on has no end here, which a base mesh may have nevertheless.
            if end.distance(beyond) > GOES_ON * reach {
                let missing = (self.points[v as usize] - end).dot(direction) as f32;
                (row.distance, row.weight) = (missing, area);
                self.boundary_error += f64::from(area * missing * missing);
            }
        }
        let most = (HUBER * self.rms) as f32;
        for row in &mut self.rows {
            row.weight *= (most / row.distance.abs().max(1e-9)).min(1.0);
        }
    }

    /// Of every point of the boundary the direction along the surface that leads away from it.
    fn outwards(&self) -> Vec<DVec3> {
        let finest = self.hierarchy.level(self.hierarchy.levels());
        let mut outwards = vec![DVec3::ZERO; self.boundary_points.len()];
        for side in finest.edges().iter().filter(|side| side.is_boundary()) {
            let [a, b, c] = [side.ends[0], side.ends[1], side.across[0]].map(|v| self.points[v as usize]);
            let along = b - a;
            let outward = along.cross(along.cross(c - a)).normalize_or_zero();
            for end in side.ends {
                if let Ok(k) = self.boundary_points.binary_search(&end) {
                    outwards[k] += outward;
                }
            }
        }
        outwards.iter_mut().for_each(|t| *t = t.normalize_or_zero());
        outwards
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
    /// before, if theirs was clearly better, and makes smaller moves. Whether it took them.
    pub(super) fn trust(&mut self, after: f64, (before, objective): (State, f64)) -> bool {
        let most = if self.gridded.is_some() { MAX_GROWTH_ON_GRID } else { MAX_GROWTH };
        if after <= most * objective {
            self.proximity = (0.5 * self.proximity).max(MIN_PROXIMITY);
            return true;
        }
        self.proximity = (8.0 * self.proximity).min(MAX_PROXIMITY);
        self.restore(before);
        self.project();
        false
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
        let mut finer = Self::new(self.surface, self.similarity, base, &self.creases, count);
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
