//! Clouds without normals: what is needed to learn one.

use ndf_core::{Cancelled, Progress};

use super::local_planes::LocalPlanes;
use super::moving_spheres::MovingSpheres;
use super::neighbours::Neighbours;
use super::orientation::orient;
use super::oriented_cloud::OrientedCloud;
use super::outliers::without_outliers;
use super::winding_field::WindingFieldOptions;
use ndf_formats::point_cloud::PointCloud;

/// Radius of the regularisation of the winding number that gives the base mesh, in spacings and standard deviations of
/// the noise, which add up: noise must not make handles.
const SMOOTHING: [f64; 2] = [0.7, 4.0];

/// The surface of a cloud without normals.
pub struct UnorientedCloud {
    /// The surface, smooth and near the points.
    pub surface: MovingSpheres,
    /// The level ½ of the winding number of the oriented points: coarser, but it has an inside, and so base meshes are
    /// made of it.
    pub scaffold: OrientedCloud,
    /// The points that were used, with the normals that were found.
    pub cloud: PointCloud,
    /// Points far from all others, left out.
    pub outliers: usize,
    /// Estimated standard deviation of the noise.
    pub noise: f64,
    /// Median distance of neighbouring points.
    pub spacing: f64,
    /// The share of neighbouring points whose normals point to the same side; under 0.9 the orientation is doubtful.
    pub agreement: f64,
}

/// Makes a surface of points: outliers are left out, normals found and oriented by [`orient`], then spheres fitted.
/// Normals the cloud may have are not used; `neighbours` has its points. O(n log n) on all threads.
///
/// # Errors
/// If the observer asks to stop.
pub fn unoriented_cloud(
    cloud: PointCloud,
    neighbours: Neighbours,
    progress: &dyn Progress,
) -> Result<UnorientedCloud, Cancelled> {
    let (cloud, neighbours, outliers) = without_outliers(cloud.without_normals(), neighbours);
    let planes = LocalPlanes::new(cloud.positions(), &neighbours);
    let found = orient(cloud.positions(), &planes, &neighbours, progress)?;
    let cloud = cloud.with_normals(found.normals);
    let (spacing, noise) = (planes.spacing(), planes.noise);
    let smoothing = SMOOTHING[0] + SMOOTHING[1] * noise / spacing.max(f64::MIN_POSITIVE);
    let scaffold =
        OrientedCloud::with_neighbours(&cloud, neighbours.clone(), &WindingFieldOptions { smoothing });
    let surface = MovingSpheres::new(&cloud, &planes, neighbours);
    Ok(UnorientedCloud { surface, scaffold, cloud, outliers, noise, spacing, agreement: found.agreement })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_core::{DVec3, NoProgress};
    use ndf_formats::point_cloud::RawCloud;
    use ndf_mesh::sampling::AreaSampler;
    use ndf_mesh::shapes;
    use std::sync::LazyLock;

    static KNOT: LazyLock<UnorientedCloud> = LazyLock::new(|| {
        let mesh = shapes::trefoil_knot(300, 30, 0.24);
        let samples = AreaSampler::new(&mesh).unwrap().sample(6000, 3, 0);
        let mut positions: Vec<DVec3> = samples.iter().map(|s| s.position(&mesh)).collect();
        positions.extend([DVec3::splat(2.0), DVec3::new(0.0, 0.0, -2.0)]);
        let (cloud, _) =
            PointCloud::cleaned(RawCloud { positions, normals: None, ..RawCloud::default() }).unwrap();
        let neighbours = Neighbours::new(cloud.positions());
        unoriented_cloud(cloud, neighbours, &NoProgress).unwrap()
    });

    ndf_core::surface_conformance!(unoriented_knot, KNOT.surface);
    ndf_core::surface_conformance!(scaffold_of_the_knot, KNOT.scaffold);

    #[test]
    fn outliers_are_left_out_and_the_rest_oriented() {
        assert_eq!((KNOT.outliers, KNOT.cloud.positions().len()), (2, 6000));
        assert!(KNOT.agreement > 0.99, "{}", KNOT.agreement);
        assert!(!KNOT.scaffold.field().is_turned());
    }
}
