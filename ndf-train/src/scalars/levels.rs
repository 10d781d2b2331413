//! Scalar fields on levels of nodes, by rate–distortion coordinate descent: one integer after the other takes the value of
//! least `D + λ · bits`.
//!
//! D is the mean of the squared errors over samples of the base mesh, in squares of the channels' ranges. Values are
//! linear in the integers, so it is an exact quadratic form: `D = c − 2 bᵀu + uᵀ A u` for values u of the nodes, where A
//! and b are sums over the samples. An integer changes u along a column of the basis, the bump that it adds to the nodes
//! predicted from it. λ is annealed from above, as for the levels of displacements. Channels share contexts and steps.

use std::sync::Arc;

use nalgebra_sparse::{CooMatrix, CsrMatrix};
use ndf_core::progress::Progress;
use ndf_model::SurfaceScalars;
use ndf_model::scalars::{ACTIVITIES, Channel, Extensions, NodeMesh, OWN_LEVELS, RISES, ScalarNumbers};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::error::ScalarError;
use super::values::{Drawn, Values};
use crate::settings::SettingsError;

/// How many bytes scalars on levels may take.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScalarBudget {
    /// As many as are worth their price: what a bit costs, in squares of the range of a channel.
    Price(f64),
    /// At most so many.
    Bytes(usize),
    /// As few as the root mean square error allows, a share of the ranges.
    Error(f64),
}

/// What a user may decide about scalars on levels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScalarLevelOptions {
    /// How many bytes they may take.
    pub budget: ScalarBudget,
    /// How often base faces are split; `None` for as often as there are enough nodes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub splits: Option<u32>,
    /// Seed of the samples.
    pub seed: u64,
}

impl Default for ScalarLevelOptions {
    fn default() -> Self {
        Self { budget: ScalarBudget::Price(PRICE), splits: None, seed: 0 }
    }
}

impl ScalarLevelOptions {
    /// Whether these options can be used.
    ///
    /// # Errors
    /// If they cannot.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let is_valid = match self.budget {
            ScalarBudget::Price(x) | ScalarBudget::Error(x) => x.is_finite() && x > 0.0,
            ScalarBudget::Bytes(bytes) => bytes > 0,
        };
        if is_valid { Ok(()) } else { Err(SettingsError::ScalarBudget) }
    }

    /// How often the faces of a base mesh are split.
    pub(super) fn splits(&self, base_faces: usize) -> u32 {
        self.splits.unwrap_or_else(|| (0..2).find(|s| base_faces << (2 * s) >= ENOUGH_FACES).unwrap_or(2))
    }
}

/// The price where nothing else is asked for.
const PRICE: f64 = 1e-9;
/// Split faces that are enough for smooth functions.
const ENOUGH_FACES: usize = 12_000;
/// What of a bump is less than this share of its height is left out of the descent.
const NEGLIGIBLE: f64 = 1e-3;
/// Columns that are made together.
const BATCH: usize = 16;
/// By what λ is multiplied at first.
const ANNEALING: f64 = 12.0;
/// Steps, as a multiple of those that λ suggests: errors of rounding are then worth a fifth of a bit.
const STEP_FACTOR: f64 = 1.0;
/// Sweeps at a price, and the share of them in which it falls.
const SWEEPS: usize = 16;
const FALLING: f64 = 0.6;
/// Prices that are tried to meet a budget.
const TRIALS: usize = 8;
/// What is aimed at, as a share of a budget, what is near enough to that, and by how much bolder every trial is.
const AIM: f64 = 0.985;
const CLOSE: f64 = 0.015;
const BOLDER: f64 = 1.5;
/// Bounds of prices.
const PRICES: [f64; 2] = [1e-16, 1e-2];
/// Classes of integers with a price: zero, and the numbers of bits of magnitudes.
const CLASSES: usize = 32;

/// The quadratic form of the errors of samples.
struct Target {
    mass: CsrMatrix<f64>,
    /// Of every channel, b and c.
    right: Vec<Vec<f64>>,
    squares: Vec<f64>,
}

impl Target {
    fn new(nodes: &NodeMesh, values: &Values, drawn: &Drawn) -> Self {
        let (count, channels) = (nodes.nesting.len(), values.channels.len());
        let share = 1.0 / drawn.points.len() as f64;
        let mut blocks = vec![[[0.0; 3]; 3]; nodes.faces().len()];
        let (mut right, mut squares) = (vec![vec![0.0; count]; channels], vec![0.0; channels]);
        let mut outputs = vec![0.0; channels];
        for (point, foot) in drawn.points.iter().zip(&drawn.feet) {
            let (face, weights) = nodes.locate(point);
            for (row, a) in blocks[face].iter_mut().zip(weights) {
                row.iter_mut().zip(weights).for_each(|(x, b)| *x += share * a * b);
            }
            values.outputs_at(foot, &mut outputs);
            for (k, &output) in outputs.iter().enumerate() {
                let output = f64::from(output);
                squares[k] += share * output * output;
                for (&node, weight) in nodes.faces()[face].iter().zip(weights) {
                    right[k][node as usize] += share * weight * output;
                }
            }
        }
        let mut mass = CooMatrix::new(count, count);
        for (face, block) in nodes.faces().iter().zip(&blocks) {
            for (&i, row) in face.iter().zip(block) {
                face.iter().zip(row).for_each(|(&j, &x)| mass.push(i as usize, j as usize, x));
            }
        }
        Self { mass: CsrMatrix::from(&mass), right, squares }
    }
}

/// What an integer does: the bump it adds to the nodes, and what that does to the gradient of D.
struct Column {
    bump: Vec<(u32, f32)>,
    moved: Vec<(u32, f32)>,
    curvature: f64,
}

/// Numbers of nodes, zero but for a few.
struct Sparse {
    values: Vec<f64>,
    is_set: Vec<bool>,
}

impl Sparse {
    fn new(count: usize) -> Self {
        Self { values: vec![0.0; count], is_set: vec![false; count] }
    }

    /// Adds to a number; whether it is the first time.
    fn add(&mut self, node: u32, x: f64) -> bool {
        self.values[node as usize] += x;
        !std::mem::replace(&mut self.is_set[node as usize], true)
    }

    fn take(&mut self, node: u32) -> f64 {
        self.is_set[node as usize] = false;
        std::mem::take(&mut self.values[node as usize])
    }
}

/// The columns of all nodes.
fn columns(nodes: &NodeMesh, extensions: &Extensions, mass: &CsrMatrix<f64>) -> Vec<Column> {
    let count = nodes.nesting.len();
    let finest = nodes.nesting.levels() - 1;
    let column = |sparse: &mut Sparse, bump: Vec<(u32, f32)>| {
        let mut touched = Vec::new();
        for &(i, x) in &bump {
            let row = mass.row(i as usize);
            for (&j, a) in row.col_indices().iter().zip(row.values()) {
                if sparse.add(j as u32, a * f64::from(x)) {
                    touched.push(j as u32);
                }
            }
        }
        let curvature = bump.iter().map(|&(i, x)| f64::from(x) * sparse.values[i as usize]).sum();
        let moved = touched.into_iter().map(|j| (j, sparse.take(j) as f32)).collect();
        Column { bump, moved, curvature }
    };
    let batch = |sparse: &mut Sparse, level: usize, ranks: &[usize]| {
        let mut bumps: Vec<Vec<(u32, f32)>> = ranks.iter().map(|&rank| vec![(rank as u32, 1.0)]).collect();
        if level < finest {
            let mut given = vec![0.0; nodes.nesting.level(level).end * ranks.len()];
            ranks.iter().enumerate().for_each(|(k, rank)| given[rank * ranks.len() + k] = 1.0);
            extensions.of_level(level).run(&given, ranks.len(), |rank, row| {
                for (bump, &x) in bumps.iter_mut().zip(row).filter(|(_, x)| x.abs() >= NEGLIGIBLE) {
                    bump.push((rank as u32, x as f32));
                }
            });
        }
        bumps.into_iter().map(|bump| column(sparse, bump)).collect::<Vec<_>>()
    };
    let of_level = |level: usize| {
        let ranks: Vec<usize> = nodes.nesting.level(level).collect();
        let batches = ranks.par_chunks(BATCH);
        let all = batches.map_init(|| Sparse::new(count), |sparse, ranks| batch(sparse, level, ranks));
        all.flatten_iter().collect::<Vec<_>>()
    };
    (0..=finest).flat_map(of_level).collect()
}

/// Bits of integers by context and class.
struct Prices(Vec<[f64; CLASSES]>);

impl Prices {
    fn new(channels: &[Descent]) -> Self {
        let mut counts = vec![[0.0; CLASSES]; OWN_LEVELS * ACTIVITIES];
        for channel in channels {
            for (&context, &q) in channel.contexts.iter().zip(&channel.integers) {
                counts[usize::from(context)][class(q)] += 1.0;
            }
        }
        // The prior: magnitudes as large as what is around them, or a little smaller.
        let price = |(context, counts): (usize, &[f64; CLASSES])| {
            let around = (context % ACTIVITIES) as f64 - 2.0;
            let prior = |c: usize| 0.02 + (-0.7 * (c as f64 - around.max(0.0)).abs()).exp();
            let total: f64 = counts.iter().enumerate().map(|(c, n)| n + prior(c)).sum();
            let mut bits = [0.0; CLASSES];
            for (c, (bits, count)) in bits.iter_mut().zip(counts).enumerate() {
                // A sign, and what is behind the leading bit.
                *bits = c as f64 - ((count + prior(c)) / total).log2();
            }
            bits
        };
        Self(counts.iter().enumerate().map(price).collect())
    }

    fn bits(&self, context: u8, q: i32) -> f64 {
        self.0[usize::from(context)][class(q)]
    }
}

fn class(q: i32) -> usize {
    (u32::BITS - q.unsigned_abs().leading_zeros()) as usize
}

/// The descent of a channel.
#[derive(Clone)]
struct Descent {
    integers: Vec<i32>,
    contexts: Vec<u8>,
    /// b − A u.
    residual: Vec<f64>,
    /// D.
    error: f64,
}

impl Descent {
    /// Contexts and residuals anew, for values of the nodes.
    fn update(&mut self, nodes: &NodeMesh, target: &Target, channel: usize, u: &[f64]) {
        for level in 0..nodes.nesting.levels() {
            for rank in nodes.nesting.level(level) {
                let context = nodes.context(level, rank, |r| self.integers[r].unsigned_abs());
                self.contexts[rank] = context as u8;
            }
        }
        self.error = target.squares[channel];
        for (i, b) in target.right[channel].iter().enumerate() {
            let row = target.mass.row(i);
            let moved = row.col_indices().iter().zip(row.values()).map(|(&j, a)| a * u[j]);
            self.residual[i] = b - moved.sum::<f64>();
            self.error -= u[i] * (b + self.residual[i]);
        }
    }

    /// One integer after the other.
    fn sweep(&mut self, nodes: &NodeMesh, columns: &[Column], steps: &[f64], prices: &Prices, lambda: f64) {
        for (level, &step) in steps.iter().enumerate() {
            for rank in nodes.nesting.level(level) {
                let (Column { bump, moved, curvature }, before) = (&columns[rank], self.integers[rank]);
                let context = self.contexts[rank];
                let slope: f64 = bump.iter().map(|&(i, x)| f64::from(x) * self.residual[i as usize]).sum();
                let best = f64::from(before) + slope / (curvature * step).max(f64::MIN_POSITIVE);
                let nearest = best.clamp(-MAX_INTEGER, MAX_INTEGER).round() as i32;
                let inwards = nearest.signum();
                let mut chosen = (f64::INFINITY, 0);
                for q in [0, nearest - 2 * inwards, nearest - inwards, nearest] {
                    let off = (f64::from(q) - best) * step;
                    let cost = curvature * off * off + lambda * prices.bits(context, q);
                    if cost < chosen.0 {
                        chosen = (cost, q);
                    }
                }
                if chosen.1 != before {
                    let change = step * f64::from(chosen.1 - before);
                    moved.iter().for_each(|&(i, x)| self.residual[i as usize] -= change * f64::from(x));
                    self.integers[rank] = chosen.1;
                }
            }
        }
    }
}

/// The largest integer.
const MAX_INTEGER: f64 = (1 << 20) as f64;

/// All that a run of descents needs.
pub(super) struct Levels<'a> {
    nodes: Arc<NodeMesh>,
    extensions: Extensions,
    channels: &'a [Channel],
    target: Target,
    columns: Vec<Column>,
    /// Values of the surface at the nodes, channel by channel for each.
    given: Vec<f64>,
    /// Root mean square of the bumps of every level.
    heights: Vec<f64>,
    pub(super) sweeps: usize,
}

/// What came out at a price.
#[derive(Clone)]
struct Found {
    fields: SurfaceScalars,
    bytes: usize,
    /// Root mean square, as a share of the ranges.
    rms: f64,
}

impl<'a> Levels<'a> {
    /// For these samples, and the values at the nodes themselves.
    pub(super) fn new(
        (nodes, extensions): (NodeMesh, Extensions),
        values: &'a Values,
        drawn: &Drawn,
        at_nodes: &Drawn,
    ) -> Self {
        let target = Target::new(&nodes, values, drawn);
        let columns = columns(&nodes, &extensions, &target.mass);
        let height = |level: usize| {
            let level = &columns[nodes.nesting.level(level)];
            let mean = level.iter().map(|c| c.curvature).sum::<f64>() / level.len() as f64;
            mean.sqrt().max(f64::from(f32::MIN_POSITIVE))
        };
        let heights = (0..nodes.nesting.levels()).map(height).collect();
        let channels = values.channels.as_slice();
        let mut row = vec![0.0; channels.len()];
        let mut given = Vec::with_capacity(columns.len() * channels.len());
        for foot in &at_nodes.feet {
            values.outputs_at(foot, &mut row);
            given.extend(row.iter().copied().map(f64::from));
        }
        Self { nodes: Arc::new(nodes), extensions, channels, target, columns, given, heights, sweeps: 0 }
    }

    /// The fields within a budget, or as near to it as can be.
    pub(super) fn run(
        &mut self,
        budget: ScalarBudget,
        progress: &dyn Progress,
    ) -> Result<SurfaceScalars, ScalarError> {
        let mut price = if let ScalarBudget::Price(price) = budget { price } else { PRICE };
        let mut found = self.at_price(price, progress)?;
        // (meets the budget, what is to be small)
        let judged = |found: &Found| match budget {
            ScalarBudget::Price(_) => (true, 0.0),
            ScalarBudget::Bytes(bytes) => (found.bytes <= bytes, found.rms),
            ScalarBudget::Error(rms) => (found.rms <= rms, found.bytes as f64),
        };
        let mut best = found.clone();
        // The prices next to the budget on either side, and how boldly the other side is looked for: sizes hardly
        // change with the price where little but names is left.
        let (mut bounds, mut boldness) = ([0.0, f64::INFINITY], 1.0);
        for _ in 1..TRIALS {
            let (too_cheap, ratio, power) = match budget {
                ScalarBudget::Price(_) => break,
                ScalarBudget::Bytes(bytes) => {
                    (found.bytes > bytes, found.bytes as f64 / (AIM * bytes as f64), 2.5)
                }
                ScalarBudget::Error(rms) => (found.rms <= rms, AIM * rms / found.rms.max(1e-12), 4.0),
            };
            if judged(&best).0 && judged(&found).0 && (ratio - 1.0).abs() < CLOSE {
                break;
            }
            bounds[usize::from(!too_cheap)] = price;
            price *= ratio.powf(boldness * power).clamp(0.05, 20.0);
            boldness *= BOLDER;
            if !(bounds[0]..bounds[1]).contains(&price) || price == bounds[0] {
                price = (bounds[0] * bounds[1]).sqrt();
            }
            price = price.clamp(PRICES[0], PRICES[1]);
            found = self.at_price(price, progress)?;
            let ((meets, cost), (best_meets, best_cost)) = (judged(&found), judged(&best));
            let is_better = match (meets, best_meets) {
                (true, true) => cost < best_cost,
                // Nearer to the budget is better as long as nothing meets it.
                (false, false) => match budget {
                    ScalarBudget::Bytes(_) => found.bytes < best.bytes,
                    _ => found.rms < best.rms,
                },
                (meets, _) => meets,
            };
            if is_better {
                best = found.clone();
            }
        }
        Ok(best.fields)
    }

    /// The integers with which nodes come as near as they can to the surface's values, one level after the other.
    fn interpolating(&self, steps: &[f64]) -> Vec<i32> {
        let channels = self.channels.len();
        let mut integers = Vec::with_capacity(self.given.len());
        let mut values: Vec<f64> = Vec::with_capacity(self.given.len());
        for (level, &step) in steps.iter().enumerate() {
            let ranks = self.nodes.nesting.level(level);
            let mut new = vec![0.0; ranks.len() * channels];
            if level > 0 {
                self.extensions.of_level(level - 1).run(&values, channels, |rank, row| {
                    if ranks.contains(&rank) {
                        new[(rank - ranks.start) * channels..][..channels].copy_from_slice(row);
                    }
                });
            }
            for (x, given) in new.iter_mut().zip(&self.given[ranks.start * channels..]) {
                let q = ((given - *x) / step).clamp(-MAX_INTEGER, MAX_INTEGER).round();
                integers.push(q as i32);
                *x += step * q;
            }
            values.extend(new);
        }
        integers
    }

    /// Sweeps at a price of bits.
    fn at_price(&mut self, price: f64, progress: &dyn Progress) -> Result<Found, ScalarError> {
        let (nodes, extensions) = (&*self.nodes, &self.extensions);
        let (columns, target) = (&self.columns, &self.target);
        // An integer of every level is worth as much.
        let wanted = self.heights.iter().map(|height| STEP_FACTOR * (price / 0.2).sqrt() / height);
        let wanted: Vec<f64> = wanted.collect();
        let least = wanted.iter().copied().fold(f64::INFINITY, f64::min) as f32;
        let rise = |step: &f64| (RISES * (step / f64::from(least)).log2()).round().clamp(0.0, 255.0) as u8;
        let mut numbers =
            ScalarNumbers { step: least, rises: wanted.iter().map(rise).collect(), integers: Vec::new() };
        let steps: Vec<f64> = (0..wanted.len()).map(|level| numbers.step_of(level)).collect();
        let integers = self.interpolating(&steps);
        let (count, channels) = (columns.len(), self.channels.len());
        let descent = |k: usize| Descent {
            integers: integers.iter().skip(k).step_by(channels).copied().collect(),
            contexts: vec![0; count],
            residual: vec![0.0; count],
            error: 0.0,
        };
        let mut descents: Vec<Descent> = (0..channels).map(descent).collect();
        let falling = FALLING * SWEEPS as f64;
        for sweep in 0..=SWEEPS {
            progress.check()?;
            progress.report("scalars", sweep as f64 / SWEEPS as f64);
            let mut values = Vec::with_capacity(count * channels);
            for (level, step) in steps.iter().enumerate() {
                let of_rank = |i| descents.iter().map(move |d| step * f64::from(d.integers[i]));
                values.extend(nodes.nesting.level(level).flat_map(of_rank));
            }
            extensions.accumulate(&nodes.nesting, &mut values, channels);
            descents.par_iter_mut().enumerate().for_each(|(k, d)| {
                let u: Vec<f64> = values.iter().skip(k).step_by(channels).copied().collect();
                d.update(nodes, target, k, &u);
            });
            if sweep < SWEEPS {
                let lambda = price * ANNEALING.powf((1.0 - sweep as f64 / falling).max(0.0));
                let prices = Prices::new(&descents);
                descents.par_iter_mut().for_each(|d| d.sweep(nodes, columns, &steps, &prices, lambda));
            }
        }
        self.sweeps += SWEEPS;
        let errors: f64 = descents.iter().map(|d| d.error.max(0.0)).sum();
        let rms = (errors / descents.len() as f64).sqrt();
        numbers.integers =
            (0..columns.len()).flat_map(|i| descents.iter().map(move |d| d.integers[i])).collect();
        progress.detail(&format!("error {:.3} %", 100.0 * rms));
        let fields =
            SurfaceScalars::levelled(self.channels.to_vec(), Arc::clone(&self.nodes), extensions, numbers)?;
        let bytes = fields.stored_bytes();
        Ok(Found { fields, bytes, rms })
    }
}
