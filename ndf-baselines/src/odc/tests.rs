use std::sync::atomic::{AtomicU64, Ordering};

use super::*;
use crate::fields::{CountingField, Field, random_field};
use ndf_core::NoProgress;
use ndf_core::analytic::{Sphere, Torus};
use ndf_core::glam::DQuat;
use ndf_core::{Cancelled, Hint};
use ndf_mesh::{SelfIntersections, TriangleTree};
use ndf_meshing::{MarchingCubesOptions, marching_cubes};

fn contoured(field: &dyn ImplicitField, grid: u32) -> Isosurface {
    occupancy_dual_contouring(field, &OdcOptions { grid, ..OdcOptions::default() }, &NoProgress).unwrap()
}

#[test]
fn a_hundred_shapes_are_closed_manifolds_without_self_intersections() {
    let mut genera = Vec::new();
    for seed in 0..100 {
        let mesh = contoured(&random_field(seed), 18 + (seed % 4) as u32 * 6).mesh;
        assert_eq!(mesh.topology().boundary_edge_count(), 0, "shape {seed}");
        assert!(mesh.face_indices().all(|f| mesh.face_area(f) > 0.0), "shape {seed}");
        assert!(mesh.signed_volume() > 0.0, "shape {seed}");
        let found = SelfIntersections::of(&mesh, &NoProgress).unwrap();
        assert_eq!(found, SelfIntersections::default(), "shape {seed}");
        genera.push(1 - mesh.topology().euler_characteristic() / 2);
    }
    assert!(genera.iter().any(|&g| g > 0) && genera.iter().any(|&g| g < 0), "{genera:?}");
}

/// Occupancy without any coherence: every pattern of corners occurs beside every other.
#[test]
fn even_noise_makes_a_manifold_without_self_intersections() {
    for seed in 0..4_u64 {
        let noise = Field::new(move |p: DVec3| {
            let cell = (p * 5.0).floor().to_array().map(|x| x as i64 as u64);
            let mut h = cell.iter().fold(seed + 1, |h, &x| (h ^ x).wrapping_mul(0x9E37_79B9_7F4A_7C15));
            h ^= h >> 29;
            h = h.wrapping_mul(0xBF58_476D_1CE4_E5B9);
            if h >> 63 == 0 { 1.0 } else { -1.0 }
        });
        let mesh = contoured(&noise, 21).mesh;
        assert_eq!(mesh.topology().boundary_edge_count(), 0);
        assert!(mesh.face_count() > 20_000);
        assert_eq!(SelfIntersections::of(&mesh, &NoProgress).unwrap(), SelfIntersections::default());
    }
}

/// Largest distance of a vertex from a sphere, in cells.
fn worst(surface: &Isosurface) -> f64 {
    let errors = surface.mesh.positions().iter().map(|p| (p.length() - 1.0).abs());
    errors.fold(0.0, f64::max) / surface.cell
}

#[test]
fn errors_on_smooth_surfaces_fall_with_the_square_of_the_cell() {
    let [coarse, fine] = [16, 64].map(|grid| contoured(&Sphere::UNIT, grid));
    assert!(worst(&coarse) < 0.05, "{}", worst(&coarse));
    // In cells, the error of a second-order method falls with the cell itself.
    assert!(worst(&fine) < 0.3 * worst(&coarse), "{} {}", worst(&fine), worst(&coarse));
    let torus = contoured(&Torus { center: DVec3::ZERO, ring: 1.0, tube: 0.4 }, 40);
    assert_eq!(torus.mesh.topology().euler_characteristic(), 0);
}

#[test]
fn corners_and_edges_of_a_turned_cube_come_out_sharp() {
    let turn = DQuat::from_euler(ndf_core::glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
    let center = DVec3::new(0.013, -0.021, 0.008);
    let cube = Field::new(move |p: DVec3| ((turn.inverse() * (p - center)).abs() - 0.61).max_element());
    let sharp = contoured(&cube, 32);
    let options = MarchingCubesOptions { grid: 32, ..MarchingCubesOptions::default() };
    let blunt = marching_cubes(&cube, &options, &NoProgress).unwrap();
    // Median distances, in cells, of the corners and of points of the edges: where a corner pokes into a further cell
    // without crossing an edge of the grid there, no dual contouring has it.
    let medians = |surface: &Isosurface| {
        let tree = TriangleTree::new(&surface.mesh);
        let median = |points: &mut dyn Iterator<Item = DVec3>| {
            let place = |p: DVec3| center + turn * (0.61 * p);
            let distance = |p: DVec3| tree.closest_point(p, Hint::NONE).unwrap().point.distance(p);
            let mut all: Vec<f64> = points.map(|p| distance(place(p)) / surface.cell).collect();
            all.sort_unstable_by(f64::total_cmp);
            all[all.len() / 2]
        };
        let corners = (0..8_u8).map(|c| 2.0 * cases::corner(c) - 1.0);
        let on_edge = |axis: usize, i: usize, (y, z): (f64, f64)| {
            let t = (i as f64 + 0.5) / 50.0 - 1.0;
            DVec3::from_array(std::array::from_fn(|k| [t, y, z][(k + axis) % 3]))
        };
        let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
        let on_edges = (0..3).flat_map(|a| (0..100).flat_map(move |i| signs.map(move |s| on_edge(a, i, s))));
        [median(&mut corners.clone()), median(&mut on_edges.clone())]
    };
    let ([corner, edge], [blunt_corner, blunt_edge]) = (medians(&sharp), medians(&blunt));
    assert!(corner < 0.003 && edge < 0.01, "{corner} {edge}");
    assert!(blunt_corner > 0.3 && blunt_edge > 0.05, "{blunt_corner} {blunt_edge}");
}

#[test]
fn queries_are_counted() {
    let count = AtomicU64::new(0);
    let field = CountingField { field: &Sphere::UNIT, count: &count };
    let surface = contoured(&field, 20);
    assert_eq!(surface.evaluations, count.load(Ordering::Relaxed));
    let interior: u64 = surface.cells.iter().map(|&n| u64::from(n) - 1).product();
    assert!(surface.evaluations > interior);
}

#[test]
fn threads_change_nothing_and_work_can_be_cancelled() {
    let field = random_field(7);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| contoured(&field, 25))
    };
    let (one, three) = (on(1), on(3));
    assert_eq!((one.mesh.positions(), one.mesh.faces()), (three.mesh.positions(), three.mesh.faces()));
    struct Stop;
    impl Progress for Stop {
        fn report(&self, _: &str, _: f64) {}
        fn check(&self) -> Result<(), Cancelled> {
            Err(Cancelled)
        }
    }
    let stopped = occupancy_dual_contouring(&field, &OdcOptions::default(), &Stop);
    assert!(matches!(stopped, Err(IsosurfaceError::Cancelled)));
    let empty = Field::new(|_| 1.0);
    let missed = occupancy_dual_contouring(&empty, &OdcOptions { grid: 8, bounds: None }, &NoProgress);
    assert!(matches!(missed, Err(IsosurfaceError::NoCrossing { .. })));
}

#[test]
fn a_surface_that_leaves_the_box_is_closed_at_its_border() {
    let bounds = BoundingBox { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) };
    let options = OdcOptions { grid: 10, bounds: Some(bounds) };
    let mesh =
        occupancy_dual_contouring(&Sphere { center: DVec3::X * 0.5, radius: 0.7 }, &options, &NoProgress);
    assert_eq!(mesh.unwrap().mesh.topology().boundary_edge_count(), 0);
}
