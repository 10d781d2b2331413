use ndf_core::{DVec3, NoProgress};
use ndf_mesh::{ManifoldMesh, shapes};
use ndf_meshing::split_edges;

use super::*;

fn sphere(levels: u32) -> ManifoldMesh {
    ManifoldMesh::try_from(shapes::icosphere(levels)).unwrap()
}

/// A sphere with bumps, without symmetry.
fn bumpy(levels: u32) -> ManifoldMesh {
    ManifoldMesh::try_from(shapes::icosphere(levels).map_positions(bump)).unwrap()
}

fn bump(p: DVec3) -> DVec3 {
    let waves = (5.0 * p.x + 1.0).sin() * (4.0 * p.y).sin() + 0.5 * (9.0 * p.z + p.x).sin();
    p * (1.0 + 0.1 * waves) * DVec3::new(1.0, 1.2, 1.5)
}

fn truth(mesh: ManifoldMesh) -> Truth {
    Truth::new(mesh, &ProtocolOptions::default(), &NoProgress).unwrap()
}

fn errors(truth: &Truth, mesh: &ManifoldMesh) -> Errors {
    let solved = truth.solve(&Candidate::of_mesh(mesh), &SourceRule::ALL, &NoProgress).unwrap();
    truth.errors(&solved, LengthFactors::ONE)
}

/// By what power of the edge errors of meshes fall, each with half the edge of the one before.
fn order(errors: &[f64]) -> f64 {
    let [.., coarse, fine] = errors else { panic!("two errors at least") };
    (coarse / fine).log2()
}

#[test]
fn on_spheres_eigenvalues_and_distances_are_those_of_the_closed_form_to_second_order() {
    // l (l + 1), each 2l + 1 times.
    let exact: Vec<f64> =
        (0..).flat_map(|l| (0..2 * l + 1).map(move |_| f64::from(l * (l + 1)))).take(20).collect();
    let (mut of_eigenvalues, mut of_distances) = (Vec::new(), Vec::new());
    for levels in 3..6 {
        let truth = truth(sphere(levels));
        of_eigenvalues.push(eigenvalue_errors(&exact, &truth.spectrum().modes().eigenvalues, 1.0).mean);
        // Distances are great circles.
        let distances = truth.distances();
        let positions = distances.targets().iter().map(|&v| truth.mesh().positions()[v as usize]);
        let sources = distances.sources().map(DVec3::normalize);
        let arcs =
            positions.zip(&distances.distances()[0]).map(|(p, d)| (p.angle_between(sources[0]) - d).abs());
        of_distances.push(arcs.sum::<f64>() / distances.targets().len() as f64);
    }
    assert!(of_eigenvalues[2] < 1.5e-3 && of_distances[2] < 1.5e-3, "{of_eigenvalues:?} {of_distances:?}");
    for errors in [&of_eigenvalues, &of_distances] {
        assert!((order(errors) - 2.0).abs() < 0.1, "{errors:?}");
    }
}

#[test]
fn errors_of_coarser_meshes_fall_with_the_square_of_their_edges() {
    let truth = truth(bumpy(6));
    let found = [3, 4, 5].map(|levels| errors(&truth, &bumpy(levels)));
    let of = |error: fn(&Errors) -> f64| found.each_ref().map(error);
    let all = [of(|e| e.distances_carried.unwrap().mean()), of(|e| e.eigenvalues.mean), of(|e| e.modes.mean)];
    for errors in all {
        let order = order(&errors);
        assert!((1.5..2.7).contains(&order), "{errors:?}");
    }
}

#[test]
fn a_mesh_has_no_error_against_itself() {
    let mesh = bumpy(4);
    let found = errors(&truth(mesh.clone()), &mesh);
    let [carried, own] = [found.distances_carried.unwrap(), found.distances_own.unwrap()];
    assert!(carried.max() < 1e-9 && own.max() < 1e-9, "{found:?}");
    assert!(found.eigenvalues.max < 1e-9 && found.modes.max < 1e-6, "{found:?}");
}

#[test]
fn errors_do_not_depend_on_place_and_unit() {
    let [fine, coarse] = [bumpy(5), bumpy(3)];
    let moved = |mesh: &ManifoldMesh| {
        mesh.with_positions(mesh.positions().iter().map(|&p| 37.0 * p + DVec3::new(4.0, -9.0, 1.0)).collect())
    };
    let here = errors(&truth(fine.clone()), &coarse);
    let there = errors(&truth(moved(&fine)), &moved(&coarse));
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    for (here, there) in
        [(here.distances_carried, there.distances_carried), (here.distances_own, there.distances_own)]
    {
        let (here, there) = (here.unwrap(), there.unwrap());
        near(here.share(), there.share());
        near(37.0 * here.mean(), there.mean());
        near(37.0 * here.max(), there.max());
    }
    near(here.eigenvalues.mean, there.eigenvalues.mean);
    near(here.modes.mean, there.modes.mean);
}

/// Two triangulations of one surface, of which the coarse one is dense on one side: its mean is that of the surface only if it is taken over
/// the area.
#[test]
fn means_over_the_area_are_those_of_the_surface() {
    let crowded = shapes::icosphere(4).map_positions(|p| bump((p + 0.6 * DVec3::Z).normalize()));
    let (surface, other) = (ManifoldMesh::try_from(crowded).unwrap(), bumpy(2));
    let mean = |edge: f64, averaging: Averaging| {
        let divided = split_edges(&surface, edge, &NoProgress).unwrap();
        let distances = DistanceProtocol { averaging, ..DistanceProtocol::default() };
        let options = ProtocolOptions { distances, ..ProtocolOptions::default() };
        let truth = Truth::new(divided, &options, &NoProgress).unwrap();
        errors(&truth, &other).distances_carried.unwrap().mean()
    };
    let truth = mean(0.025, Averaging::Area);
    let off =
        [Averaging::Area, Averaging::Vertices].map(|averaging| (mean(1.0, averaging) / truth - 1.0).abs());
    assert!(off[0] < 0.01 && off[1] > 0.03, "{off:?}");
}

#[test]
fn factors_multiply_lengths() {
    let mesh = bumpy(4);
    let truth = truth(mesh.clone());
    let solved = truth.solve(&Candidate::of_mesh(&mesh), &[SourceRule::Own], &NoProgress).unwrap();
    let found = truth.errors(&solved, LengthFactors { operators: 1.02, distances: 0.97 });
    assert!((found.distances_own.unwrap().share() - 0.03).abs() < 1e-9);
    assert!((found.eigenvalues.mean - (1.0 - 1.02_f64.powi(-2))).abs() < 1e-9);
    assert!(found.distances_carried.is_none() && found.modes.max < 1e-6);
}

#[test]
fn operators_may_be_on_another_triangulation_of_the_surface() {
    let mesh = bumpy(3);
    let truth = truth(bumpy(5));
    let intrinsic = IntrinsicMesh::from_mesh(&mesh);
    let on_other = Candidate { mesh: &mesh, operators_on: Some(&intrinsic) };
    let solved = truth.solve(&on_other, &[], &NoProgress).unwrap();
    let same = errors(&truth, &mesh);
    let found = truth.errors(&solved, LengthFactors::ONE);
    assert_eq!((found.eigenvalues, found.modes), (same.eigenvalues, same.modes));
}

#[test]
fn modes_are_matched_by_sign_and_within_clusters() {
    let n = 400;
    let wave = |k: f64, phase: f64| -> Vec<f64> {
        (0..n).map(|i| (k * f64::from(i) / f64::from(n) * std::f64::consts::TAU + phase).sin()).collect()
    };
    let areas = vec![1.0 / f64::from(n); n as usize];
    // Sines and cosines are a cluster each; the last is left out.
    let eigenvalues = [0.0, 1.0, 1.001, 4.0, 9.0];
    let quarter = std::f64::consts::FRAC_PI_2;
    let modes = |phase: f64, sign: f64| {
        let last = wave(2.0, 0.0).into_iter().map(|x| sign * x).collect();
        vec![vec![1.0; n as usize], wave(1.0, phase), wave(1.0, phase + quarter), last, wave(3.0, phase)]
    };
    let same = mode_errors(&eigenvalues, &modes(0.0, 1.0), &modes(0.7, -2.0), &areas);
    assert!(same.max < 1e-9, "{same:?}");
    let mut other = modes(0.0, 1.0);
    other[3] = wave(5.0, 0.0);
    let unrelated = mode_errors(&eigenvalues, &modes(0.0, 1.0), &other, &areas);
    assert!((unrelated.max - 2.0_f64.sqrt()).abs() < 1e-9, "{unrelated:?}");
    assert!((unrelated.mean - unrelated.max / 3.0).abs() < 1e-9);
}
