//! Points that are far from all others.

use ndf_core::DVec3;
use ndf_formats::point_cloud::PointCloud;
use rayon::prelude::*;

use super::local_planes::{NEIGHBOURS, median, spacing};
use super::neighbours::Neighbours;

/// A point counts as an outlier if its neighbours are this many times farther away than theirs are. Normals bear witness
/// to points that are merely sparse.
const LONELY: f64 = 3.0;
const LONELY_WITH_NORMAL: f64 = 8.0;

/// Share of outliers from which they are no outliers.
const FEW: f64 = 0.2;

/// Leaves out points that are much farther from their neighbours than these are from theirs, and says how many. Where a
/// fifth of the points is so, or fewer than four would be left, all are kept. Takes an index of the points, and gives that of those
/// that are left. O(n log n) on all threads.
pub fn without_outliers(cloud: PointCloud, neighbours: Neighbours) -> (PointCloud, Neighbours, usize) {
    let positions = cloud.positions();
    let near = |&p: &DVec3| -> Vec<u32> {
        neighbours.nearest(p, NEIGHBOURS + 1).iter().map(|neighbour| neighbour.index).collect()
    };
    let spacings: Vec<f64> = positions.par_iter().map(|p| spacing(*p, positions, &near(p))).collect();
    let least = spacings.iter().copied().fold(f64::INFINITY, f64::min);
    let lonely = if cloud.normals().is_some() { LONELY_WITH_NORMAL } else { LONELY };
    let is_outlier = |(p, &own): (&DVec3, &f64)| {
        // Of most points not even the least spacing of all is so much smaller.
        own > lonely * least && {
            let mut theirs: Vec<f64> = near(p).iter().map(|&j| spacings[j as usize]).collect();
            own > lonely * median(&mut theirs)
        }
    };
    let is_outlier: Vec<bool> = positions.par_iter().zip(&spacings).map(is_outlier).collect();
    let outliers = is_outlier.iter().filter(|&&is_outlier| is_outlier).count();
    if outliers == 0 || outliers as f64 >= FEW * positions.len() as f64 || positions.len() < outliers + 4 {
        return (cloud, neighbours, 0);
    }
    let cloud = cloud.retained(|i| !is_outlier[i]);
    let neighbours = Neighbours::new(cloud.positions());
    (cloud, neighbours, outliers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_formats::point_cloud::RawCloud;
    use ndf_mesh::sampling::AreaSampler;
    use ndf_mesh::shapes;

    fn cloud(positions: Vec<DVec3>, with_normals: bool) -> PointCloud {
        let normals = with_normals.then(|| positions.iter().map(|p| p.normalize()).collect());
        PointCloud::cleaned(RawCloud { positions, normals, ..RawCloud::default() }).unwrap().0
    }

    fn without(cloud: PointCloud) -> (PointCloud, usize) {
        let neighbours = Neighbours::new(cloud.positions());
        let (kept, left, outliers) = without_outliers(cloud, neighbours);
        assert_eq!(left.nearest(kept.positions()[2], 1)[0].index, 2);
        (kept, outliers)
    }

    fn sphere(points: usize) -> Vec<DVec3> {
        let mesh = shapes::icosphere(4);
        let samples = AreaSampler::new(&mesh).unwrap().sample(points, 3, 0);
        samples.iter().map(|s| s.position(&mesh).normalize()).collect()
    }

    #[test]
    fn single_points_are_left_out_and_no_others() {
        for with_normals in [false, true] {
            let (kept, outliers) = without(cloud(sphere(5000), with_normals));
            assert_eq!((kept.positions().len(), outliers), (5000, 0));
            let mut points = sphere(5000);
            points.push(DVec3::new(1.0e4, 0.0, 0.0));
            points.insert(7, DVec3::new(0.0, 2.0, 0.0));
            let (kept, outliers) = without(cloud(points, with_normals));
            assert_eq!((kept.positions().to_vec(), outliers), (sphere(5000), 2));
            assert_eq!(kept.normals().map_or(0, <[DVec3]>::len), if with_normals { 5000 } else { 0 });
        }
    }

    #[test]
    fn sparse_parts_with_normals_and_small_clouds_are_kept() {
        // A dense half and one with a twentieth of the points.
        let dense = sphere(8000).into_iter().filter(|p| p.z > 0.0);
        let sparse = sphere(400).into_iter().filter(|p| p.z < 0.0);
        let (_, outliers) = without(cloud(dense.chain(sparse).collect(), true));
        assert_eq!(outliers, 0);
        let corners = [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, 1.0e6 * DVec3::ONE];
        assert_eq!(without(cloud(corners.to_vec(), true)).1, 0);
    }
}
