//! Sampling a field where it is needed, from coarse cubes to fine ones.

use std::time::Instant;

use ndf_core::{DVec3, ImplicitField, Part, Progress};
use ndf_mesh::TriangleMesh;
use rayon::prelude::*;

use super::cubic::Cubic;
use super::{ABSENT, BandError, BandOptions, BandReport, CUBE, NarrowBand};

/// Points handed to the field at a time.
const BATCH: usize = 512;
/// The most cubes along an axis before any is halved.
const MOST_COUNTS: f64 = 1024.0;
/// Where, in a cube, the interpolant is compared with the field.
const PROBES: [DVec3; 4] = [
    DVec3::new(0.25, 0.25, 0.25),
    DVec3::new(0.75, 0.75, 0.25),
    DVec3::new(0.75, 0.25, 0.75),
    DVec3::new(0.25, 0.75, 0.75),
];
/// A band in the making.
pub(super) struct Filling<'a, F> {
    field: &'a F,
    options: BandOptions,
    band: NarrowBand<()>,
}

/// A cube to be sampled: its node, and its lowest corner in units of the smallest side.
#[derive(Clone, Copy)]
struct Cell {
    node: u32,
    low: [u32; 3],
}

/// What is known of a cube once it is sampled.
struct Sampled {
    cubic: Cubic,
    /// Whether the level may cross it.
    is_near: bool,
}

impl NarrowBand<()> {
    pub(super) fn with_field<F>(self, field: F) -> NarrowBand<F> {
        let Self { field: (), origin, side, counts, roots, nodes, cubes, report } = self;
        NarrowBand { field, origin, side, counts, roots, nodes, cubes, report }
    }
}

impl<'a, F: ImplicitField> Filling<'a, F> {
    /// Nothing sampled yet; roots for all the largest cubes near the mesh.
    pub(super) fn new(field: &'a F, mesh: &TriangleMesh, options: &BandOptions) -> Result<Self, BandError> {
        let side = options.coarsest;
        let bounds = mesh.bounds().padded(options.width);
        let spans = (bounds.extent() / side).ceil() + 1.0;
        let fits = bounds.min.is_finite() && (0..3).all(|k| (1.0..=MOST_COUNTS).contains(&spans[k]));
        if mesh.face_count() == 0 || !fits {
            return Err(BandError::Extent);
        }
        let counts = spans.to_array().map(|n| n as u32);
        let origin = bounds.center() - 0.5 * side * spans;
        let mut roots = vec![ABSENT; counts.iter().map(|&n| n as usize).product()];
        for face in mesh.face_indices() {
            let [a, b, c] = mesh.corner_positions(face);
            let cell = |p: DVec3| ((p - origin) / side).to_array().map(|t| t.floor().max(0.0) as u32);
            let low = cell(a.min(b).min(c) - options.width);
            let high = cell(a.max(b).max(c) + options.width);
            for z in low[2]..=high[2].min(counts[2] - 1) {
                for y in low[1]..=high[1].min(counts[1] - 1) {
                    for x in low[0]..=high[0].min(counts[0] - 1) {
                        roots[(x + counts[0] * (y + counts[1] * z)) as usize] = 0;
                    }
                }
            }
        }
        let report =
            BandReport { cubes: 0, finest: side, values: 0, gradients: 0, unresolved: 0.0, seconds: 0.0 };
        let band = NarrowBand {
            field: (),
            origin,
            side,
            counts,
            roots,
            nodes: Vec::new(),
            cubes: Vec::new(),
            report,
        };
        let halvings = options.halvings.min(10);
        Ok(Self { field, options: BandOptions { halvings, ..*options }, band })
    }

    /// Samples all there is, level by level.
    pub(super) fn fill(mut self, progress: &dyn Progress) -> Result<NarrowBand<()>, BandError> {
        let started = Instant::now();
        let mut cells = self.roots();
        let (mut near, mut unresolved) = (0, 0);
        for depth in 0..=self.options.halvings {
            if cells.is_empty() {
                break;
            }
            self.band.report.finest = self.side(depth);
            // How many cubes will be halved is not known before; every size counts as the same amount of work.
            let share =
                |sizes: u32, part: f64| (f64::from(sizes) + part) / f64::from(self.options.halvings + 1);
            let parts = [share(depth, 0.0), share(depth, 0.7), share(depth, 1.0)];
            let sampled = self.sample(&cells, depth, &Part::new(progress, parts[0], parts[1]))?;
            let coarse =
                self.too_coarse(&cells, &sampled, depth, &Part::new(progress, parts[1], parts[2]))?;
            let halved = coarse.iter().filter(|&&coarse| coarse).count();
            let may_halve = depth < self.options.halvings
                && self.band.cubes.len() + cells.len() + 7 * halved <= self.options.most_cubes;
            let half = 1 << (self.options.halvings - depth).saturating_sub(1);
            let mut parts = Vec::new();
            for ((cell, sampled), coarse) in cells.iter().zip(sampled).zip(coarse) {
                if coarse && may_halve {
                    self.band.nodes[cell.node as usize] = self.band.nodes.len() as u32;
                    for part in 0..8 {
                        let low = [0, 1, 2].map(|k| cell.low[k] + half * (part >> k & 1));
                        parts.push(Cell { node: self.band.nodes.len() as u32, low });
                        self.band.nodes.push(ABSENT);
                    }
                } else {
                    near += usize::from(sampled.is_near);
                    unresolved += usize::from(coarse);
                    self.band.nodes[cell.node as usize] = CUBE | self.band.cubes.len() as u32;
                    self.band.cubes.push(sampled.cubic);
                }
            }
            cells = parts;
        }
        let report = &mut self.band.report;
        report.cubes = self.band.cubes.len();
        report.unresolved = unresolved as f64 / f64::from(near.max(1) as u32);
        report.seconds = started.elapsed().as_secs_f64();
        progress.report("sampling the field", 1.0);
        Ok(self.band)
    }

    /// Numbers the roots.
    fn roots(&mut self) -> Vec<Cell> {
        let [nx, ny, _] = self.band.counts;
        let unit = 1 << self.options.halvings;
        let mut cells = Vec::new();
        for (i, root) in self.band.roots.iter_mut().enumerate().filter(|(_, root)| **root != ABSENT) {
            *root = cells.len() as u32;
            let i = i as u32;
            let low = [i % nx, i / nx % ny, i / nx / ny].map(|x| unit * x);
            cells.push(Cell { node: *root, low });
        }
        self.band.nodes = vec![ABSENT; cells.len()];
        cells
    }

    fn side(&self, depth: u32) -> f64 {
        self.options.coarsest / f64::from(1_u32 << depth)
    }

    fn place(&self, [x, y, z]: [u32; 3]) -> DVec3 {
        let unit = self.side(self.options.halvings);
        self.band.origin + unit * DVec3::new(f64::from(x), f64::from(y), f64::from(z))
    }

    /// Samples the corners of some cubes of a size, each once.
    fn sample(
        &mut self,
        cells: &[Cell],
        depth: u32,
        progress: &dyn Progress,
    ) -> Result<Vec<Sampled>, BandError> {
        let span = 1 << (self.options.halvings - depth);
        let corner = |cell: &Cell, i: u32| [0, 1, 2].map(|k| cell.low[k] + span * (i >> k & 1));
        let key = |[x, y, z]: [u32; 3]| u64::from(x) | u64::from(y) << 21 | u64::from(z) << 42;
        let mut keys: Vec<u64> =
            cells.par_iter().flat_map_iter(|cell| (0..8).map(move |i| key(corner(cell, i)))).collect();
        keys.par_sort_unstable();
        keys.dedup();
        let coordinate = |key: u64, k: u32| (key >> (21 * k) & 0x1f_ffff) as u32;
        let points: Vec<DVec3> =
            keys.iter().map(|&key| self.place([0, 1, 2].map(|k| coordinate(key, k)))).collect();
        let corners = self.in_batches(&points, progress, |field, points| {
            let (mut values, mut gradients) = (vec![0.0; points.len()], vec![DVec3::ZERO; points.len()]);
            field.values_and_gradients(points, &mut values, &mut gradients);
            values.into_iter().zip(gradients).collect()
        })?;
        self.band.report.gradients += points.len();
        let (side, level) = (self.side(depth), self.field.level());
        let at = |cell: &Cell, i: u32| {
            corners[keys.binary_search(&key(corner(cell, i))).expect("all corners are sampled")]
        };
        let sampled = |cell: &Cell| {
            let corners: [(f64, DVec3); 8] = std::array::from_fn(|i| at(cell, i as u32));
            Sampled { cubic: Cubic::new(corners, side, level), is_near: is_near(&corners, side, level) }
        };
        Ok(cells.par_iter().map(sampled).collect())
    }

    /// Which of the cubes differ too much from the field.
    fn too_coarse(
        &mut self,
        cells: &[Cell],
        sampled: &[Sampled],
        depth: u32,
        progress: &dyn Progress,
    ) -> Result<Vec<bool>, BandError> {
        let side = self.side(depth);
        let near: Vec<usize> = (0..cells.len()).filter(|&i| sampled[i].is_near).collect();
        let probes: Vec<DVec3> =
            near.iter().flat_map(|&i| PROBES.map(|t| self.place(cells[i].low) + side * t)).collect();
        let values = self.in_batches(&probes, progress, |field, points| {
            let mut values = vec![0.0; points.len()];
            field.values(points, &mut values);
            values
        })?;
        self.band.report.values += probes.len();
        let (level, tolerance) = (self.field.level(), self.options.tolerance);
        let mut coarse = vec![false; cells.len()];
        for (&i, values) in near.iter().zip(values.chunks_exact(PROBES.len())) {
            let differs = |(t, &value): (DVec3, &f64)| {
                let (guess, gradient) = sampled[i].cubic.value_and_gradient(t);
                // The slope there, and where that vanishes, at least the one that led to the level within a side.
                let slope = gradient.length().max((value - level).abs() / side);
                // What is not finite is too coarse.
                let fits = (guess - value).abs() <= tolerance * slope;
                !fits
            };
            coarse[i] = PROBES.into_iter().zip(values).any(differs);
        }
        Ok(coarse)
    }

    /// Asks the field at many points, in batches over all threads.
    fn in_batches<T: Send + Clone>(
        &self,
        points: &[DVec3],
        progress: &dyn Progress,
        ask: impl Fn(&F, &[DVec3]) -> Vec<T> + Sync,
    ) -> Result<Vec<T>, BandError> {
        let mut answers = Vec::with_capacity(points.len());
        // Large portions, so that somebody who waits can be told and can stop it.
        let portion = 64 * BATCH;
        for (done, part) in points.chunks(portion).enumerate() {
            if progress.cancelled() {
                return Err(BandError::Cancelled);
            }
            progress.report("sampling the field", (done * portion) as f64 / points.len() as f64);
            let batches: Vec<Vec<T>> = part.par_chunks(BATCH).map(|batch| ask(self.field, batch)).collect();
            answers.extend(batches.into_iter().flatten());
        }
        Ok(answers)
    }
}

/// Whether the level may cross a cube with these corners: there are values on both sides, or one is so close to the
/// level that its gradient leads there within half a diagonal, as far as any point of the cube is from a corner. Where
/// a corner is not finite the field is asked anyway.
fn is_near(corners: &[(f64, DVec3); 8], side: f64, level: f64) -> bool {
    if !corners.iter().all(|(v, g)| v.is_finite() && g.is_finite()) {
        return false;
    }
    let below = corners.iter().filter(|(v, _)| *v < level).count();
    let half_diagonal = 0.75_f64.sqrt() * side;
    let close = |&(v, g): &(f64, DVec3)| (v - level).abs() <= half_diagonal * g.length();
    (below != 0 && below != 8) || corners.iter().any(close)
}
