//! Points of clouds as small discs, so that what draws meshes draws them.

use ndf_core::DVec3;
use ndf_mesh::TriangleMesh;
use ndf_surfaces::point_cloud::{LocalPlanes, Neighbours};

/// Points that are drawn at most; of more, one in so many is.
pub const MAX_POINTS: usize = 500_000;

/// Radius of a disc, in distances to the next point.
const RADIUS: f64 = 1.0;

/// Discs of lonely points are not larger than this many times those of most.
const MAX_RADIUS: f64 = 3.0;

/// A hexagon for every point, across its normal or, without normals, in the plane of its neighbours, of either side. At most
/// [`MAX_POINTS`] points are drawn, evenly chosen by their numbers. O(n log n).
pub fn discs(positions: &[DVec3], normals: Option<&[DVec3]>) -> TriangleMesh {
    let step = positions.len().div_ceil(MAX_POINTS).max(1);
    let chosen: Vec<DVec3> = positions.iter().step_by(step).copied().collect();
    let planes = LocalPlanes::new(&chosen, &Neighbours::new(&chosen));
    let most = MAX_RADIUS * planes.spacing();
    let (mut corners, mut faces) =
        (Vec::with_capacity(6 * chosen.len()), Vec::with_capacity(4 * chosen.len()));
    for (i, &center) in chosen.iter().enumerate() {
        let normal = normals.map_or(planes.normals[i], |normals| normals[i * step]).normalize_or(DVec3::Z);
        let (across, along) = normal.any_orthonormal_pair();
        let radius = RADIUS * planes.spacings[i].min(most);
        let first = corners.len() as u32;
        corners.extend((0..6).map(|k| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_3).sin_cos();
            center + radius * (cos * across + sin * along)
        }));
        faces.extend((1..5).map(|k| [first, first + k, first + k + 1]));
    }
    TriangleMesh::new(corners, faces).expect("corners are numbered as they come")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::shapes;

    #[test]
    fn discs_lie_on_the_surface_and_face_as_the_normals_do() {
        let sphere = shapes::icosphere(4);
        let points = sphere.positions();
        let given = discs(points, Some(points));
        assert_eq!((given.vertex_count(), given.face_count()), (6 * points.len(), 4 * points.len()));
        // Together they cover about the sphere, some of it twice.
        let share = given.area() / sphere.area();
        assert!((1.5..4.0).contains(&share), "{share}");
        for f in given.face_indices() {
            let at = given.corner_positions(f)[0];
            assert!(given.face_normal(f).dot(at) > 0.8);
        }
        let fitted = discs(points, None);
        assert!(fitted.face_indices().all(|f| {
            let at = fitted.corner_positions(f)[0];
            fitted.face_normal(f).dot(at).abs() > 0.8
        }));
    }
}
