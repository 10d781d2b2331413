//! Planes fitted to the neighbours of every point: directions, spacing, noise.

use ndf_core::DVec3;
use rayon::prelude::*;

use super::eigen::symmetric_eigen;
use super::neighbours::Neighbours;

/// Neighbours a plane is fitted to, at first and at most: noise may ask for more. To the nearest half of them a second
/// plane is fitted, to tell noise from curvature.
pub(super) const NEIGHBOURS: usize = 16;
const MOST_NEIGHBOURS: usize = 128;

/// The largest noise that 16 neighbours tell, in spacings; it grows with the square root of their number. Neighbours
/// in thicker layers of points lie around a point on all sides: what they then tell is at most 0.4.
const TELLABLE: f64 = 0.3;

/// Pairs of neighbours looked at to judge normals.
const JUDGED: usize = 4000;

/// What the neighbours of every point tell.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalPlanes {
    /// Unit normals of the planes, of either sign.
    pub normals: Vec<DVec3>,
    /// Distance to the next point, in the mean around each point: the square root of the area a neighbour takes.
    pub spacings: Vec<f64>,
    /// An estimate of the standard deviation of the noise.
    pub noise: f64,
}

impl LocalPlanes {
    /// Fits planes to the neighbours of every point, by least squares (Hoppe et al. 1992): 16 of them, or up to 128
    /// where noise makes a layer of points of the surface. O(n log n) on all threads.
    pub fn new(positions: &[DVec3], neighbours: &Neighbours) -> Self {
        let near = nearest(positions, neighbours, NEIGHBOURS);
        let spacings = spacings(positions, &near);
        let unit = TELLABLE * median(&mut spacings.clone()) / (NEIGHBOURS as f64).sqrt();
        let mut count = NEIGHBOURS;
        let (mut normals, mut noise) = fit(positions, &near);
        while noise > unit * (count as f64).sqrt() && 2 * count <= MOST_NEIGHBOURS {
            count *= 2;
            (normals, noise) = fit(positions, &nearest(positions, neighbours, count));
        }
        Self { normals, spacings, noise }
    }

    /// The median of the spacings.
    pub fn spacing(&self) -> f64 {
        median(&mut self.spacings.clone())
    }
}

/// The point itself and its nearest neighbours, for every point.
fn nearest(positions: &[DVec3], neighbours: &Neighbours, count: usize) -> Vec<Vec<u32>> {
    let near = |&p: &DVec3| neighbours.nearest(p, count + 1).iter().map(|n| n.index).collect();
    positions.par_iter().map(near).collect()
}

fn spacings(positions: &[DVec3], near: &[Vec<u32>]) -> Vec<f64> {
    (positions, near).into_par_iter().map(|(&p, near)| spacing(p, positions, near)).collect()
}

/// The square root of the area that a point takes, by its neighbours.
pub(super) fn spacing(p: DVec3, positions: &[DVec3], near: &[u32]) -> f64 {
    let radius = near.iter().map(|&j| positions[j as usize].distance(p)).fold(0.0, f64::max);
    radius * (std::f64::consts::PI / near.len().max(1) as f64).sqrt()
}

/// Normals of planes through the points around every point, and the standard deviation of the noise.
///
/// Noise leaves all planes the same variance, curvature one that grows with the fourth power of the radius, which is the
/// square of the number of neighbours: two planes tell the two apart. The median over all points counts.
fn fit(positions: &[DVec3], near: &[Vec<u32>]) -> (Vec<DVec3>, f64) {
    let fit = |(&p, near): (&DVec3, &Vec<u32>)| {
        let (normal, far) = plane(p, positions, near);
        let nearest = &near[..near.len().div_ceil(2)];
        let (_, close) = plane(p, positions, nearest);
        let growth = (near.len() as f64 / nearest.len().max(1) as f64).powi(2);
        let variance = if growth > 1.0 { (growth * close - far) / (growth - 1.0) } else { close };
        (normal, variance)
    };
    let (normals, mut variances): (Vec<DVec3>, Vec<f64>) = (positions, near).into_par_iter().map(fit).unzip();
    // Below zero by chance where there is none.
    (normals, median(&mut variances).max(0.0).sqrt())
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
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    /// A Fibonacci lattice, with uniform noise of a standard deviation along the radius.
    fn sphere(count: usize, noise: f64) -> Vec<DVec3> {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        (0..count)
            .map(|i| {
                let z = 1.0 - 2.0 * (i as f64 + 0.5) / count as f64;
                let (sin, cos) = (golden * i as f64).sin_cos();
                let p = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
                let uniform = rng.random::<f64>() - 0.5;
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
        assert!(planes.noise < 0.05 * expected);
    }

    #[test]
    fn noise_is_noticed() {
        let sigma = 0.02;
        let points = sphere(5000, sigma);
        let planes = LocalPlanes::new(&points, &Neighbours::new(&points));
        assert!((planes.noise / sigma - 1.0).abs() < 0.3, "{}", planes.noise);
        // Also where it is as large as the spacing, so that the nearest neighbours lie on all sides.
        let sigma = 0.025;
        let points = sphere(20_000, sigma);
        let planes = LocalPlanes::new(&points, &Neighbours::new(&points));
        assert!((planes.noise / sigma - 1.0).abs() < 0.3, "{}", planes.noise);
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
