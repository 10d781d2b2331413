//! Laws that eigenmodes obey, on surfaces whose spectra are known.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::f64::consts::{PI, TAU};

use approx::assert_relative_eq;
use glam::{DQuat, DVec3};
use nalgebra_sparse::na::DMatrix;
use ndf_core::progress::{NoProgress, Progress};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::Topology;
use ndf_mesh::{Halfedge, TriangleMesh, shapes};
use ndf_spectral::{
    CsrMatrix, Inversion, LaplaceBeltrami, Mass, ModeOptions, Modes, OperatorOptions, SpectralError,
};

fn intrinsic(mesh: TriangleMesh) -> IntrinsicMesh {
    IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh).unwrap())
}

fn operator(mesh: TriangleMesh, mass: Mass) -> LaplaceBeltrami {
    LaplaceBeltrami::new(&intrinsic(mesh), OperatorOptions { mass, delaunay: true }).unwrap()
}

fn modes(operator: &LaplaceBeltrami, count: usize) -> Modes {
    let options = ModeOptions { count, ..ModeOptions::default() };
    operator.modes(&options, &NoProgress).unwrap()
}

/// Residuals, orthonormality, order, sign, and that nothing is missing.
fn check(operator: &LaplaceBeltrami, modes: &Modes) {
    assert!(modes.verified);
    assert!(modes.max_residual() <= 1e-8, "residual {:e}", modes.max_residual());
    for (i, function) in modes.functions.iter().enumerate() {
        for (j, product) in modes.coefficients(operator, function).into_iter().enumerate() {
            let error = (product - f64::from(u8::from(i == j))).abs();
            assert!(error <= 1e-10, "orthonormal to {error:e}");
        }
    }
    assert!(modes.eigenvalues.is_sorted());
    for function in modes.functions.iter() {
        let largest = function.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap();
        let max = function.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!(largest > 0.0 || max >= (1.0 - 1e-6) * -largest);
    }
}

/// A bumpy sphere without symmetries.
fn potato(levels: u32) -> TriangleMesh {
    shapes::icosphere(levels).map_positions(|p| {
        let bump = 1.0 + 0.2 * (3.0 * p.x + 1.0).sin() + 0.15 * (4.0 * p.y).cos() + 0.1 * p.z;
        DVec3::new(1.0, 1.3, 0.8) * p * bump
    })
}

#[test]
fn modes_without_a_factorisation_are_those_with_one() {
    let two = {
        let (mut positions, mut faces) = potato(4).into_parts();
        let (others, more) = shapes::torus(70, 40, 1.0, 0.4).into_parts();
        let first = positions.len() as u32;
        positions.extend(others.into_iter().map(|p| p + DVec3::X * 5.0));
        faces.extend(more.into_iter().map(|face| face.map(|v| v + first)));
        TriangleMesh::new(positions, faces).unwrap()
    };
    for (mesh, held) in [(potato(5), 0), (two, 0), (shapes::grid(90, 70), 0), (potato(5), 40)] {
        let operator = operator(mesh, Mass::Barycentric);
        let held: Vec<bool> = (0..operator.vertex_count()).map(|v| v < held).collect();
        let options = ModeOptions { count: 25, ..ModeOptions::default() };
        let without = ModeOptions { inversion: Inversion::Multigrid, ..options };
        let expected = operator.modes_holding(&held, &options, &NoProgress).unwrap();
        let found = operator.modes_holding(&held, &without, &NoProgress).unwrap();
        assert!(!found.verified && found.max_residual() <= 1e-8, "residual {:e}", found.max_residual());
        for (found, expected) in found.eigenvalues.iter().zip(&expected.eigenvalues) {
            assert!((found - expected).abs() <= 1e-10 * expected, "{found} {expected}");
        }
        // Of the first ones, as multiple eigenvalues may end the others.
        for i in 0..15 {
            let products = expected.coefficients(&operator, found.mode(i));
            let within: f64 = products.iter().map(|x| x * x).sum();
            assert!((within - 1.0).abs() < 1e-12, "{within}");
        }
    }
}

#[test]
fn modes_agree_with_a_dense_solver() {
    for (mesh, count) in [(potato(3), 30), (shapes::torus(40, 18, 1.0, 0.4), 12), (shapes::grid(24, 20), 25)]
    {
        for mass in [Mass::Barycentric, Mass::MixedVoronoi, Mass::Consistent] {
            let operator = operator(mesh.clone(), mass);
            let modes = modes(&operator, count);
            check(&operator, &modes);
            let dense = |matrix: &CsrMatrix| {
                let mut dense = DMatrix::zeros(matrix.row_count(), matrix.column_count());
                matrix.entries().for_each(|(i, j, x)| dense[(i, j)] = x);
                dense
            };
            let inverse = dense(operator.mass()).cholesky().unwrap().l().try_inverse().unwrap();
            let reduced = &inverse * dense(operator.laplacian()) * inverse.transpose();
            let mut expected = reduced.symmetric_eigenvalues().as_slice().to_vec();
            expected.sort_by(f64::total_cmp);
            for (found, expected) in modes.eigenvalues.iter().zip(&expected) {
                assert_relative_eq!(found, expected, max_relative = 1e-9, epsilon = 1e-9);
            }
        }
    }
}

#[test]
fn spheres_have_eigenvalues_l_times_l_plus_one_at_second_order() {
    let exact: Vec<f64> = (0..5_u32).flat_map(|l| (0..=2 * l).map(move |_| f64::from(l * (l + 1)))).collect();
    for mass in [Mass::Barycentric, Mass::MixedVoronoi, Mass::Consistent] {
        let errors: Vec<f64> = [3, 4, 5]
            .map(|levels| {
                let operator = operator(shapes::icosphere(levels), mass);
                let modes = modes(&operator, exact.len());
                check(&operator, &modes);
                let error = |(found, exact): (&f64, &f64)| (found - exact).abs() / exact.max(1.0);
                modes.eigenvalues.iter().zip(&exact).map(error).fold(0.0, f64::max)
            })
            .to_vec();
        for pair in errors.windows(2) {
            assert!((3.6..4.4).contains(&(pair[0] / pair[1])), "{mass:?}: {errors:?}");
        }
        assert!(errors[2] < 5e-3, "{mass:?}: {errors:?}");
    }
}

/// The smallest values of `a·i² + b·j²` over ranges of integers.
fn smallest(count: usize, range: std::ops::Range<i32>, a: f64, b: f64) -> Vec<f64> {
    let both = |i: i32| range.clone().map(move |j| a * f64::from(i * i) + b * f64::from(j * j));
    let mut all: Vec<f64> = range.clone().flat_map(both).collect();
    all.sort_by(f64::total_cmp);
    all.truncate(count);
    all
}

/// A flat torus, known by its lengths alone: an `m` × `n` grid of a rectangle with opposite sides glued.
fn flat_torus(m: u32, n: u32, width: f64, height: f64) -> IntrinsicMesh {
    let vertex = |i: u32, j: u32| (i % m) + m * (j % n);
    let mut tails = Vec::new();
    let mut twins = Vec::new();
    // Faces 2q and 2q + 1 of quad q: half-edges right, up, diagonal back; and diagonal, left, down.
    let face = |i: u32, j: u32| 2 * vertex(i, j);
    for j in 0..n {
        for i in 0..m {
            tails.extend([vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1)]);
            tails.extend([vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1)]);
            let below = face(i, j + n - 1) + 1;
            let right = face(i + 1, j) + 1;
            let own = face(i, j);
            twins.extend([3 * below + 1, 3 * right + 2, 3 * (own + 1)].map(Halfedge));
            twins.extend([3 * own + 2, 3 * face(i, j + 1), 3 * face(i + m - 1, j) + 1].map(Halfedge));
        }
    }
    let complex = Topology::from_gluing((m * n) as usize, &tails, &twins).unwrap();
    let (dx, dy) = (width / f64::from(m), height / f64::from(n));
    let lengths = complex
        .edges()
        .map(|e| match complex.edge_halfedge(e).0 % 6 {
            0 | 4 => dx,
            1 | 5 => dy,
            _ => dx.hypot(dy),
        })
        .collect();
    IntrinsicMesh::new(&complex, lengths, 0.0).unwrap()
}

#[test]
fn flat_tori_and_rectangles_have_the_eigenvalues_of_their_formulas() {
    let (width, height) = (3.0, 2.0);
    let torus = |n: u32| flat_torus(3 * n, 2 * n, width, height);
    let rectangle = |n: u32| {
        let grid = shapes::grid(3 * n, 2 * n);
        let size = grid.bounds().extent();
        intrinsic(grid.map_positions(|p| DVec3::new(p.x * width / size.x, p.y * height / size.y, p.z)))
    };
    let exact_torus = smallest(21, -9..10, (TAU / width).powi(2), (TAU / height).powi(2));
    let exact_rectangle = smallest(21, 0..12, (PI / width).powi(2), (PI / height).powi(2));
    for (mesh, exact) in
        [(&torus as &dyn Fn(u32) -> IntrinsicMesh, &exact_torus), (&rectangle, &exact_rectangle)]
    {
        let errors = [16, 32].map(|n| {
            let operator = LaplaceBeltrami::new(&mesh(n), OperatorOptions::default()).unwrap();
            let modes = modes(&operator, exact.len());
            check(&operator, &modes);
            let error = |(found, exact): (&f64, &f64)| (found - exact).abs() / exact.max(1.0);
            modes.eigenvalues.iter().zip(exact).map(error).fold(0.0, f64::max)
        });
        assert!((3.6..4.4).contains(&(errors[0] / errors[1])) && errors[1] < 0.01, "{errors:?}");
    }
}

#[test]
fn scaling_divides_eigenvalues_by_its_square_and_rigid_motion_keeps_them() {
    let reference = modes(&operator(potato(4), Mass::Barycentric), 20);
    for scale in [1e-6, 1e-3, 37.0, 1e6] {
        let operator = operator(potato(4).map_positions(|p| scale * p), Mass::Barycentric);
        let scaled = modes(&operator, 20);
        check(&operator, &scaled);
        for (a, b) in scaled.eigenvalues.iter().zip(&reference.eigenvalues) {
            assert_relative_eq!(a * scale * scale, b, max_relative = 1e-9);
        }
    }
    let rotation = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 1.1);
    let moved = potato(4).map_positions(|p| rotation * p + DVec3::new(3.0, -5.0, 2.0));
    let moved = modes(&operator(moved, Mass::Barycentric), 20);
    for (a, b) in moved.eigenvalues.iter().zip(&reference.eigenvalues) {
        assert_relative_eq!(a, b, max_relative = 1e-9);
    }
    assert_relative_eq!(moved.functions.values(), reference.functions.values(), epsilon = 1e-6);
}

#[test]
fn weights_are_not_negative_on_delaunay_triangulations() {
    let stretched = potato(4).map_positions(|p| DVec3::new(6.0 * p.x, p.y, 0.3 * p.z));
    let worst = |delaunay| {
        let options = OperatorOptions { delaunay, ..OperatorOptions::default() };
        let operator = LaplaceBeltrami::new(&intrinsic(stretched.clone()), options).unwrap();
        operator.laplacian().entries().filter(|(i, j, _)| i != j).map(|(_, _, x)| x).fold(-1.0, f64::max)
    };
    assert!(worst(false) > 0.1);
    assert!(worst(true) <= 1e-9);
}

#[test]
fn several_components_give_several_zeros() {
    let sphere = potato(3);
    let count = sphere.vertex_count() as u32;
    let mut positions = sphere.positions().to_vec();
    let mut faces = sphere.faces().to_vec();
    for copy in 1..3 {
        positions.extend(sphere.positions().iter().map(|p| *p + 10.0 * f64::from(copy) * DVec3::X));
        faces.extend(sphere.faces().iter().map(|f| f.map(|v| v + copy * count)));
    }
    let operator = operator(TriangleMesh::new(positions, faces).unwrap(), Mass::Barycentric);
    assert_eq!(operator.components().count(), 3);
    let all = modes(&operator, 24);
    check(&operator, &all);
    // Three equal surfaces: every eigenvalue three times.
    for (k, triple) in all.eigenvalues.chunks(3).enumerate() {
        assert_eq!(triple[0] == 0.0, k == 0);
        assert_relative_eq!(triple[0], triple[2], max_relative = 1e-9);
    }
    assert_eq!(modes(&operator, 2).eigenvalues, [0.0, 0.0]);
}

#[test]
fn meshes_that_are_no_manifolds_have_modes_through_the_tufted_cover() {
    // A manifold and its cover agree: plainly without flips, and with them too where the mesh is closed.
    let mesh = potato(3);
    for delaunay in [false, true] {
        let options = OperatorOptions { delaunay, ..OperatorOptions::default() };
        let direct = modes(&LaplaceBeltrami::new(&intrinsic(mesh.clone()), options).unwrap(), 10);
        let covered = modes(&LaplaceBeltrami::from_triangle_mesh(&mesh, options).unwrap(), 10);
        assert_relative_eq!(direct.eigenvalues[..], covered.eigenvalues[..], max_relative = 1e-9);
    }
    // A sphere with an equator of three sheets: a disc inside it.
    let mut faces = mesh.faces().to_vec();
    let extra: Vec<[u32; 3]> = faces.iter().take(40).map(|&[a, b, c]| [a, c, b]).collect();
    faces.extend(extra.iter().map(|&[a, b, _]| [a, b, 7]).filter(|[a, b, c]| a != c && b != c));
    let soup = TriangleMesh::new(mesh.positions().to_vec(), faces).unwrap();
    assert!(ManifoldMesh::try_from(soup.clone()).is_err());
    let operator = LaplaceBeltrami::from_triangle_mesh(&soup, OperatorOptions::default()).unwrap();
    check(&operator, &modes(&operator, 10));
}

#[test]
fn mistakes_are_refused() {
    let operator = operator(potato(3), Mass::Barycentric);
    let error = |options: ModeOptions| operator.modes(&options, &NoProgress).unwrap_err();
    let options = ModeOptions::default();
    assert!(matches!(error(ModeOptions { count: 9999, ..options }), SpectralError::TooManyModes { .. }));
    assert!(matches!(error(ModeOptions { shift: 0.0, ..options }), SpectralError::Shift(_)));
    assert!(matches!(error(ModeOptions { shift: f64::NAN, ..options }), SpectralError::Shift(_)));
    let impossible = ModeOptions { tolerance: 1e-30, max_restarts: 2, ..options };
    match error(impossible) {
        SpectralError::NotConverged { found, asked: 20, .. } => assert!(!found.is_empty()),
        other => panic!("{other}"),
    }
    struct Cancelled;
    impl Progress for Cancelled {
        fn report(&self, _: &str, _: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    assert!(matches!(operator.modes(&options, &Cancelled), Err(SpectralError::Cancelled(_))));
    let loose = TriangleMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], vec![[0, 1, 2]]).unwrap();
    let refused = LaplaceBeltrami::from_triangle_mesh(&loose, OperatorOptions::default());
    assert!(matches!(refused, Err(SpectralError::NoArea(3))));
}

#[test]
fn small_surfaces_and_all_their_modes() {
    let operator = operator(shapes::icosphere(1), Mass::Consistent);
    let all = modes(&operator, operator.vertex_count());
    check(&operator, &all);
    assert_eq!(all.len(), 42);
    assert!(modes(&operator, 0).is_empty());
}

#[test]
fn the_same_bytes_every_time() {
    let operator = operator(potato(4), Mass::Barycentric);
    assert_eq!(modes(&operator, 20), modes(&operator, 20));
}

/// A vertex so far away that its faces have all of the area, to the last digits: there is an answer or a reason.
#[test]
fn a_vertex_far_away_is_no_panic() {
    for away in [1e3, 1e5, 1e9, 1e15, 1e21] {
        let mut mesh = shapes::icosphere(3);
        let mut positions = mesh.positions().to_vec();
        positions[100] = DVec3::new(0.0, away, 0.0);
        mesh = TriangleMesh::new(positions, mesh.faces().to_vec()).unwrap();
        let options = ModeOptions { count: 5, ..ModeOptions::default() };
        let found = LaplaceBeltrami::new(&intrinsic(mesh), options.operator)
            .and_then(|operator| operator.modes(&options, &NoProgress));
        match found {
            Ok(modes) => assert!(modes.eigenvalues.iter().all(|x| x.is_finite()), "{away}"),
            Err(error) => assert!(error.to_string().len() > 20, "{error}"),
        }
    }
}

#[test]
fn many_modes_are_those_of_a_dense_solver_and_none_is_missing() {
    // Without symmetries; with eigenvalues of high multiplicity; with a boundary; in several equal parts.
    let sphere = potato(2);
    let count = sphere.vertex_count() as u32;
    let copied = |copy: u32| sphere.positions().iter().map(move |p| *p + 10.0 * f64::from(copy) * DVec3::X);
    let positions = (0..4).flat_map(copied).collect();
    let faces = (0..4).flat_map(|copy| sphere.faces().iter().map(move |f| f.map(|v| v + copy * count)));
    let four = TriangleMesh::new(positions, faces.collect()).unwrap();
    for mesh in [potato(3), shapes::icosphere(3), shapes::grid(30, 25), four] {
        let operator = operator(mesh, Mass::Barycentric);
        let few = modes(&operator, 100);
        let many = modes(&operator, 300);
        check(&operator, &many);
        for (a, b) in many.eigenvalues.iter().zip(&few.eigenvalues) {
            assert_relative_eq!(a, b, max_relative = 1e-9, epsilon = 1e-12);
        }
        let all = modes(&operator, operator.vertex_count());
        for (a, b) in many.eigenvalues.iter().zip(&all.eigenvalues) {
            assert_relative_eq!(a, b, max_relative = 1e-9, epsilon = 1e-9);
        }
    }
}

#[test]
fn modes_that_are_held_at_zero_are_those_of_intervals_and_of_discs() {
    // Of a rectangle with all sides held, and with two opposite ones: sin sin and sin cos.
    let (width, height) = (3.0, 2.0);
    let (a, b) = ((PI / width).powi(2), (PI / height).powi(2));
    let exact = |from: i32| {
        let all = (1..12).flat_map(|i| (from..12).map(move |j| a * f64::from(i * i) + b * f64::from(j * j)));
        let mut all: Vec<f64> = all.collect();
        all.sort_by(f64::total_cmp);
        all.truncate(21);
        all
    };
    for all_sides in [true, false] {
        let exact = exact(i32::from(all_sides));
        let errors = [16, 32].map(|n| {
            let grid = shapes::grid(3 * n, 2 * n);
            let size = grid.bounds().extent();
            let grid = grid.map_positions(|p| DVec3::new(p.x * width / size.x, p.y * height / size.y, p.z));
            let (low, high) = (grid.bounds().min, grid.bounds().max);
            let is_end = |x: f64, low: f64, high: f64| (x - low).min(high - x) < 1e-9;
            let held: Vec<bool> = (grid.positions().iter())
                .map(|p| is_end(p.x, low.x, high.x) || all_sides && is_end(p.y, low.y, high.y))
                .collect();
            let operator = operator(grid, Mass::Barycentric);
            let options = ModeOptions { count: exact.len(), ..ModeOptions::default() };
            let modes = operator.modes_holding(&held, &options, &NoProgress).unwrap();
            assert!(modes.verified);
            let products: Vec<Vec<f64>> =
                modes.functions.iter().map(|f| modes.coefficients(&operator, f)).collect();
            for (i, row) in products.iter().enumerate() {
                row.iter().enumerate().for_each(|(j, product)| {
                    assert_relative_eq!(*product, f64::from(u8::from(i == j)), epsilon = 1e-10);
                });
            }
            for function in modes.functions.iter() {
                assert!(function.iter().zip(&held).all(|(x, held)| !held || *x == 0.0));
            }
            let error = |(found, exact): (&f64, &f64)| (found - exact).abs() / exact;
            modes.eigenvalues.iter().zip(&exact).map(error).fold(0.0, f64::max)
        });
        assert!((3.6..4.4).contains(&(errors[0] / errors[1])) && errors[1] < 0.02, "{errors:?}");
    }
}

#[test]
fn parts_without_held_vertices_keep_their_zeros() {
    let part = shapes::grid(20, 20);
    let count = part.vertex_count() as u32;
    let moved = part.positions().iter().map(|p| *p + 100.0 * DVec3::X);
    let positions = part.positions().iter().copied().chain(moved).collect();
    let faces = part.faces().iter().copied().chain(part.faces().iter().map(|f| f.map(|v| v + count)));
    let two = TriangleMesh::new(positions, faces.collect()).unwrap();
    let both = operator(two, Mass::Barycentric);
    let single = operator(part, Mass::Barycentric);
    let options = ModeOptions { count: 12, ..ModeOptions::default() };
    // A corner of the first is held: its zero becomes an eigenvalue, the second keeps its own.
    let holding = |operator: &LaplaceBeltrami| {
        let held: Vec<bool> = (0..operator.vertex_count()).map(|v| v == 0).collect();
        operator.modes_holding(&held, &options, &NoProgress).unwrap().eigenvalues
    };
    let mut expected = holding(&single);
    assert!(expected[0] > 0.0);
    expected.extend(modes(&single, 12).eigenvalues);
    expected.sort_by(f64::total_cmp);
    for (a, b) in holding(&both).iter().zip(&expected) {
        assert_relative_eq!(a, b, max_relative = 1e-8);
    }
    let none = single.modes_holding(&vec![false; single.vertex_count()], &options, &NoProgress).unwrap();
    assert_eq!(none.eigenvalues[0], 0.0);
    let all = vec![true; single.vertex_count()];
    assert!(matches!(single.modes_holding(&all, &options, &NoProgress), Err(SpectralError::AllHeld)));
}
