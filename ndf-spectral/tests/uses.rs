//! What modes and factorisations are for.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::f64::consts::PI;

use approx::assert_relative_eq;
use ndf_core::progress::NoProgress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::shapes;
use ndf_spectral::{LaplaceBeltrami, ModeOptions, Modes, OperatorOptions, ScreenedPoisson, SpectralDistance};

/// The unit sphere: positions, operator, and modes up to degree five.
fn sphere() -> (Vec<glam::DVec3>, LaplaceBeltrami, Modes) {
    let mesh = ManifoldMesh::try_from(shapes::icosphere(4)).unwrap();
    let operator =
        LaplaceBeltrami::new(&IntrinsicMesh::from_mesh(&mesh), OperatorOptions::default()).unwrap();
    let options = ModeOptions { count: 36, ..ModeOptions::default() };
    let modes = operator.modes(&options, &NoProgress).unwrap();
    (mesh.positions().to_vec(), operator, modes)
}

#[test]
fn heat_kernel_signatures_of_spheres_are_constant() {
    let (_, _, modes) = sphere();
    let times = modes.heat_times(5);
    assert!(times.is_sorted() && times.len() == 5);
    let signatures = modes.heat_kernel_signatures(&times);
    for (t, time) in times.iter().enumerate() {
        // Of degree l there are 2l + 1 functions whose squares sum to (2l + 1) / 4π everywhere.
        let exact: f64 =
            (0..6).map(|l| f64::from(2 * l + 1) / (4.0 * PI) * (-f64::from(l * (l + 1)) * time).exp()).sum();
        for v in [0, 100, 2000] {
            assert_relative_eq!(signatures[t][v], exact, max_relative = 0.02);
        }
    }
    let waves = modes.wave_kernel_signatures(20);
    for e in 0..20 {
        assert_relative_eq!(waves[e][0], 1.0 / (4.0 * PI), max_relative = 0.05);
        assert_relative_eq!(waves[e][0], waves[e][1234], max_relative = 0.05);
    }
}

#[test]
fn spectral_distances_grow_with_the_angle() {
    let (positions, _, modes) = sphere();
    for kind in [SpectralDistance::Biharmonic, SpectralDistance::Commute, SpectralDistance::Diffusion(0.2)] {
        let distances = modes.distances_from(7, kind).unwrap();
        assert_eq!(distances[7], 0.0);
        let mut order: Vec<usize> = (0..positions.len()).collect();
        order.sort_by(|&a, &b| positions[b].dot(positions[7]).total_cmp(&positions[a].dot(positions[7])));
        // By degrees: the sum over the functions of one degree is (2l+1)/2π (1 − P_l(cos angle)).
        let far = distances[order[positions.len() - 1]];
        let (near, middle) = (distances[order[60]], distances[order[positions.len() / 2]]);
        assert!(near < middle && middle < 1.05 * far, "{kind:?}: {near} {middle} {far}");
    }
    let opposite = (0..positions.len())
        .min_by(|&a, &b| positions[a].dot(positions[7]).total_cmp(&positions[b].dot(positions[7])));
    let distances = modes.distances_from(7, SpectralDistance::Biharmonic).unwrap();
    let exact: f64 =
        [1, 3, 5].map(|l| f64::from(2 * l + 1) / PI / f64::from(l * (l + 1)).powi(2)).iter().sum();
    assert_relative_eq!(distances[opposite.unwrap()], exact.sqrt(), max_relative = 0.02);
    assert!(modes.distances_from(0, SpectralDistance::Diffusion(-1.0)).is_err());
}

#[test]
fn low_pass_filters_keep_what_is_smooth() {
    let (positions, operator, modes) = sphere();
    let smooth: Vec<f64> = positions.iter().map(|p| 1.0 + p.x - 2.0 * p.y).collect();
    let rough: Vec<f64> = positions.iter().zip(&smooth).map(|(p, s)| s + p.x * p.y).collect();
    for (kept, expected) in modes.low_pass(&operator, &rough, 4.0).iter().zip(&smooth) {
        assert_relative_eq!(kept, expected, epsilon = 5e-3);
    }
    let heated = modes.filtered(&operator, &rough, |lambda| (-0.1 * lambda).exp());
    for (heated, p) in heated.iter().zip(&positions) {
        let exact = 1.0 + (-0.2_f64).exp() * (p.x - 2.0 * p.y) + (-0.6_f64).exp() * p.x * p.y;
        assert_relative_eq!(*heated, exact, epsilon = 5e-3);
    }
}

#[test]
fn one_factorisation_serves_modes_poisson_and_heat() {
    let (positions, operator, modes) = sphere();
    let solver = ScreenedPoisson::new(&operator, 0.5).unwrap();
    let again = solver.modes(&ModeOptions { count: 36, ..ModeOptions::default() }, &NoProgress).unwrap();
    assert_relative_eq!(again.eigenvalues[..], modes.eigenvalues[..], max_relative = 1e-9, epsilon = 1e-9);
    // Of degree two: −Δu = 6u.
    let f: Vec<f64> = positions.iter().map(|p| p.x * p.y).collect();
    let u = solver.poisson(&f).unwrap();
    let residual: Vec<f64> = operator
        .laplacian()
        .multiply(&u)
        .iter()
        .zip(operator.mass().multiply(&f))
        .map(|(l, m)| l - m)
        .collect();
    assert!(residual.iter().all(|r| r.abs() < 1e-12));
    for (u, f) in u.iter().zip(&f) {
        assert_relative_eq!(*u, f / 6.0, epsilon = 1e-3);
    }
    for time in [2.0, 0.1] {
        let flow = solver.with_shift(1.0 / time).unwrap();
        for (warm, f) in flow.heat_step(&f).iter().zip(&f) {
            assert_relative_eq!(*warm, f / (1.0 + 6.0 * time), epsilon = 1e-3);
        }
    }
    let total = |u: &[f64]| operator.mass().multiply(u).iter().sum::<f64>();
    let spot: Vec<f64> = (0..positions.len()).map(|v| f64::from(u8::from(v == 11))).collect();
    assert_relative_eq!(total(&solver.heat_step(&spot)), total(&spot), max_relative = 1e-10);
}
