//! Fields against closed forms and laws.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use approx::{assert_abs_diff_eq, assert_relative_eq};
use ndf_core::{DVec3, NoProgress};
use ndf_fields::{
    Complex64, DirectionField, FieldError, Frames, HodgeDecomposition, StripePattern, TangentBundle,
    VectorHeatSolver, exact_log_map, principal_directions,
};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{ManifoldMesh, TriangleMesh, Vertex, shapes};

fn manifold(mesh: TriangleMesh) -> ManifoldMesh {
    ManifoldMesh::try_from(mesh).unwrap()
}

fn bundle_of(mesh: &ManifoldMesh) -> TangentBundle {
    TangentBundle::new(&IntrinsicMesh::from_mesh(mesh))
}

/// A grid whose inner vertices are moved and whose cells are much wider than high.
fn crooked_grid() -> ManifoldMesh {
    let moved = |p: DVec3| {
        let inside = (p.x * (1.0 - p.x) * p.y * (1.0 - p.y)).max(0.0);
        p + DVec3::new(2.0 * inside * (7.0 * p.y).sin(), inside * (9.0 * p.x).cos(), 0.0) * 0.2
    };
    let unit = shapes::grid(14, 11);
    let size = unit.bounds().extent();
    let unit = unit.map_positions(|p| DVec3::new(p.x / size.x, p.y / size.y, 0.0));
    manifold(unit.map_positions(moved).map_positions(|p| DVec3::new(5.0 * p.x, p.y, 0.0)))
}

#[test]
fn energies_of_the_smoothest_fields_of_a_sphere_are_their_symmetry() {
    // The operator on spin weight n has the eigenvalues l (l + 1) − n² for l ≥ n.
    for symmetry in 1..=4 {
        let errors = [3, 4].map(|level| {
            let bundle = bundle_of(&manifold(shapes::icosphere(level)));
            let field = DirectionField::smoothest(&bundle, symmetry, &NoProgress).unwrap();
            (field.energy - f64::from(symmetry)).abs() / f64::from(symmetry)
        });
        assert!(errors[1] < 0.01 && errors[1] < 0.3 * errors[0], "{symmetry}: {errors:?}");
    }
}

#[test]
fn indices_sum_to_the_euler_characteristic() {
    let meshes = [
        (manifold(shapes::icosphere(3)), 2),
        (manifold(shapes::torus(40, 16, 1.0, 0.4)), 0),
        (crooked_grid(), 1),
        (manifold(shapes::cube(6)), 2),
    ];
    for (mesh, euler) in meshes {
        let bundle = bundle_of(&mesh);
        for symmetry in [1, 2, 3, 4, 6] {
            let smoothest = DirectionField::smoothest(&bundle, symmetry, &NoProgress).unwrap();
            let noise = (0..mesh.vertex_count()).map(|v| Complex64::cis((v * v) as f64)).collect();
            let noise = DirectionField::from_powers(symmetry, noise).unwrap();
            for field in [smoothest, noise] {
                let indices: i32 = field.singularities(&bundle).iter().map(|(_, index)| index).sum();
                assert_eq!(indices - field.boundary_index(&bundle), symmetry as i32 * euler, "{symmetry}");
            }
        }
    }
}

#[test]
fn flat_surfaces_have_parallel_fields() {
    let mesh = crooked_grid();
    let bundle = bundle_of(&mesh);
    let frames = Frames::of(&mesh);
    for symmetry in [1, 2, 4] {
        let field = DirectionField::smoothest(&bundle, symmetry, &NoProgress).unwrap();
        assert!(field.energy < 1e-10, "{}", field.energy);
        assert_eq!(field.singularities(&bundle), []);
        let angle = |v: &DVec3| v.y.atan2(v.x) * f64::from(symmetry);
        let vectors = frames.embed(&field.directions());
        let first = angle(&vectors[0]);
        for v in &vectors {
            assert_abs_diff_eq!(Complex64::cis(angle(v) - first).arg(), 0.0, epsilon = 1e-6);
        }
    }
}

#[test]
fn fields_follow_what_they_are_aligned_with() {
    let mesh = manifold(shapes::torus(60, 30, 1.0, 0.3));
    let bundle = bundle_of(&mesh);
    let squares = principal_directions(&mesh);
    let field = DirectionField::aligned(&bundle, 2, &squares, &NoProgress).unwrap();
    assert_eq!(field.singularities(&bundle), []);
    let vectors = Frames::of(&mesh).embed(&field.directions());
    for (p, v) in mesh.positions().iter().zip(vectors) {
        // The tube bends more than the ring: lines go around it.
        let along_ring = DVec3::new(-p.y, p.x, 0.0).normalize();
        assert!(v.dot(along_ring).abs() < 0.05, "{p} {v}");
    }
    let none = vec![Complex64::default(); mesh.vertex_count()];
    assert_eq!(DirectionField::aligned(&bundle, 2, &none, &NoProgress), Err(FieldError::NoAlignment));
    assert_eq!(DirectionField::smoothest(&bundle, 0, &NoProgress), Err(FieldError::Symmetry(0)));
}

#[test]
fn curvatures_of_cylinders_and_spheres_are_theirs() {
    // Principal curvatures differ by 1/r on a cylinder, by nothing on a sphere.
    let cylinder = |p: DVec3| {
        let angle = p.x * 0.5;
        DVec3::new(2.0 * angle.cos(), 2.0 * angle.sin(), p.y)
    };
    let flat = shapes::grid(60, 40);
    let size = flat.bounds().extent();
    let flat = flat.map_positions(|p| DVec3::new(6.0 * p.x / size.x, 4.0 * p.y / size.y, 0.0));
    let mesh = manifold(flat.map_positions(cylinder));
    let frames = Frames::of(&mesh);
    let squares = principal_directions(&mesh);
    let lines = frames.embed(&squares.iter().map(|z| z.sqrt()).collect::<Vec<_>>());
    for v in mesh.topology().vertices().filter(|v| !mesh.topology().is_boundary_vertex(*v)) {
        assert_relative_eq!(squares[v.index()].norm(), 0.5, max_relative = 0.02);
        assert!(lines[v.index()].normalize().z.abs() < 0.1);
    }
    let sphere = principal_directions(&manifold(shapes::icosphere(4)));
    let mean = sphere.iter().map(|z| z.norm()).sum::<f64>() / sphere.len() as f64;
    assert!(mean < 0.15, "{mean}");
}

/// The rotation of space that takes one unit vector to another along their great circle, of a tangent vector.
fn along_great_circle(from: DVec3, to: DVec3, vector: DVec3) -> DVec3 {
    let axis = from.cross(to);
    let (sin, cos) = (axis.length(), from.dot(to));
    if sin == 0.0 {
        return vector;
    }
    let axis = axis / sin;
    vector * cos + axis.cross(vector) * sin + axis * (axis.dot(vector) * (1.0 - cos))
}

#[test]
fn transport_over_a_sphere_is_along_great_circles() {
    let errors = [3, 4, 5].map(|level| {
        let mesh = manifold(shapes::icosphere(level));
        let solver = VectorHeatSolver::new(&IntrinsicMesh::from_mesh(&mesh)).unwrap();
        let source = Vertex(20);
        let frames = Frames::of(&mesh);
        let found =
            frames.embed(&solver.transport(&[(source, Complex64::from_polar(2.0, 0.7))]).unwrap().values);
        let origin = mesh.positions()[source.index()];
        let start = found[source.index()];
        assert_relative_eq!(start.length(), 2.0, max_relative = 1e-6);
        let far = |p: &DVec3| p.dot(origin) > -0.5;
        let pairs: Vec<_> = mesh.positions().iter().zip(&found).filter(|(p, _)| far(p)).collect();
        let error = |(p, v): &(&DVec3, &DVec3)| (**v - along_great_circle(origin, **p, start)).length() / 2.0;
        pairs.iter().map(error).sum::<f64>() / pairs.len() as f64
    });
    assert!(errors[2] < 0.01 && errors[2] < errors[1] && errors[1] < errors[0], "{errors:?}");
}

#[test]
fn transport_over_a_plane_changes_nothing_and_values_are_extended() {
    let mesh = crooked_grid();
    let solver = VectorHeatSolver::new(&IntrinsicMesh::from_mesh(&mesh)).unwrap();
    let source = Vertex(77);
    let vectors = solver.transport(&[(source, Complex64::from_polar(1.5, -2.0))]).unwrap().values;
    let found = Frames::of(&mesh).embed(&vectors);
    for v in &found {
        assert_abs_diff_eq!((*v - found[source.index()]).length(), 0.0, epsilon = 1e-9);
    }
    let extended = solver.extend(&[(Vertex(0), 3.0), (Vertex(164), -1.0)]).unwrap().values;
    assert_relative_eq!(extended[1], 3.0, max_relative = 1e-2);
    assert!(extended.iter().all(|x| (-1.0 - 1e-9..=3.0 + 1e-9).contains(x)));
    assert_eq!(solver.extend(&[]), Err(FieldError::NoSource));
    assert!(matches!(solver.log_map(Vertex(9999)), Err(FieldError::NotOnMesh { .. })));
}

#[test]
fn gradients_of_linear_functions_are_their_slopes() {
    let mesh = crooked_grid();
    let slope = DVec3::new(0.3, -1.2, 0.0);
    let values: Vec<f64> = mesh.positions().iter().map(|p| p.dot(slope)).collect();
    for found in Frames::of(&mesh).embed(&bundle_of(&mesh).gradient(&values)) {
        assert_abs_diff_eq!((found - slope).length(), 0.0, epsilon = 1e-9);
    }
}

#[test]
fn exact_log_maps_of_planes_are_the_plane() {
    let mesh = crooked_grid();
    let intrinsic = IntrinsicMesh::from_mesh(&mesh);
    for source in [Vertex(77), Vertex(0), Vertex(7)] {
        let log = exact_log_map(&intrinsic, source, &NoProgress).unwrap();
        let found = Frames::of(&mesh).axes()[source.index()];
        let origin = mesh.positions()[source.index()];
        for (p, z) in mesh.positions().iter().zip(&log) {
            let there = origin + found[0] * z.re + found[1] * z.im;
            // A path may bend at a vertex that it passes by a hair: within 1e-12 of its length, thus some 1e-6 aside.
            assert!((there - *p).length() < 3e-6 * (1.0 + z.norm()), "{source} {p} {there}");
        }
    }
}

#[test]
fn log_maps_of_spheres_are_those_of_great_circles() {
    let errors = [3, 4, 5].map(|level| {
        let mesh = manifold(shapes::icosphere(level));
        let intrinsic = IntrinsicMesh::from_mesh(&mesh);
        let source = Vertex(100);
        let axes = Frames::of(&mesh).axes()[source.index()];
        let origin = mesh.positions()[source.index()];
        let mean_error = |log: &[Complex64]| {
            let near = mesh.positions().iter().zip(log).filter(|(p, _)| p.dot(origin) > -0.7);
            let error = |(p, z): (&DVec3, &Complex64)| {
                let angle = p.dot(origin).clamp(-1.0, 1.0).acos();
                let direction = (*p - origin * p.dot(origin)).normalize_or_zero();
                (axes[0] * z.re + axes[1] * z.im - direction * angle).length()
            };
            let errors: Vec<f64> = near.map(error).collect();
            errors.iter().sum::<f64>() / errors.len() as f64
        };
        let exact = exact_log_map(&intrinsic, source, &NoProgress).unwrap();
        let heat = VectorHeatSolver::new(&intrinsic).unwrap().log_map(source).unwrap().values;
        [mean_error(&exact), mean_error(&heat)]
    });
    let [[a, e], [b, f], [c, g]] = errors;
    // Of order 1.3 for a polyhedron's own shortest paths; the vector heat method keeps an error of its time step.
    assert!(b < 0.5 * a && c < 0.5 * b && c < 3e-3, "{errors:?}");
    assert!(f < e && g < 1.01 * f && g < 0.02, "{errors:?}");
}

#[test]
fn stripes_of_a_plane_are_waves() {
    let mesh = crooked_grid();
    let bundle = bundle_of(&mesh);
    let direction = DVec3::new(0.8, 0.6, 0.0);
    let along = Frames::of(&mesh).project(&vec![direction; mesh.vertex_count()]);
    let squares = along.iter().map(|z| z * z).collect();
    let lines = DirectionField::from_powers(2, squares).unwrap();
    let frequency = 1.1;
    let stripes = StripePattern::new(&bundle, &lines, frequency, &NoProgress).unwrap();
    assert_eq!(stripes.branches, []);
    let wave = |p: &DVec3| TAU * frequency * p.dot(direction);
    // Up to a phase, and to which of the two directions is followed.
    let first = mesh.positions()[0];
    let phase = [stripes.phases[0].arg(), -stripes.phases[0].arg()];
    let errors = phase.map(|phase| {
        let values = mesh.positions().iter().zip(stripes.values());
        values.map(|(p, x)| (x - (wave(p) - wave(&first) + phase).cos()).abs()).fold(0.0, f64::max)
    });
    assert!(errors[0].min(errors[1]) < 1e-5, "{errors:?}");
    assert!(matches!(
        StripePattern::new(&bundle, &lines, 0.0, &NoProgress),
        Err(FieldError::NotPositive { .. })
    ));
}

#[test]
fn stripes_of_a_sphere_are_as_far_apart_as_they_should_be() {
    let mesh = manifold(shapes::icosphere(5));
    let bundle = bundle_of(&mesh);
    let lines = DirectionField::smoothest(&bundle, 2, &NoProgress).unwrap();
    let frequency = 3.0;
    let stripes = StripePattern::new(&bundle, &lines, frequency, &NoProgress).unwrap();
    let triangulation = bundle.mesh();
    // |∇φ| = 2π frequency where nothing ends.
    let mut slopes: Vec<f64> = triangulation
        .faces()
        .map(|face| {
            let [a, b, c] = stripes.corners[face.index()];
            let [l, _, _] = triangulation.sides(face);
            let [x, y] = ndf_intrinsic::triangle::apex(triangulation.sides(face));
            let slope = [(b - a) / l, (c - a - (b - a) * x / l) / y];
            slope[0].hypot(slope[1]) / (TAU * frequency)
        })
        .collect();
    slopes.sort_by(f64::total_cmp);
    let median = slopes[slopes.len() / 2];
    assert!((median - 1.0).abs() < 0.05, "{median}");
    assert!(stripes.branches.len() < triangulation.face_count() / 50, "{}", stripes.branches.len());
}

fn product(mesh: &IntrinsicMesh, a: &[Complex64], b: &[Complex64]) -> f64 {
    let terms = mesh.faces().zip(a).zip(b);
    terms.map(|((face, a), b)| mesh.area(face) * (a.conj() * b).re).sum()
}

#[test]
fn hodge_parts_are_orthogonal_and_sum_to_the_field() {
    for (mesh, has_harmonic) in [
        (manifold(shapes::icosphere(3)), false),
        (manifold(shapes::torus(30, 14, 1.0, 0.4)), true),
        (crooked_grid(), false),
    ] {
        let mesh = IntrinsicMesh::from_mesh(&mesh);
        let field: Vec<Complex64> = (0..mesh.face_count())
            .map(|f| Complex64::new((f as f64).sin(), (1.7 * f as f64).cos()))
            .collect();
        let HodgeDecomposition { gradient, rotation, harmonic, .. } =
            HodgeDecomposition::of(&mesh, &field, &NoProgress).unwrap();
        let size = product(&mesh, &field, &field);
        for (a, b) in [(&gradient, &rotation), (&gradient, &harmonic), (&rotation, &harmonic)] {
            assert_abs_diff_eq!(product(&mesh, a, b) / size, 0.0, epsilon = 1e-10);
        }
        let share = product(&mesh, &harmonic, &harmonic) / size;
        assert_eq!(share > 1e-6, has_harmonic, "{share}");
        // What is decomposed once more stays what it is.
        for (part, which) in [(&gradient, 0), (&rotation, 1), (&harmonic, 2)] {
            let again = HodgeDecomposition::of(&mesh, part, &NoProgress).unwrap();
            let parts = [again.gradient, again.rotation, again.harmonic];
            for (k, other) in parts.iter().enumerate() {
                let expected = if k == which { product(&mesh, part, part) } else { 0.0 };
                assert_abs_diff_eq!(product(&mesh, other, other) / size, expected / size, epsilon = 1e-9);
            }
        }
    }
}

#[test]
fn fields_do_not_depend_on_numbering() {
    // The same torus with vertices and faces in another order has the same energies.
    let mesh = shapes::torus(24, 12, 1.0, 0.4).map_positions(|p| p * DVec3::new(1.0, 1.3, 0.9));
    let n = mesh.vertex_count() as u32;
    let (positions, faces) = mesh.clone().into_parts();
    let moved = |v: u32| (v * 7 + 3) % n;
    let mut shuffled = vec![DVec3::ZERO; n as usize];
    (0..n).for_each(|v| shuffled[moved(v) as usize] = positions[v as usize]);
    let faces = faces.iter().rev().map(|f| [f[1], f[2], f[0]].map(moved)).collect();
    let other = TriangleMesh::new(shuffled, faces).unwrap();
    assert_eq!(n % 7, 1, "a permutation");
    let energy = |mesh: TriangleMesh| {
        DirectionField::smoothest(&bundle_of(&manifold(mesh)), 4, &NoProgress).unwrap().energy
    };
    assert_relative_eq!(energy(mesh), energy(other), max_relative = 1e-6);
}
