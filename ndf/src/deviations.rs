//! How far points are from a mesh, or from other points.

use ndf_core::{Cancelled, DVec3, Hint, Progress};
use ndf_mesh::{TriangleMesh, TriangleTree};
use ndf_surfaces::WindingNumber;
use ndf_surfaces::point_cloud::Neighbours;
use rayon::prelude::*;

/// Points that a thread measures before it asks whether to stop.
const CHUNK: usize = 1024;

/// How far points are from a mesh: NaN for points that are not finite. O(n log n).
///
/// # Errors
/// If the observer asks to stop.
pub fn deviations(
    reference: &TriangleMesh,
    points: &[DVec3],
    progress: &dyn Progress,
) -> Result<Vec<f64>, Cancelled> {
    let tree = TriangleTree::new(reference);
    let distance = |&p: &DVec3| {
        progress.check()?;
        Ok(tree.closest_point(p, Hint::NONE).map_or(f64::NAN, |closest| closest.distance_squared.sqrt()))
    };
    points.par_iter().with_min_len(CHUNK).map(distance).collect()
}

/// The same with a sign: negative inside of the mesh, where its generalized winding number exceeds one half (Jacobson, Kavan and
/// Sorkine-Hornung 2013), so that holes and flaws are bridged. O(n log n).
///
/// # Errors
/// If the observer asks to stop.
pub fn signed_deviations(
    reference: &TriangleMesh,
    points: &[DVec3],
    progress: &dyn Progress,
) -> Result<Vec<f64>, Cancelled> {
    let distances = deviations(reference, points, progress)?;
    let winding = WindingNumber::new(reference);
    let signed = |(&p, distance): (&DVec3, f64)| {
        progress.check()?;
        let is_inside = p.is_finite() && winding.at(p) > 0.5;
        Ok(if is_inside { -distance } else { distance })
    };
    points.par_iter().zip(distances).with_min_len(CHUNK).map(signed).collect()
}

/// How far each of some points is from the nearest of others, which are finite. O((n + q) log n).
///
/// # Errors
/// If the observer asks to stop.
pub fn deviations_from_points(
    others: &[DVec3],
    points: &[DVec3],
    progress: &dyn Progress,
) -> Result<Vec<f64>, Cancelled> {
    let index = Neighbours::new(others);
    let distance = |&p: &DVec3| {
        progress.check()?;
        Ok(index.nearest(p, 1).first().map_or(f64::NAN, |found| found.distance_squared.sqrt()))
    };
    points.par_iter().with_min_len(CHUNK).map(distance).collect()
}

#[cfg(test)]
mod tests {
    use ndf_core::NoProgress;
    use ndf_mesh::shapes;

    use super::*;

    #[test]
    fn deviations_from_a_sphere_are_differences_of_radii() {
        let sphere = shapes::icosphere(5);
        let radii = [0.0, 0.25, 0.9, 1.1, 3.0];
        let direction = DVec3::new(0.3, -0.7, 0.2).normalize();
        let mut points: Vec<DVec3> = radii.iter().map(|r| *r * direction).collect();
        points.push(DVec3::splat(f64::NAN));
        let signed = signed_deviations(&sphere, &points, &NoProgress).unwrap();
        let unsigned = deviations(&sphere, &points, &NoProgress).unwrap();
        for ((radius, signed), unsigned) in radii.iter().zip(&signed).zip(&unsigned) {
            assert!((signed - (radius - 1.0)).abs() < 2e-3, "{signed} at {radius}");
            assert_eq!(signed.abs(), *unsigned);
        }
        assert!(signed[radii.len()].is_nan() && unsigned[radii.len()].is_nan());
        // A sphere with a hole still has an inside.
        let (positions, faces) = sphere.clone().into_parts();
        let open = TriangleMesh::new(positions, faces[200..].to_vec()).unwrap();
        assert!(signed_deviations(&open, &[DVec3::ZERO], &NoProgress).unwrap()[0] < 0.0);
        let apart = deviations_from_points(&points[..5], &points[..5], &NoProgress).unwrap();
        assert!(apart.iter().all(|distance| *distance == 0.0));
    }
}
