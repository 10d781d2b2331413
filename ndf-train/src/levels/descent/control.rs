//! The sweeps of control vertices: free at first, then on a grid.

use ndf_core::DVec3;
use ndf_core::glam::{DMat3, Mat3, Vec3};

use ndf_model::levels::{GateWeights, Predictor};

use super::{Descent, MIN_PROXIMITY};

/// As much more than for displacements is added to curvatures, since control vertices could also slide along the surface.
const RIDGE: f64 = 2.0;
/// The farthest that a control vertex moves in a sweep, unless the surface is farther away.
const MAX_CONTROL_MOVE: f64 = 8.0;
/// What a bit of control positions counts, as the estimate of their rate is low.
const CONTROL_RATE: f64 = 1.3;

/// Control vertices on a grid.
pub(super) struct Gridded {
    pub(super) integers: Vec<[i32; 3]>,
    /// How they are predicted.
    pub(super) weights: GateWeights,
    /// The prediction of every vertex, and the vertices that each helps to predict, with their weights.
    rows: Vec<Vec<(u32, f64)>>,
    dependents: Vec<Vec<(u32, f64)>>,
}

impl Gridded {
    pub(super) fn new(predictor: &Predictor, integers: Vec<[i32; 3]>, weights: GateWeights) -> Self {
        let rows: Vec<_> = (0..integers.len()).map(|v| predictor.row(v, &weights)).collect();
        let mut dependents = vec![Vec::new(); integers.len()];
        for (v, row) in (0..).zip(&rows) {
            row.iter().for_each(|&(u, w)| dependents[u as usize].push((v, w)));
        }
        Self { integers, weights, rows, dependents }
    }
}

impl Descent<'_> {
    /// One sweep of the control vertices: anywhere before they are on a grid, to neighbours on it afterwards.
    pub(in crate::levels) fn sweep_control(&mut self, lambda: f64) {
        match self.gridded.take() {
            None => self.sweep_free(),
            Some(mut gridded) => {
                self.sweep_gridded(&mut gridded, lambda);
                self.gridded = Some(gridded);
            }
        }
    }

    fn sweep_free(&mut self) {
        for j in 0..self.control.len() {
            let entries = self.control_influence.of_vertex(j);
            let (mut matrix, mut slope, mut near) = (Mat3::ZERO, Vec3::ZERO, 0.0_f32);
            for &(i, t) in entries {
                let row = &self.rows[i as usize];
                let n = row.direction;
                slope += row.weight * row.distance * t * n;
                let scaled = row.weight * t * t * n;
                matrix += Mat3::from_cols(scaled * n.x, scaled * n.y, scaled * n.z);
                near += row.area * t * t;
            }
            let (mut matrix, slope) = (matrix.as_dmat3(), slope.as_dvec3());
            matrix += DMat3::from_diagonal(DVec3::splat(RIDGE * self.proximity * f64::from(near)));
            let step = -(matrix.inverse() * slope);
            if !step.is_finite() {
                continue;
            }
            let step = step.clamp_length_max(MAX_CONTROL_MOVE.max(self.rms));
            self.control[j] += step;
            let step = step.as_vec3();
            for &(i, t) in entries {
                let row = &mut self.rows[i as usize];
                row.distance += t * step.dot(row.direction);
            }
        }
    }

    /// Puts the control vertices on a grid.
    pub(in crate::levels) fn snap_to_grid(&mut self, spacing: f64) {
        // What the file will say.
        self.spacing = f64::from((spacing * self.unit) as f32) / self.unit;
        let integers = self.on_grid(self.spacing);
        let weights = self.predictor.fitted_weights(&integers);
        self.control = integers.iter().map(|q| DVec3::from(q.map(f64::from)) * self.spacing).collect();
        self.gridded = Some(Gridded::new(&self.predictor, integers, weights));
    }

    fn sweep_gridded(&mut self, gridded: &mut Gridded, lambda: f64) {
        let Gridded { integers, rows: predictions, dependents, .. } = gridded;
        let spacing = self.spacing;
        let residual = |integers: &[[i32; 3]], v: usize, c: usize| {
            let predicted: f64 =
                predictions[v].iter().map(|&(u, w)| w * f64::from(integers[u as usize][c])).sum();
            f64::from(integers[v][c]) - predicted
        };
        let price = |r: f64| (1.0 + r.abs()).log2();
        for j in 0..integers.len() {
            let entries = self.control_influence.of_vertex(j);
            for c in 0..3 {
                let [mut slope, mut curvature, mut near] = [0.0_f32; 3];
                for &(i, t) in entries {
                    let row = &self.rows[i as usize];
                    let moved = t * row.direction[c];
                    slope += row.weight * row.distance * moved;
                    curvature += row.weight * moved * moved;
                    near += row.area * t * t;
                }
                let slope = f64::from(slope);
                let curvature = f64::from(curvature) + (self.proximity - MIN_PROXIMITY) * f64::from(near);
                let own = residual(integers, j, c);
                let mut chosen = (0.0, 0);
                for q in [-1, 1] {
                    let x = f64::from(q) * spacing;
                    let distortion = 2.0 * slope * x + curvature * x * x;
                    let mut bits = price(own + f64::from(q)) - price(own);
                    for &(v, w) in &dependents[j] {
                        let before = residual(integers, v as usize, c);
                        bits += price(before - w * f64::from(q)) - price(before);
                    }
                    let cost = distortion + CONTROL_RATE * lambda * bits;
                    if cost < chosen.0 {
                        chosen = (cost, q);
                    }
                }
                if chosen.1 != 0 {
                    integers[j][c] += chosen.1;
                    let x = f64::from(chosen.1) * spacing;
                    self.control[j][c] += x;
                    for &(i, t) in entries {
                        let row = &mut self.rows[i as usize];
                        row.distance += t * row.direction[c] * x as f32;
                    }
                }
            }
        }
    }
}
