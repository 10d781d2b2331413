//! The part of the surface that each point of a cloud stands for.

use ndf_core::DVec3;
use rayon::prelude::*;

use super::neighbours::Neighbours;

/// Neighbours whose cells bound that of a point.
const NEIGHBOURS: usize = 20;

/// Cells reach no farther than the neighbour of this number, so that they end where the cloud ends. In an even cloud
/// it is 1.6 spacings away.
const OUTERMOST: usize = 8;

/// Areas of all points: those of their cells in the Voronoi diagram of their neighbours, in the plane at right angles
/// to their normal (Barill et al. 2018). Neighbours with opposing normals are on another sheet and do not count.
/// `neighbours` are those of the points. O(n log n) on all threads.
///
/// # Panics
/// If there is not one normal for each point.
pub fn areas(positions: &[DVec3], normals: &[DVec3], neighbours: &Neighbours) -> Vec<f64> {
    assert_eq!(positions.len(), normals.len());
    (0..positions.len()).into_par_iter().map(|i| area(i, positions, normals, neighbours)).collect()
}

fn area(i: usize, positions: &[DVec3], normals: &[DVec3], neighbours: &Neighbours) -> f64 {
    let (p, n) = (positions[i], normals[i]);
    let (u, v) = n.any_orthonormal_pair();
    let near = neighbours.nearest(p, NEIGHBOURS + 1);
    let reach = near[OUTERMOST.min(near.len() - 1)].distance_squared.sqrt();
    // A square with the area of the disc.
    let half = 0.5 * std::f64::consts::PI.sqrt() * reach;
    let mut cell = vec![[-half, -half], [half, -half], [half, half], [-half, half]];
    for neighbour in near.iter().map(|neighbour| neighbour.index as usize) {
        let d = positions[neighbour] - p;
        let (x, y) = (d.dot(u), d.dot(v));
        if neighbour != i && normals[neighbour].dot(n) > 0.0 && x * x + y * y > 0.0 {
            cell = clipped(&cell, x, y);
        }
    }
    let corners = cell.iter().zip(cell.iter().cycle().skip(1));
    0.5 * corners.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
}

/// The part of a convex polygon that is nearer to the origin than to (x, y) (Sutherland and Hodgman 1974).
fn clipped(polygon: &[[f64; 2]], x: f64, y: f64) -> Vec<[f64; 2]> {
    let height = |c: &[f64; 2]| 0.5 * (x * x + y * y) - c[0] * x - c[1] * y;
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (ha, hb) = (height(a), height(b));
        if ha >= 0.0 {
            kept.push(*a);
        }
        if (ha > 0.0 && hb < 0.0) || (ha < 0.0 && hb > 0.0) {
            let t = ha / (ha - hb);
            kept.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::sampling::AreaSampler;
    use ndf_mesh::shapes;

    #[test]
    fn areas_add_up_to_that_of_the_surface() {
        let mesh = shapes::torus(200, 80, 1.0, 0.4);
        let samples = AreaSampler::new(&mesh).unwrap().sample(20_000, 5, 0);
        let positions: Vec<DVec3> = samples.iter().map(|s| s.position(&mesh)).collect();
        let normals: Vec<DVec3> = samples.iter().map(|s| mesh.face_normal(s.face)).collect();
        let all = areas(&positions, &normals, &Neighbours::new(&positions));
        let total: f64 = all.iter().sum();
        assert!((total / mesh.area() - 1.0).abs() < 0.02, "{total} of {}", mesh.area());
        assert!(all.iter().all(|&a| a > 0.0));
    }

    #[test]
    fn cells_of_a_grid_are_squares_that_end_at_its_rim() {
        let positions: Vec<DVec3> =
            (0..900).map(|i| DVec3::new(f64::from(i % 30), f64::from(i / 30), 0.0)).collect();
        let all = areas(&positions, &[DVec3::Z; 900], &Neighbours::new(&positions));
        assert!((all[15 * 30 + 15] - 1.0).abs() < 1e-12);
        assert!(all[0] > 1.0 && all[0] < 12.0 && all[15] < 3.0);
    }

    #[test]
    fn the_other_side_of_a_thin_plate_does_not_count() {
        let side = |z: f64| (0..400).map(move |i| DVec3::new(f64::from(i % 20), f64::from(i / 20) + z, z));
        let positions: Vec<DVec3> = side(0.0).chain(side(0.1)).collect();
        let normals: Vec<DVec3> = (0..800).map(|i| if i < 400 { -DVec3::Z } else { DVec3::Z }).collect();
        let all = areas(&positions, &normals, &Neighbours::new(&positions));
        assert!((all[10 * 20 + 10] - 1.0).abs() < 1e-12);
    }
}
