//! The tree against brute force.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::*;
use crate::Face;
use crate::shapes;
use ndf_core::Hint;

fn unit_cube_point(rng: &mut ChaCha8Rng) -> DVec3 {
    DVec3::from_array(rng.random())
}

/// Triangles of all sizes without any connection; every fifth is a segment, a point, or a sliver.
fn soup(count: usize, rng: &mut ChaCha8Rng) -> TriangleMesh {
    let mut positions = Vec::new();
    for i in 0..count {
        let size = 10.0_f64.powf(-3.0 * rng.random::<f64>());
        let a = unit_cube_point(rng);
        let b = a + size * (unit_cube_point(rng) - 0.5);
        let c = a + size * (unit_cube_point(rng) - 0.5);
        positions.extend(match i % 15 {
            0 => [a, b, a.lerp(b, 0.25)],
            5 => [a, a, a],
            10 => [a, b, a.lerp(b, 0.5) + 1e-12 * (c - a)],
            _ => [a, b, c],
        });
    }
    let faces = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleMesh::new(positions, faces).unwrap()
}

fn brute_force(mesh: &TriangleMesh, p: DVec3, accept: impl Fn(Face) -> bool) -> Option<f64> {
    mesh.face_indices()
        .filter(|&f| accept(f) && mesh.corner_positions(f).iter().all(|c| c.is_finite()))
        .map(|f| closest_point_on_triangle(p, mesh.corner_positions(f)).0.distance_squared(p))
        .min_by(f64::total_cmp)
}

fn assert_agrees(mesh: &TriangleMesh, p: DVec3, found: Option<ClosestPoint>, truth: Option<f64>) {
    match (found, truth) {
        (Some(found), Some(truth)) => {
            // A point of this size is rounded by this much, whoever computes it.
            let size = mesh.bounds().padded(mesh.bounds().distance_squared(p).sqrt());
            let rounding = 8.0 * f64::EPSILON * size.min.abs().max(size.max.abs()).length();
            let (a, b) = (found.distance_squared.sqrt(), truth.sqrt());
            assert!((a - b).abs() <= rounding + 4.0 * f64::EPSILON * b, "{p}: {a} instead of {b}");
            assert_eq!(found.distance_squared, found.point.distance_squared(p));
            let [x, y, z] = mesh.corner_positions(found.at.face);
            let [u, v, w] = found.at.barycentric;
            assert!((u + v + w - 1.0).abs() < 1e-12 && u.min(v).min(w) > -1e-12);
            let apart = (x * u + y * v + z * w).distance(found.point);
            assert!(apart <= 4.0 * rounding + 1e-14 * b, "{apart}");
        }
        (found, truth) => assert_eq!(found.is_some(), truth.is_some()),
    }
}

#[test]
fn closest_points_agree_with_brute_force() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for count in [1, 2, 7, 60, 700] {
        let soup = soup(count, &mut rng);
        for (offset, scale) in [(0.0, 1.0), (1e6, 1.0), (0.0, 1e-6), (-3e4, 1e3), (0.0, 1e-40), (1.0, 1e30)] {
            let place = |p: DVec3| (p + DVec3::new(offset, -offset, 0.5 * offset)) * scale;
            let mesh = soup.map_positions(place);
            let tree = TriangleTree::new(&mesh);
            for case in 0..60 {
                let spread = [0.1, 2.0, 1e4, 1e20][case % 4];
                let q = place((unit_cube_point(&mut rng) - 0.5) * spread + 0.5);
                let hint = Hint(rng.random_range(0..2 * count as u32));
                let truth = brute_force(&mesh, q, |_| true);
                assert_agrees(&mesh, q, tree.closest_point(q, Hint::NONE), truth);
                assert_agrees(&mesh, q, tree.closest_point(q, hint), truth);
                let odd = |f: Face| f.0 % 2 == 1;
                let truth = brute_force(&mesh, q, odd);
                assert_agrees(&mesh, q, tree.closest_point_where(q, hint, odd), truth);
            }
        }
    }
}

#[test]
fn points_of_the_mesh_are_their_own_closest_points() {
    let mesh = shapes::torus(60, 30, 1.0, 0.3);
    let tree = TriangleTree::new(&mesh);
    for &p in mesh.positions() {
        assert_eq!(tree.closest_point(p, Hint::NONE).unwrap().distance_squared, 0.0);
    }
}

#[test]
fn searches_within_a_distance_end_there() {
    let tree = TriangleTree::new(&shapes::icosphere(3));
    let p = DVec3::new(0.0, 0.0, 3.0);
    let found = tree.closest_point(p, Hint::NONE).unwrap();
    let within = |d2: f64, hint| tree.closest_point_within(p, d2, hint, |_| true);
    for hint in [Hint::NONE, found.hint(), Hint(0)] {
        assert!(within(found.distance_squared, hint).is_none());
        assert!(within(found.distance_squared * 1.000_001, hint).is_some());
    }
}

#[test]
fn unusable_meshes_and_queries_have_no_answer() {
    let p = DVec3::ONE;
    let empty = TriangleTree::new(&TriangleMesh::default());
    assert!(empty.is_empty() && empty.closest_point(p, Hint(0)).is_none() && empty.first_hit(p, p).is_none());

    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let broken = soup(20, &mut rng);
    let (mut positions, faces) = broken.into_parts();
    positions[3].y = f64::NAN;
    positions[6] = DVec3::INFINITY;
    let broken = TriangleMesh::new(positions, faces).unwrap();
    let tree = TriangleTree::new(&broken);
    assert_agrees(&broken, p, tree.closest_point(p, Hint(1)), brute_force(&broken, p, |_| true));
    assert!(tree.closest_point_where(p, Hint::NONE, |f| f == Face(1) || f == Face(2)).is_none());
    for q in [DVec3::NAN, DVec3::INFINITY, DVec3::new(0.0, f64::NAN, 0.0)] {
        assert!(tree.closest_point(q, Hint::NONE).is_none());
        assert!(tree.first_hit(q, p).is_none() && tree.first_hit(p, q).is_none());
    }
    assert!(tree.first_hit(p, DVec3::ZERO).is_none());
}

#[test]
fn first_hits_agree_with_brute_force() {
    let mut rng = ChaCha8Rng::seed_from_u64(23);
    for mesh in [soup(300, &mut rng), shapes::icosphere(2), shapes::cube(3), shapes::grid(5, 5)] {
        let tree = TriangleTree::new(&mesh);
        for case in 0..500 {
            let origin = unit_cube_point(&mut rng) * 4.0 - 1.5;
            let target = unit_cube_point(&mut rng);
            let direction = match case % 3 {
                0 => target - origin,
                1 => unit_cube_point(&mut rng) - 0.5,
                _ => DVec3::AXES[case % 9 / 3],
            };
            let mut all: Vec<f64> = mesh
                .face_indices()
                .filter_map(|f| hit_time(origin, direction, mesh.corner_positions(f)))
                .collect();
            all.sort_by(f64::total_cmp);
            let mut hits: Vec<f64> = tree.hits(origin, direction).iter().map(|hit| hit.t).collect();
            hits.sort_by(f64::total_cmp);
            let found = tree.first_hit(origin, direction);
            assert_eq!(hits.first().copied(), found.map(|hit| hit.t));
            // Along an axis a ray may meet an edge, where rounding decides how many faces it hits.
            if case % 3 < 2 {
                assert_eq!(hits.len(), all.len());
                assert!(hits.iter().zip(&all).all(|(a, b)| (a - b).abs() <= 1e-9 * b.max(1.0)));
            }
            let truth = all.first().copied();
            match (found, truth) {
                (Some(hit), Some(t)) => {
                    assert!((hit.t - t).abs() <= 1e-9 * t.max(1.0), "{} instead of {t}", hit.t);
                    let [a, b, c] = mesh.corner_positions(hit.at.face);
                    let [u, v, w] = hit.at.barycentric;
                    let apart = (a * u + b * v + c * w).distance(origin + direction * hit.t);
                    assert!(apart < 1e-9, "{apart}");
                }
                (found, truth) => assert_eq!(found.is_some(), truth.is_some(), "{found:?}, {truth:?}"),
            }
        }
    }
}

/// Möller and Trumbore (1997).
fn hit_time(origin: DVec3, direction: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let (ab, ac, s) = (b - a, c - a, origin - a);
    let h = direction.cross(ac);
    let determinant = ab.dot(h);
    if determinant.abs() < 1e-18 {
        return None;
    }
    let (u, v) = (s.dot(h) / determinant, direction.dot(s.cross(ab)) / determinant);
    let t = ac.dot(s.cross(ab)) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
}

#[test]
fn no_ray_leaves_a_closed_mesh() {
    for (mesh, at) in [(shapes::icosphere(3), DVec3::ZERO), (shapes::cube(4), DVec3::new(1e5, 3.0, -7.0))] {
        let mesh = mesh.map_positions(|p| p + at);
        let tree = TriangleTree::new(&mesh);
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        for &p in mesh.positions() {
            // Straight at vertices, at the middles between them, and anywhere.
            let other = mesh.positions()[rng.random_range(0..mesh.vertex_count())];
            for direction in [p - at, (p + other) * 0.5 - at, unit_cube_point(&mut rng) - 0.5] {
                if direction.length() > 1e-3 {
                    assert!(tree.first_hit(at, direction).is_some(), "{direction}");
                }
            }
        }
    }
}
