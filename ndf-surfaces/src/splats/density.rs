//! The density of splats as a scalar field.

use ndf_core::{BoundingBox, DVec3, ImplicitField, Inside};
use ndf_mesh::hierarchy::{Child, Hierarchy};
use rayon::prelude::*;

use ndf_formats::splats::Splat;

use super::merging::merged;

/// How splats become a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DensityOptions {
    /// The least standard deviation, in diagonals of the object: splats of a trained scene are often flat as paper,
    /// which leaves two surfaces at no distance, and gaps.
    pub least_scale: f64,
    /// Splats fainter than this are left out.
    pub least_opacity: f32,
    /// The share of the splats, on either side of every axis, that may lie outside the object's box: floaters.
    pub outliers: f64,
}

impl Default for DensityOptions {
    fn default() -> Self {
        Self { least_scale: 1.0 / 200.0, least_opacity: 0.05, outliers: 0.005 }
    }
}

/// What became of the splats of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SplatReport {
    /// Splats that make the density.
    pub kept: usize,
    /// With a number that is not finite or makes no sense.
    pub unsound: usize,
    /// Too faint.
    pub faint: usize,
    /// Far from the others, or larger than half the object.
    pub floaters: usize,
    /// What those kept were merged into; as many, unless there are very many.
    pub merged: usize,
}

/// Where a Gaussian ends, in standard deviations.
const RADIUS: f64 = 4.0;
/// Gaussians in a leaf of the tree.
const LEAF: usize = 4;
/// Splats at whose centres the typical density is looked at, at most.
const LOOKS: usize = 20_000;
/// Splats from which small ones are merged.
const LARGE: usize = 1 << 17;
/// Opacity from which a splat is taken for a piece of surface.
const OPAQUE: f32 = 0.5;

/// Level of the meshes of SuGaR.
const MESH_LEVEL: f64 = 0.3;
/// The share of the centres at which the density may be less than the sheet's.
const THIN: f64 = 0.01;

/// Which rule gave the level of splats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplatRule {
    /// That of SuGaR's meshes.
    Sugar,
    /// Half the typical density of opaque splats, which is less.
    HalfTypical,
    /// Above these: the splats form an even sheet.
    EvenSheet,
}

/// A Gaussian ready for evaluation: `opacity · exp(−½ ‖A (x − center)‖²)`.
#[derive(Clone, Copy, Debug)]
struct Gaussian {
    center: DVec3,
    /// Rows of A.
    inverse: [[f32; 3]; 3],
    opacity: f32,
}

/// The sum of the Gaussians of splats (Guédon and Lepetit 2024, Eq. 3), each cut off at four standard deviations and
/// lowered by its value there, so that the sum is continuous. Where no Gaussian reaches, the value is negative: minus
/// the distance to the nearest centre in least standard deviations, so that the gradient shows the way to the object.
///
/// **The level** is, unless another is set, that of SuGaR's meshes, 0.3, or half the median density at the centres of
/// opaque splats where that is less: far out on the slope of the sheet that the splats of a surface form, so that the
/// uneven sheets of trained scenes have no holes. Where sheets are even it is as much more as the density that all but a
/// hundredth of the centres exceed is above half the median: half the median where all are alike.
#[derive(Clone, Debug)]
pub struct SplatDensity {
    gaussians: Vec<Gaussian>,
    /// Over the boxes the Gaussians reach to.
    tree: Hierarchy,
    /// Over their centres.
    centers: Hierarchy,
    /// The least standard deviation.
    least: f64,
    bounds: BoundingBox,
    level: f64,
    rule: Option<SplatRule>,
    /// The median density at the centres of opaque splats.
    typical: f64,
    report: SplatReport,
}

/// No splat is left to make a density of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no splat is opaque and finite enough to make a surface")]
pub struct NoSplats;

impl SplatDensity {
    /// The density of splats. O(n log n). Of more than a hundred thousand, those no larger than the least scale are merged where they
    /// are closer together than that.
    ///
    /// # Errors
    /// If no splat is left.
    pub fn new(splats: &[Splat], options: &DensityOptions) -> Result<Self, NoSplats> {
        let mut report = SplatReport::default();
        let sound: Vec<&Splat> = splats.iter().filter(|splat| splat.is_sound()).collect();
        report.unsound = splats.len() - sound.len();
        let opaque: Vec<&Splat> =
            sound.iter().copied().filter(|splat| splat.opacity >= options.least_opacity).collect();
        report.faint = sound.len() - opaque.len();
        let core = core_box(&opaque, options.outliers).ok_or(NoSplats)?;
        let bounds = core.padded(0.05 * core.diagonal());
        let diagonal = bounds.diagonal();
        let in_place = |splat: &&&Splat| {
            let center = DVec3::from_array(splat.center);
            let largest = f64::from(splat.scales.into_iter().fold(0.0, f32::max));
            bounds.distance_squared(center) == 0.0 && largest < 0.25 * diagonal
        };
        let kept: Vec<&Splat> = opaque.iter().filter(in_place).copied().collect();
        report.floaters = opaque.len() - kept.len();
        report.kept = kept.len();
        if kept.is_empty() || !(diagonal > 0.0 && diagonal.is_finite()) {
            return Err(NoSplats);
        }
        let least = options.least_scale * diagonal;
        let gaussians = |splats: Vec<&Splat>| splats.par_iter().map(|splat| gaussian(splat, least)).unzip();
        let (gaussians, boxes): (Vec<Gaussian>, Vec<BoundingBox>) = if kept.len() > LARGE && least > 0.0 {
            gaussians(merged(&kept, least).iter().collect())
        } else {
            gaussians(kept.clone())
        };
        report.merged = gaussians.len();
        let tree = Hierarchy::new(&boxes, LEAF);
        let bounds =
            BoundingBox { min: bounds.min.max(tree.bounds().min), max: bounds.max.min(tree.bounds().max) };
        let points: Vec<BoundingBox> =
            gaussians.iter().map(|g| BoundingBox { min: g.center, max: g.center }).collect();
        let centers = Hierarchy::new(&points, LEAF);
        // A length to measure by, also where splats keep their own scales.
        let least = least.max(1e-3 * diagonal);
        let (level, typical, rule) = (0.0, 0.0, None);
        let density = Self { gaussians, tree, centers, least, bounds, level, rule, typical, report };
        let [thin, typical] = density.densities_at_centers(&kept);
        let (half, even) = (0.5 * typical, thin - 0.5 * typical);
        let (level, rule) =
            if half < MESH_LEVEL { (half, SplatRule::HalfTypical) } else { (MESH_LEVEL, SplatRule::Sugar) };
        let (level, rule) = if even > level { (even, SplatRule::EvenSheet) } else { (level, rule) };
        Ok(Self { level, typical, rule: Some(rule), ..density })
    }

    /// The same field with another level.
    #[must_use]
    pub fn with_level(self, level: f64) -> Self {
        Self { level, rule: None, ..self }
    }

    /// The rule by which the level was chosen, unless it was set.
    pub fn level_rule(&self) -> Option<SplatRule> {
        self.rule
    }

    /// What became of the splats.
    pub fn report(&self) -> SplatReport {
        self.report
    }

    /// How far outside of the middle of a typical sheet of splats the level lies, by the width that flat splats are
    /// raised to. 0 where it is not reached there.
    pub fn offset(&self) -> f64 {
        self.least * (2.0 * (self.typical / self.level).ln()).max(0.0).sqrt()
    }

    /// The density at the centres of opaque splats, or of all if none is opaque: what all but a hundredth exceed, and
    /// the median.
    fn densities_at_centers(&self, splats: &[&Splat]) -> [f64; 2] {
        let center = |splat: &&Splat| DVec3::from_array(splat.center);
        let opaque: Vec<DVec3> = splats.iter().filter(|splat| splat.opacity >= OPAQUE).map(center).collect();
        let all = || splats.iter().map(center).collect();
        let centers = if opaque.is_empty() { all() } else { opaque };
        let looked_at: Vec<DVec3> = centers.iter().step_by(centers.len().div_ceil(LOOKS)).copied().collect();
        let mut values: Vec<f64> = looked_at.par_iter().map(|&p| self.at(p)).collect();
        [THIN, 0.5].map(|share| {
            let rank = (share * values.len() as f64) as usize;
            *values.select_nth_unstable_by(rank, f64::total_cmp).1
        })
    }

    /// Calls for every Gaussian that reaches a point, with the offset in its own units and what it adds.
    fn each_at(&self, p: DVec3, mut each: impl FnMut(&Gaussian, [f64; 3], f64)) {
        let floor = (-0.5 * RADIUS * RADIUS).exp();
        let mut open = vec![0_u32];
        while let Some(node) = open.pop() {
            let Some(node) = self.tree.nodes().get(node as usize) else { continue };
            for (child, bounds) in node.children.iter().zip(&node.boxes) {
                if bounds.distance_squared(p) > 0.0 {
                    continue;
                }
                match *child {
                    Child::Empty => {}
                    Child::Node(node) => open.push(node),
                    Child::Leaf { start, end } => {
                        for &i in &self.tree.order()[start as usize..end as usize] {
                            let gaussian = &self.gaussians[i as usize];
                            let r = p - gaussian.center;
                            let u = gaussian.inverse.map(|row| {
                                f64::from(row[0]) * r.x + f64::from(row[1]) * r.y + f64::from(row[2]) * r.z
                            });
                            let square: f64 = u.iter().map(|x| x * x).sum();
                            if square < RADIUS * RADIUS {
                                let height = (-0.5 * square).exp();
                                each(gaussian, u, f64::from(gaussian.opacity) * (height - floor));
                            }
                        }
                    }
                }
            }
        }
    }

    /// The centre nearest to a finite point.
    fn nearest_center(&self, p: DVec3) -> DVec3 {
        let (mut best, mut square) = (self.gaussians[0].center, f64::INFINITY);
        let mut open = vec![(0.0, 0_u32)];
        while let Some((at_least, node)) = open.pop() {
            if at_least >= square {
                continue;
            }
            let node = &self.centers.nodes()[node as usize];
            let mut below: Vec<(f64, u32)> = Vec::new();
            for (child, bounds) in node.children.iter().zip(&node.boxes) {
                match *child {
                    Child::Empty => {}
                    Child::Node(node) => below.push((bounds.distance_squared(p), node)),
                    Child::Leaf { start, end } => {
                        for &i in &self.centers.order()[start as usize..end as usize] {
                            let center = self.gaussians[i as usize].center;
                            if center.distance_squared(p) < square {
                                (best, square) = (center, center.distance_squared(p));
                            }
                        }
                    }
                }
            }
            // The nearest is looked at first.
            below.sort_by(|a, b| b.0.total_cmp(&a.0));
            open.extend(below);
        }
        best
    }

    fn at(&self, p: DVec3) -> f64 {
        if !p.is_finite() {
            return f64::NAN;
        }
        let mut sum = 0.0;
        self.each_at(p, |_, _, height| sum += height);
        if sum > 0.0 { sum } else { -p.distance(self.nearest_center(p)) / self.least }
    }

    fn with_gradient_at(&self, p: DVec3) -> (f64, DVec3) {
        if !p.is_finite() {
            return (f64::NAN, DVec3::NAN);
        }
        let floor = (-0.5 * RADIUS * RADIUS).exp();
        let (mut sum, mut gradient) = (0.0, DVec3::ZERO);
        self.each_at(p, |gaussian, u, height| {
            sum += height;
            // The derivative is that of the Gaussian before it was lowered.
            let slope = height + f64::from(gaussian.opacity) * floor;
            for (row, u) in gaussian.inverse.iter().zip(u) {
                gradient -= slope * u * DVec3::from_array(row.map(f64::from));
            }
        });
        if sum > 0.0 {
            return (sum, gradient);
        }
        let away = p - self.nearest_center(p);
        (-away.length() / self.least, -away.normalize_or_zero() / self.least)
    }
}

/// The box between the quantiles of the centres along each axis.
fn core_box(splats: &[&Splat], outliers: f64) -> Option<BoundingBox> {
    let skipped = (outliers.clamp(0.0, 0.49) * splats.len() as f64) as usize;
    let mut bounds = BoundingBox::EMPTY;
    for axis in 0..3 {
        let mut places: Vec<f64> = splats.iter().map(|splat| splat.center[axis]).collect();
        places.sort_unstable_by(f64::total_cmp);
        bounds.min[axis] = *places.get(skipped)?;
        bounds.max[axis] = *places.get(places.len() - 1 - skipped)?;
    }
    Some(bounds)
}

/// A splat with its scales raised to `least`, and the box around it.
fn gaussian(splat: &Splat, least: f64) -> (Gaussian, BoundingBox) {
    let axes = splat.axes();
    let scales = splat.scales.map(|s| f64::from(s).max(least));
    let center = DVec3::from_array(splat.center);
    let mut inverse = [[0.0; 3]; 3];
    let mut variances = DVec3::ZERO;
    for ((row, axis), scale) in inverse.iter_mut().zip(axes).zip(scales) {
        *row = (axis / scale).as_vec3().to_array();
        variances += (axis * scale) * (axis * scale);
    }
    let reach = RADIUS * variances.map(f64::sqrt);
    let bounds = BoundingBox { min: center - reach, max: center + reach };
    (Gaussian { center, inverse, opacity: splat.opacity }, bounds)
}

impl ImplicitField for SplatDensity {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        points.iter().zip(values).for_each(|(&p, v)| *v = self.at(p));
    }

    fn gradients(&self, points: &[DVec3], gradients: &mut [DVec3]) {
        points.iter().zip(gradients).for_each(|(&p, g)| *g = self.with_gradient_at(p).1);
    }

    fn values_and_gradients(&self, points: &[DVec3], values: &mut [f64], gradients: &mut [DVec3]) {
        for ((&p, v), g) in points.iter().zip(values).zip(gradients) {
            (*v, *g) = self.with_gradient_at(p);
        }
    }

    fn bounds(&self) -> BoundingBox {
        self.bounds
    }

    fn level(&self) -> f64 {
        self.level
    }

    fn inside(&self) -> Inside {
        Inside::Above
    }
}
