use ndf_core::{BoundingBox, DVec3, ImplicitField, Inside, NoProgress};
use ndf_mesh::ValidationReport;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::*;

/// A field by formula.
struct Formula<F> {
    value: F,
    half_side: f64,
    lipschitz: Option<f64>,
    inside: Inside,
}

impl<F: Fn(DVec3) -> f64 + Send + Sync> Formula<F> {
    fn new(half_side: f64, value: F) -> Self {
        Self { value, half_side, lipschitz: None, inside: Inside::Below }
    }
}

impl<F: Fn(DVec3) -> f64 + Send + Sync> ImplicitField for Formula<F> {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        points.iter().zip(values).for_each(|(&p, v)| *v = (self.value)(p));
    }
    fn bounds(&self) -> BoundingBox {
        BoundingBox { min: DVec3::splat(-self.half_side), max: DVec3::splat(self.half_side) }
    }
    fn level(&self) -> f64 {
        0.0
    }
    fn inside(&self) -> Inside {
        self.inside
    }
    fn lipschitz(&self) -> Option<f64> {
        self.lipschitz
    }
}

fn mesh_of(field: &dyn ImplicitField, grid: u32) -> Isosurface {
    marching_cubes(field, &MarchingCubesOptions { grid, ..Default::default() }, &NoProgress).unwrap()
}

fn sphere(p: DVec3) -> f64 {
    p.length() - 1.0
}

fn torus_at(p: DVec3, center: f64) -> f64 {
    let p = p - DVec3::X * center;
    DVec3::new(p.truncate().length() - 0.6, 0.0, p.z).length() - 0.25
}

/// Values at the corners of a grid of 5³ cells and nothing between: every pattern of signs comes up.
fn random_field(seed: u64, choose: impl Fn(&mut ChaCha8Rng) -> f64) -> impl Fn(DVec3) -> f64 + Send + Sync {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let values: Vec<f64> = (0..8_usize.pow(3)).map(|_| choose(&mut rng)).collect();
    move |p| {
        let [x, y, z] =
            (p + 3.5).round().clamp(DVec3::ZERO, DVec3::splat(7.0)).to_array().map(|x| x as usize);
        values[(z * 8 + y) * 8 + x]
    }
}

fn check_random(seed: u64, choose: impl Fn(&mut ChaCha8Rng) -> f64) {
    let field = Formula::new(2.5, random_field(seed, choose));
    let options = MarchingCubesOptions { grid: 5, refinement: 0, bounds: None };
    let found = marching_cubes(&field, &options, &NoProgress).unwrap();
    assert_eq!(found.cells, [7; 3]);
    let report = ValidationReport::of(&found.mesh);
    assert!(report.is_oriented_manifold(), "seed {seed}: {report}");
    assert_eq!(report.degenerate_faces.count, 0, "seed {seed}");
    for h in found.mesh.topology().halfedges().filter(|&h| found.mesh.topology().twin(h).is_none()) {
        let ends = [found.mesh.topology().tail(h), found.mesh.topology().tip(h)]
            .map(|v| found.mesh.positions()[v.index()]);
        let on_border = (0..3).any(|k| ends.iter().all(|p| p[k].abs() > 3.5 - 1e-9));
        assert!(on_border, "seed {seed}: boundary edge inside the grid: {ends:?}");
    }
}

#[test]
fn random_values_give_manifolds() {
    for seed in 0..300 {
        check_random(seed, |rng| rng.random::<f64>() - 0.5);
    }
}

#[test]
fn rare_and_common_insides_give_manifolds() {
    for seed in 0..150 {
        check_random(seed, |rng| rng.random::<f64>() - 0.8);
        check_random(seed, |rng| rng.random::<f64>() - 0.2);
    }
}

#[test]
fn values_at_the_level_and_nan_give_manifolds() {
    for seed in 0..300 {
        check_random(seed, |rng| f64::from(rng.random_range(-1..=1)));
        check_random(seed, |rng| {
            [-1.0, 1.0, 0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300][rng.random_range(0..7)]
        });
    }
}

#[test]
fn euler_characteristics_are_those_of_the_shapes() {
    let genus_two = |p: DVec3| {
        let (a, b) = (torus_at(p, -0.75), torus_at(p, 0.75));
        a.min(b)
    };
    let torus = |p: DVec3| torus_at(p, 0.0);
    let gyroid_ball = |p: DVec3| {
        let g = p.x.sin() * p.y.cos() + p.y.sin() * p.z.cos() + p.z.sin() * p.x.cos();
        g.max(p.length() - 6.0)
    };
    assert_eq!(mesh_of(&Formula::new(1.0, sphere), 20).mesh.topology().euler_characteristic(), 2);
    assert_eq!(mesh_of(&Formula::new(1.0, torus), 30).mesh.topology().euler_characteristic(), 0);
    assert_eq!(mesh_of(&Formula::new(1.7, genus_two), 50).mesh.topology().euler_characteristic(), -2);
    let coarse = mesh_of(&Formula::new(6.0, gyroid_ball), 60).mesh.topology().euler_characteristic();
    assert_eq!(coarse, mesh_of(&Formula::new(6.0, gyroid_ball), 110).mesh.topology().euler_characteristic());
}

#[test]
fn orientation_is_outward_on_both_sides_of_the_level() {
    let below = Formula::new(1.0, sphere);
    let above = Formula {
        inside: Inside::Above,
        ..Formula::new(1.0, |p: DVec3| (-2.0 * p.length_squared()).exp() - 0.2)
    };
    for mesh in [mesh_of(&below, 16).mesh, mesh_of(&above, 16).mesh] {
        assert!(mesh.signed_volume() > 0.5);
        assert_eq!(mesh.topology().boundary_edge_count(), 0);
    }
}

/// Largest distance of the centroids of faces from the unit sphere.
fn sphere_error(mesh: &ManifoldMesh) -> f64 {
    let faces = mesh.face_indices().map(|f| mesh.corner_positions(f));
    faces.map(|[a, b, c]| sphere((a + b + c) / 3.0).abs()).fold(0.0, f64::max)
}

#[test]
fn distance_to_a_sphere_is_of_second_order() {
    // A field far from linear: only the search along the edges makes the vertices lie on the sphere.
    let field = Formula::new(1.0, |p: DVec3| p.length_squared().powi(4) - 1.0);
    let errors = [16, 32, 64].map(|grid| sphere_error(&mesh_of(&field, grid).mesh));
    assert!(errors[0] / errors[1] > 3.0 && errors[1] / errors[2] > 3.0, "{errors:?}");
    let off = |grid| {
        let found = mesh_of(&field, grid);
        found.mesh.positions().iter().map(|&p| sphere(p).abs()).fold(0.0, f64::max) / found.cell
    };
    assert!(off(32) < 2e-3, "{}", off(32));
}

#[test]
fn steps_are_found_by_bisection() {
    let field = Formula::new(1.0, |p: DVec3| if sphere(p) < 0.0 { -1.0 } else { 1.0 });
    let found = mesh_of(&field, 24);
    let off = found.mesh.positions().iter().map(|&p| sphere(p).abs()).fold(0.0, f64::max);
    assert!(off < 0.01 * found.cell, "{}", off / found.cell);
}

#[test]
fn a_lipschitz_bound_saves_looks_and_changes_nothing() {
    for shape in
        [sphere as fn(DVec3) -> f64, |p| torus_at(p, 0.1), |p| sphere(p * 1.9 - DVec3::splat(0.3)) / 1.9]
    {
        let plain = mesh_of(&Formula::new(1.1, shape), 67);
        let bounded = mesh_of(&Formula { lipschitz: Some(1.0), ..Formula::new(1.1, shape) }, 67);
        let sorted = |mesh: &ManifoldMesh| {
            let mut all: Vec<_> = mesh.positions().iter().map(|p| p.to_array().map(f64::to_bits)).collect();
            all.sort_unstable();
            all
        };
        assert_eq!(sorted(&plain.mesh), sorted(&bounded.mesh));
        assert_eq!(plain.mesh.face_count(), bounded.mesh.face_count());
        assert!(bounded.evaluations * 3 < plain.evaluations, "{} {}", bounded.evaluations, plain.evaluations);
    }
}

#[test]
fn thread_counts_change_nothing() {
    let field = Formula { lipschitz: Some(1.0), ..Formula::new(1.1, |p| torus_at(p, 0.1)) };
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| mesh_of(&field, 40)).mesh.into_triangle_mesh()
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn errors_say_what_is_wrong() {
    let options = |grid| MarchingCubesOptions { grid, ..Default::default() };
    let far = Formula::new(1.0, |p: DVec3| p.length() + 1.0);
    let run =
        |field: &dyn ImplicitField, grid| marching_cubes(field, &options(grid), &NoProgress).unwrap_err();
    assert!(matches!(run(&far, 8), IsosurfaceError::NoCrossing { .. }));
    assert_eq!(run(&far, 0), IsosurfaceError::GridSize(0));
    assert!(run(&far, 100_000).to_string().contains("not 100000"));
    assert!(matches!(run(&Formula::new(-1.0, sphere), 8), IsosurfaceError::Bounds(_)));
    let error = run(&Formula::new(f64::NAN, sphere), 8);
    assert!(matches!(error, IsosurfaceError::Bounds(_)) && error.to_string().contains("[NaN, NaN, NaN] to"));
    let liar = Formula {
        lipschitz: Some(0.01),
        ..Formula::new(1.0, |p: DVec3| 0.3 * (9.0 * p.x).sin() + 0.3 * (7.0 * p.y).cos() * (8.0 * p.z).sin())
    };
    match marching_cubes(&liar, &options(32), &NoProgress) {
        Ok(found) => assert!(ValidationReport::of(&found.mesh).is_oriented_manifold()),
        Err(e) => {
            assert!(matches!(
                e,
                IsosurfaceError::NoCrossing { .. } | IsosurfaceError::WrongLipschitzBound(_)
            ));
        }
    }
    struct Stop;
    impl Progress for Stop {
        fn report(&self, _: &str, _: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let cancelled = marching_cubes(&Formula::new(1.0, sphere), &options(8), &Stop);
    assert_eq!(cancelled.unwrap_err(), IsosurfaceError::Cancelled);
}
