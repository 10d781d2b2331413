//! Planes fitted to the neighbours of every point: directions, spacing, noise, outliers.

use ndf_core::DVec3;
use rayon::prelude::*;

use super::eigen::symmetric_eigen;
use super::neighbours::Neighbours;

/// Neighbours a plane is fitted to.
const NEIGHBOURS: usize = 16;

/// The nearest of them, to which a second plane is fitted to tell noise from curvature.
const NEAREST: usize = 8;

/// A point counts as an outlier if its neighbours are this many times farther away than theirs are.
const LONELY: f64 = 3.0;

/// Pairs of neighbours looked at to judge normals.
const JUDGED: usize = 4000;

/// What the neighbours of every point tell.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalPlanes {
    /// Unit normals of the planes, of either sign.
    pub normals: Vec<DVec3>,
    /// Distance to the next point, in the mean around each point: the square root of the area a neighbour takes.
    pub spacings: Vec<f64>,
    /// Estimates of the variance of the noise around each point; below zero by chance where there is none.
    pub variances: Vec<f64>,
    /// Whether each point is much farther from its neighbours than they are from each other.
    pub outliers: Vec<bool>,
}

impl LocalPlanes {
    /// Fits planes to the 16 nearest neighbours of every point, by least squares (Hoppe et al. 1992). O(n log n) on
    /// all threads.
    pub fn new(positions: &[DVec3], neighbours: &Neighbours) -> Self {
        let near: Vec<Vec<u32>> = positions
            .par_iter()
            .map(|&p| neighbours.nearest(p, NEIGHBOURS + 1).iter().map(|n| n.index).collect())
            .collect();
        let fits: Vec<(DVec3, f64, f64)> =
            (positions, &near).into_par_iter().map(|(&p, near)| fit(p, positions, near)).collect();
        let spacings: Vec<f64> = fits.iter().map(|fit| fit.1).collect();
        let outliers = near
            .par_iter()
            .enumerate()
            .map(|(i, near)| {
                let mut theirs: Vec<f64> = near.iter().map(|&j| spacings[j as usize]).collect();
                spacings[i] > LONELY * median(&mut theirs)
            })
            .collect();
        Self {
            normals: fits.iter().map(|fit| fit.0).collect(),
            variances: fits.iter().map(|fit| fit.2).collect(),
            spacings,
            outliers,
        }
    }

    /// The median of the spacings.
    pub fn spacing(&self) -> f64 {
        median(&mut self.spacings.clone())
    }

    /// An estimate of the standard deviation of the noise, from the median of the variances.
    pub fn noise(&self) -> f64 {
        median(&mut self.variances.clone()).max(0.0).sqrt()
    }
}

/// Normal of the plane, spacing, and variance of the noise.
///
/// Noise leaves all planes the same variance, curvature one that grows with the fourth power of the radius, which is the
/// square of the number of neighbours: two planes tell the two apart.
fn fit(p: DVec3, positions: &[DVec3], near: &[u32]) -> (DVec3, f64, f64) {
    let radius = near.iter().map(|&j| positions[j as usize].distance(p)).fold(0.0, f64::max);
    let spacing = radius * (std::f64::consts::PI / near.len().max(1) as f64).sqrt();
    let (normal, far) = plane(p, positions, near);
    let nearest = &near[..near.len().min(NEAREST + 1)];
    let (_, close) = plane(p, positions, nearest);
    let growth = (near.len() as f64 / nearest.len().max(1) as f64).powi(2);
    let variance = if growth > 1.0 { (growth * close - far) / (growth - 1.0) } else { close };
    (normal, spacing, variance)
}

/// Normal of a plane and variance of the points from it, by the degrees of freedom that it leaves them.
fn plane(p: DVec3, positions: &[DVec3], near: &[u32]) -> (DVec3, f64) {
    let offsets = || near.iter().map(|&j| positions[j as usize] - p);
    let count = near.len().max(1) as f64;
    let mean = offsets().sum::<DVec3>() / count;
    let mut columns = [DVec3::ZERO; 3];
    for d in offsets().map(|d| d - mean) {
        for (column, x) in columns.iter_mut().zip(d.to_array()) {
            *column += x * d / (count - 3.0).max(1.0);
        }
    }
    let (values, vectors) = symmetric_eigen(columns);
    (vectors[0].normalize(), values[0].max(0.0))
}

/// The share of neighbouring points whose normals point to the same side: near 1 for normals that are oriented, about
/// ½ for normals whose signs are random. Normals at right angles are left out.
///
/// # Panics
/// If there is not one normal for each point.
pub fn agreement_of_normals(positions: &[DVec3], normals: &[DVec3], neighbours: &Neighbours) -> f64 {
    assert_eq!(positions.len(), normals.len());
    let picked = (0..positions.len()).step_by(positions.len().div_ceil(JUDGED).max(1));
    let (mut agree, mut all) = (0_usize, 0_usize);
    for i in picked {
        for near in neighbours.nearest(positions[i], 5) {
            let cosine = normals[i].dot(normals[near.index as usize]);
            if near.index as usize != i && cosine.abs() > 0.2 {
                agree += usize::from(cosine > 0.0);
                all += 1;
            }
        }
    }
    if all == 0 { 0.0 } else { agree as f64 / all as f64 }
}

/// The median, or 0 of nothing.
pub(super) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sphere(count: usize, noise: f64) -> Vec<DVec3> {
        // A Fibonacci lattice, with deterministic noise along the radius.
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        (0..count)
            .map(|i| {
                let z = 1.0 - 2.0 * (i as f64 + 0.5) / count as f64;
                let (sin, cos) = (golden * i as f64).sin_cos();
                let p = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
                let uniform = (i as f64 * 0.754_877_666).fract() - 0.5;
                p * (1.0 + noise * 12.0_f64.sqrt() * uniform)
            })
            .collect()
    }

    #[test]
    fn planes_of_a_sphere_are_tangent_planes() {
        let points = sphere(5000, 0.0);
        let planes = LocalPlanes::new(&points, &Neighbours::new(&points));
        for (p, n) in points.iter().zip(&planes.normals) {
            assert!(n.dot(*p).abs() > 0.999);
        }
        let expected = (4.0 * std::f64::consts::PI / 5000.0).sqrt();
        assert!((planes.spacing() / expected - 1.0).abs() < 0.2, "{} {expected}", planes.spacing());
        assert!(planes.noise() < 0.05 * expected);
        assert!(!planes.outliers.contains(&true));
    }

    #[test]
    fn noise_and_outliers_are_noticed() {
        let sigma = 0.02;
        let mut points = sphere(5000, sigma);
        points.push(DVec3::new(1.5, 0.0, 0.0));
        let planes = LocalPlanes::new(&points, &Neighbours::new(&points));
        assert!((planes.noise() / sigma - 1.0).abs() < 0.3, "{}", planes.noise());
        assert!(planes.outliers[5000] && planes.outliers.iter().filter(|&&o| o).count() == 1);
    }

    #[test]
    fn random_signs_are_told_from_orientation() {
        let points = sphere(3000, 0.0);
        let neighbours = Neighbours::new(&points);
        assert!(agreement_of_normals(&points, &points, &neighbours) > 0.999);
        let signed = |(i, p): (usize, &DVec3)| if (i * 7919) % 13 < 6 { -*p } else { *p };
        let random: Vec<DVec3> = points.iter().enumerate().map(signed).collect();
        let share = agreement_of_normals(&points, &random, &neighbours);
        assert!((0.3..0.7).contains(&share), "{share}");
    }
}
