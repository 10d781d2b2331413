use super::*;
use ndf_core::{DVec3, NoProgress};
use ndf_mesh::{TriangleMesh, shapes};
use ndf_meshing::{DecimationOptions, decimate};

/// A sphere with bumps: no symmetry, so that eigenvalues are simple, and many vertices that are not needed.
fn bumpy(levels: u32) -> ManifoldMesh {
    let bump = |p: DVec3| {
        let waves = (5.0 * p.x + 1.0).sin() * (4.0 * p.y).sin() + 0.5 * (9.0 * p.z + p.x).sin();
        p * (1.0 + 0.15 * waves) * DVec3::new(1.0, 1.2, 1.5)
    };
    ManifoldMesh::try_from(shapes::icosphere(levels).map_positions(bump)).unwrap()
}

/// Mean relative error of the 20 smallest eigenvalues but the first, which is zero.
fn error(simple: &ManifoldMesh, mesh: &ManifoldMesh) -> f64 {
    let [found, exact] = [simple, mesh].map(|m| plain_modes(m, 20, &NoProgress).unwrap().1.eigenvalues);
    found.iter().zip(&exact).skip(1).map(|(f, e)| (f - e).abs() / e).sum::<f64>() / 19.0
}

#[test]
fn modes_are_kept_better_than_by_quadrics() {
    let mesh = bumpy(4);
    let options = SmsOptions { faces: 600, modes: 60 };
    let simple = spectral_simplification(&mesh, &options, &NoProgress).unwrap();
    assert!(simple.reached && simple.mesh.face_count() == 600 && simple.energy.is_finite());
    assert_eq!(simple.mesh.topology().euler_characteristic(), 2);
    let quadrics = decimate(&mesh, &DecimationOptions::to_faces(600), &NoProgress).mesh;
    let [ours, theirs] =
        [&simple.mesh, &quadrics].map(|coarse| SpectralFidelity::of(&mesh, coarse, 60, &NoProgress).unwrap());
    assert!(ours.commutativity < 0.4 * theirs.commutativity, "{ours:?} {theirs:?}");
    assert!(ours.orthogonality < 0.8 * theirs.orthogonality, "{ours:?} {theirs:?}");
}

#[test]
fn the_first_eigenvalues_are_kept_better_than_by_quadrics() {
    let mesh = bumpy(4);
    let simple = spectral_simplification(&mesh, &SmsOptions::to_faces(1000), &NoProgress).unwrap().mesh;
    let quadrics = decimate(&mesh, &DecimationOptions::to_faces(1000), &NoProgress).mesh;
    let (ours, theirs) = (error(&simple, &mesh), error(&quadrics, &mesh));
    assert!(ours < 0.6 * theirs, "{ours} {theirs}");
}

#[test]
fn step_by_step_is_as_at_once() {
    let mesh = bumpy(3);
    let mut steps = SpectralSimplification::new(&mesh, 20, &NoProgress).unwrap();
    for faces in [1000, 600, 800, 300] {
        let step = steps.to_faces(faces, &NoProgress).unwrap();
        let options = SmsOptions::to_faces(faces.min(step.mesh.face_count()));
        let at_once = spectral_simplification(&mesh, &options, &NoProgress).unwrap();
        assert!(step.reached);
        assert_eq!(step.mesh.positions(), at_once.mesh.positions());
        assert_eq!(step.mesh.faces(), at_once.mesh.faces());
    }
}

#[test]
fn a_mesh_is_true_to_itself() {
    let mesh = bumpy(3);
    let same = SpectralFidelity::of(&mesh, &mesh, 12, &NoProgress).unwrap();
    assert!(same.commutativity < 1e-12 && same.orthogonality < 1e-12, "{same:?}");
}

/// Every term is that of a Laplacian assembled anew.
#[test]
fn terms_follow_the_mesh() {
    let mesh = bumpy(2);
    let n = mesh.vertex_count();
    let functions: Vec<f64> =
        mesh.positions().iter().flat_map(|p| [p.x, (p.y * 2.0).sin(), p.z * p.x]).collect();
    let images: Vec<f64> = (0..3 * n).map(|i| (i as f64).cos()).collect();
    let mut energy = Energy::new(EditableMesh::new(&mesh), 3, functions, images);
    let mut expected = energy.total();
    for _ in 0..60 {
        // The cost of a collapse is the change of the whole.
        let mesh = &energy.mesh;
        let possible = mesh.halfedges().filter(|&h| !mesh.is_hole(h) && mesh.is_collapsible(h));
        let cheapest = possible.filter_map(|h| Some((h, best_place(&energy, h)?))).next();
        let Some((h, (cost, share))) = cheapest else { break };
        assert!(energy.collapse_at(h, share).is_some());
        expected += cost;
        let total = energy.total();
        assert!((total - expected).abs() < 1e-9 * total.abs().max(1.0), "{total} {expected}");
    }
    let anew = energy.assembled_anew();
    assert!((anew - energy.total()).abs() < 1e-9 * anew, "{anew}");
}

#[test]
fn boundaries_stay_and_hopeless_targets_are_said() {
    let wave = shapes::grid(12, 12).map_positions(|p| p.with_z(0.1 * (7.0 * p.x).sin()));
    let mesh = ManifoldMesh::try_from(wave).unwrap();
    let options = SmsOptions { faces: 100, modes: 6 };
    let simple = spectral_simplification(&mesh, &options, &NoProgress).unwrap();
    assert!(simple.mesh.topology().boundary_edge_count() > 0);
    let (before, after) = (mesh.bounds(), simple.mesh.bounds());
    assert!(before.extent().truncate().distance(after.extent().truncate()) < 0.2);

    let tetrahedron = TriangleMesh::new(
        vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
        vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
    );
    let mesh = ManifoldMesh::try_from(tetrahedron.unwrap()).unwrap();
    let stuck = spectral_simplification(&mesh, &SmsOptions { faces: 2, modes: 3 }, &NoProgress).unwrap();
    assert!(!stuck.reached && stuck.mesh.face_count() == 4);
}

#[test]
fn threads_change_nothing() {
    let mesh = bumpy(3);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = SmsOptions { faces: 300, modes: 8 };
        pool.install(|| spectral_simplification(&mesh, &options, &NoProgress).unwrap().mesh)
    };
    let (one, three) = (on(1), on(3));
    assert_eq!((one.positions(), one.faces()), (three.positions(), three.faces()));
}
