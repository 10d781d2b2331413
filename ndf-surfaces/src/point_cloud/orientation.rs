//! Normals for points that have none, agreeing globally on what is outside.
//!
//! Winding number normal consistency (Lin, Shi and Liu 2024, "Fast and globally consistent normal orientation based on
//! the winding number normal consistency"): vectors at the points are sought whose winding number is ½ at the points and
//! whose winding number's gradient points along them. Steps of steepest descent towards the first take turns with
//! replacing the vectors' directions by those of the gradient, while the regularisation shrinks. A step costs four sums
//! over the cloud, all of them hierarchical: the winding number, its transpose, its gradient.

use ndf_core::{Cancelled, DVec3, Progress};
use rayon::prelude::*;

use super::local_planes::{LocalPlanes, agreement_of_normals};
use super::neighbours::Neighbours;
use super::thinning::evenly_picked;
use crate::winding_number::PointWindingNumber;

/// Steps; those of the paper.
const STEPS: usize = 40;

/// The last regularisation, in spacings and in standard deviations of the noise; the larger counts. Between them the
/// presets of the paper lie, which a user of its program chooses by hand.
const LAST_BY_SPACING: f64 = 0.6;
const LAST_BY_NOISE: f64 = 5.0;

/// The first regularisation, in last ones.
const FIRST: f64 = 4.0;

/// Cosine of the angle up to which the normal of a local plane is better than that of the winding number.
const TRUSTED: f64 = 0.7;

/// Points from which only some are solved for, and how many these are.
const LARGE: usize = 1 << 18;
const SOME: usize = 1 << 17;

/// Oriented normals.
#[derive(Clone, Debug, PartialEq)]
pub struct Orientation {
    /// Unit normals, outward.
    pub normals: Vec<DVec3>,
    /// The share of neighbouring points whose normals point to the same side.
    pub agreement: f64,
}

/// Orients a cloud. The signs are those of the winding number, the directions those of local planes where the two agree
/// to within 45°. O(n log n) on all threads, about 160 sums over the cloud for each point. Of more than a quarter of a million points
/// some, [evenly picked](evenly_picked), are solved for, and the others see the gradient of their winding number.
///
/// # Errors
/// If the observer asks to stop.
pub fn orient(
    positions: &[DVec3],
    planes: &LocalPlanes,
    neighbours: &Neighbours,
    progress: &dyn Progress,
) -> Result<Orientation, Cancelled> {
    let directions = if positions.len() > LARGE {
        directions_by_some(positions, SOME, progress)?
    } else {
        solved(positions, planes, progress)?.0
    };
    let normals: Vec<DVec3> = directions
        .iter()
        .zip(&planes.normals)
        .map(|(m, &plane)| {
            let global = m.try_normalize().unwrap_or(plane);
            let cosine = global.dot(plane);
            if cosine.abs() > TRUSTED { plane * cosine.signum() } else { global }
        })
        .collect();
    let agreement = agreement_of_normals(positions, &normals, neighbours);
    Ok(Orientation { normals, agreement })
}

/// Outward vectors at the points, and the last radius of the regularisation.
fn solved(
    positions: &[DVec3],
    planes: &LocalPlanes,
    progress: &dyn Progress,
) -> Result<(Vec<DVec3>, f64), Cancelled> {
    let last = (LAST_BY_SPACING * planes.spacing()).max(LAST_BY_NOISE * planes.noise);
    let last = if last > 0.0 { last } else { f64::MIN_POSITIVE.sqrt() };
    let mut moments = vec![DVec3::ZERO; positions.len()];
    for step in 0..STEPS {
        progress.check()?;
        let left = (STEPS - 1 - step) as f64 / (STEPS - 1) as f64;
        moments = stepped(positions, moments, last * (1.0 + left * (FIRST - 1.0)));
        progress.report("orienting", (step + 1) as f64 / STEPS as f64);
    }
    Ok((moments, last))
}

/// Outward vectors at all points, by so many of them.
fn directions_by_some(
    positions: &[DVec3],
    some: usize,
    progress: &dyn Progress,
) -> Result<Vec<DVec3>, Cancelled> {
    let picked = evenly_picked(positions, some);
    let some: Vec<DVec3> = picked.into_iter().map(|i| positions[i as usize]).collect();
    let planes = LocalPlanes::new(&some, &Neighbours::new(&some));
    let (moments, radius) = solved(&some, &planes, progress)?;
    let sums = PointWindingNumber::new(&some, &moments, &vec![radius; some.len()]);
    Ok(positions.par_iter().map(|&p| -sums.with_gradient(p).1).collect())
}

/// One step of descent and one of consistency, with a regularisation of this radius.
fn stepped(positions: &[DVec3], mut moments: Vec<DVec3>, radius: f64) -> Vec<DVec3> {
    let mut sums = PointWindingNumber::new(positions, &moments, &vec![radius; positions.len()]);
    let residuals: Vec<f64> = sums.at_points().iter().map(|w| 0.5 - w).collect();
    let direction = sums.transposed(&residuals);
    sums.set_moments(&direction);
    let squares: f64 = sums.at_points().iter().map(|w| w * w).sum();
    if squares > 0.0 {
        let length = direction.iter().map(|d| d.length_squared()).sum::<f64>() / squares;
        moments.iter_mut().zip(&direction).for_each(|(m, d)| *m += length * *d);
    }
    sums.set_moments(&moments);
    // The winding number falls outward.
    let gradients = sums.gradients_at_points();
    moments.iter().zip(&gradients).map(|(m, g)| -g.normalize_or_zero() * m.length()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_core::NoProgress;
    use ndf_mesh::sampling::AreaSampler;
    use ndf_mesh::shapes;

    /// The share of points of a shape whose normals come out on the right side.
    fn right_share(mesh: &ndf_mesh::TriangleMesh, count: usize, noise: f64) -> f64 {
        let samples = AreaSampler::new(mesh).unwrap().sample(count, 11, 0);
        let truth: Vec<DVec3> = samples.iter().map(|s| mesh.face_normal(s.face)).collect();
        let uniform = |i: usize| (i as f64 * 0.754_877_666).fract() - 0.5;
        let positions: Vec<DVec3> = samples
            .iter()
            .enumerate()
            .map(|(i, s)| s.position(mesh) + 12.0_f64.sqrt() * noise * uniform(i) * truth[i])
            .collect();
        let neighbours = Neighbours::new(&positions);
        let planes = LocalPlanes::new(&positions, &neighbours);
        let orientation = orient(&positions, &planes, &neighbours, &NoProgress).unwrap();
        let right = orientation.normals.iter().zip(&truth).filter(|(n, t)| n.dot(**t) > 0.0).count();
        right as f64 / count as f64
    }

    #[test]
    fn normals_of_a_knot_point_outward() {
        let share = right_share(&shapes::trefoil_knot(300, 30, 0.24), 4000, 0.0);
        assert!(share > 0.995, "{share}");
    }

    #[test]
    fn some_points_tell_the_others_where_outside_is() {
        let mesh = shapes::trefoil_knot(300, 30, 0.24);
        let samples = AreaSampler::new(&mesh).unwrap().sample(16_000, 11, 0);
        let positions: Vec<DVec3> = samples.iter().map(|s| s.position(&mesh)).collect();
        let found = directions_by_some(&positions, 4000, &NoProgress).unwrap();
        let is_outward = |(s, d): (&ndf_mesh::FacePoint, &DVec3)| mesh.face_normal(s.face).dot(*d) > 0.0;
        let right = samples.iter().zip(&found).filter(|&pair| is_outward(pair)).count();
        assert!(right > 15_900, "{right}");
    }

    #[test]
    fn noise_is_borne() {
        let share = right_share(&shapes::torus(100, 50, 1.0, 0.4), 4000, 0.02);
        assert!(share > 0.98, "{share}");
    }

    #[test]
    fn orienting_can_be_cancelled() {
        struct Stop;
        impl Progress for Stop {
            fn report(&self, _: &str, _: f64) {}
            fn cancelled(&self) -> bool {
                true
            }
        }
        let points = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::ZERO];
        let neighbours = Neighbours::new(&points);
        let planes = LocalPlanes::new(&points, &neighbours);
        assert_eq!(orient(&points, &planes, &neighbours, &Stop), Err(Cancelled));
    }
}
