//! Features on a multiresolution hash grid (Müller, Evans, Schied and Keller 2022), laid out as tiny-cuda-nn does.

use ndf_core::{BoundingBox, DVec3};

/// Factors of the spatial hash.
const PRIMES: [u32; 3] = [1, 2_654_435_761, 805_459_861];

/// The numbers a hash grid is built with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HashGridShape {
    /// Number of levels.
    pub levels: usize,
    /// Features a level.
    pub features: usize,
    /// Binary logarithm of the most entries of a level.
    pub log2_entries: u32,
    /// Resolution of the coarsest level.
    pub coarsest: f64,
    /// Ratio of the resolutions of neighbouring levels.
    pub growth: f64,
    /// Whether weights in a cell are smoothed to 3t² − 2t³.
    pub smooth: bool,
}

/// A level: how positions in `[0, 1]³` map to entries.
#[derive(Clone, Copy, Debug)]
struct Level {
    scale: f64,
    resolution: u32,
    entries: u32,
    is_hashed: bool,
    /// Where its entries begin, in numbers.
    offset: usize,
}

impl HashGridShape {
    /// The levels and the number of parameters of all; `None` if they are too many.
    fn levels(&self) -> Option<(Vec<Level>, usize)> {
        let sound = (1..=64).contains(&self.levels)
            && (1..=16).contains(&self.features)
            && (1..=24).contains(&self.log2_entries)
            && (1.0..=65536.0).contains(&self.coarsest)
            && (1.0..=4096.0).contains(&self.growth);
        if !sound {
            return None;
        }
        let mut offset = 0;
        let mut levels = Vec::new();
        for level in 0..self.levels {
            // In single precision, as the file's writer computed it.
            let scale = (level as f32 * self.growth.log2() as f32).exp2() * self.coarsest as f32 - 1.0;
            let resolution = (scale.ceil() + 1.0).min(1e6) as u32;
            let dense = u64::from(resolution).pow(3).next_multiple_of(8);
            let entries = dense.min(1 << self.log2_entries) as u32;
            let is_hashed = u64::from(resolution).pow(3) > u64::from(entries);
            levels.push(Level { scale: f64::from(scale), resolution, entries, is_hashed, offset });
            offset += entries as usize * self.features;
        }
        Some((levels, offset))
    }

    /// Number of features in all.
    pub fn parameters(&self) -> Option<usize> {
        self.levels().map(|(_, count)| count)
    }
}

/// A hash grid over a box.
#[derive(Clone, Debug)]
pub struct HashGrid {
    shape: HashGridShape,
    levels: Vec<Level>,
    features: Vec<f32>,
    /// From positions to `[0, 1]³`: the lowest corner of the box and the inverses of its sides.
    origin: DVec3,
    scale: DVec3,
}

impl HashGrid {
    /// A grid over a box; `None` if the features are not as many as the shape needs, or the box is empty.
    pub fn new(shape: HashGridShape, features: Vec<f32>, bounds: BoundingBox) -> Option<Self> {
        let (levels, count) = shape.levels()?;
        let sides = bounds.extent();
        let sound = count == features.len() && sides.is_finite() && sides.min_element() > 0.0;
        sound.then_some(Self { shape, levels, features, origin: bounds.min, scale: sides.recip() })
    }

    pub(super) fn width(&self) -> usize {
        self.shape.levels * self.shape.features
    }

    pub(super) fn parameters(&self) -> usize {
        self.features.len()
    }

    pub(super) fn is_finite(&self) -> bool {
        self.features.iter().all(|f| f.is_finite())
    }

    /// Writes the features at every point, by columns.
    pub(super) fn evaluate(&self, points: &[DVec3], y: &mut [f32]) {
        let (n, width) = (points.len(), self.shape.features);
        for (l, level) in self.levels.iter().enumerate() {
            for (i, &p) in points.iter().enumerate() {
                let cell = self.cell(level, p);
                for f in 0..width {
                    let sum: f64 =
                        (0..8).map(|c| cell.weight(c) * f64::from(self.feature(level, &cell, c, f))).sum();
                    y[(l * width + f) * n + i] = sum as f32;
                }
            }
        }
    }

    /// Adds to the gradients what the adjoints of the features amount to.
    pub(super) fn pull_back(&self, points: &[DVec3], adjoint: &[f32], gradients: &mut [DVec3]) {
        let (n, width) = (points.len(), self.shape.features);
        for (l, level) in self.levels.iter().enumerate() {
            for (i, (&p, gradient)) in points.iter().zip(&mut *gradients).enumerate() {
                let cell = self.cell(level, p);
                for f in 0..width {
                    let a = f64::from(adjoint[(l * width + f) * n + i]);
                    for c in 0..8 {
                        *gradient += a * f64::from(self.feature(level, &cell, c, f)) * cell.slope(c);
                    }
                }
            }
        }
    }

    fn cell(&self, level: &Level, p: DVec3) -> Cell {
        let per_unit = self.scale * level.scale;
        let place = (p - self.origin) * per_unit + 0.5;
        let low = place.floor();
        let t = place - low;
        let (weights, slopes) = if self.shape.smooth {
            (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) * per_unit)
        } else {
            (t, per_unit)
        };
        // As unsigned numbers that wrap around, as on the device; NaN is 0.
        let low = low.to_array().map(|x| x as i64 as u32);
        Cell { low, weights, slopes }
    }

    fn feature(&self, level: &Level, cell: &Cell, corner: usize, feature: usize) -> f32 {
        let place = [0, 1, 2].map(|k| cell.low[k].wrapping_add((corner >> k & 1) as u32));
        let index = if level.is_hashed {
            place.into_iter().zip(PRIMES).fold(0, |hash, (x, prime)| hash ^ x.wrapping_mul(prime))
        } else {
            let r = level.resolution;
            place[0]
                .wrapping_add(place[1].wrapping_mul(r))
                .wrapping_add(place[2].wrapping_mul(r.wrapping_mul(r)))
        } % level.entries;
        self.features[level.offset + index as usize * self.shape.features + feature]
    }
}

/// The cell around a point.
struct Cell {
    low: [u32; 3],
    weights: DVec3,
    slopes: DVec3,
}

impl Cell {
    fn part(&self, corner: usize, axis: usize) -> f64 {
        if corner >> axis & 1 == 1 { self.weights[axis] } else { 1.0 - self.weights[axis] }
    }

    fn weight(&self, corner: usize) -> f64 {
        self.part(corner, 0) * self.part(corner, 1) * self.part(corner, 2)
    }

    /// Gradient of the weight.
    fn slope(&self, corner: usize) -> DVec3 {
        let [x, y, z] = [0, 1, 2].map(|axis| self.part(corner, axis));
        let sign = |axis: usize| if corner >> axis & 1 == 1 { self.slopes[axis] } else { -self.slopes[axis] };
        DVec3::new(sign(0) * y * z, x * sign(1) * z, x * y * sign(2))
    }
}
