//! Geodesics in the class of a path: closed forms on what can be unrolled, and the exact distances.

#![allow(clippy::unwrap_used)]

use std::f64::consts::{PI, TAU};

use ndf_core::{DVec3, NoProgress};
use ndf_geodesic::{ExactOptions, GeodesicError, StraightenedPath, ThroughOptions};
use ndf_geodesic::{exact_distances, geodesic_through};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleMesh, Vertex, shapes};

const LOOP: ThroughOptions = ThroughOptions { closed: true, pass_vertices: false };

fn through(mesh: &ManifoldMesh, vertices: &[u32], options: ThroughOptions) -> StraightenedPath {
    let vertices: Vec<Vertex> = vertices.iter().copied().map(Vertex).collect();
    geodesic_through(mesh, &vertices, options, &NoProgress).unwrap()
}

/// The polyline has the length that is told.
fn check(mesh: &ManifoldMesh, path: &StraightenedPath) {
    let places: Vec<DVec3> = path.points.iter().map(|p| p.position(mesh)).collect();
    let length: f64 = places.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    assert!((length - path.length).abs() < 1e-9 * (1.0 + path.length), "{length} {}", path.length);
    assert!(path.is_geodesic, "{path:?}");
}

/// A tube of `around` flat strips, open at both ends; vertex (i, j) is j · around + i.
fn tube(around: u32, along: u32, height: f64) -> ManifoldMesh {
    let place = |k: u32| {
        let angle = TAU * f64::from(k % around) / f64::from(around);
        DVec3::new(angle.cos(), angle.sin(), height * f64::from(k / around) / f64::from(along))
    };
    let at = |i: u32, j: u32| j * around + i % around;
    let mut faces = Vec::new();
    for j in 0..along {
        for i in 0..around {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            faces.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    let points = (0..around * (along + 1)).map(place).collect();
    ManifoldMesh::try_from(TriangleMesh::new(points, faces).unwrap()).unwrap()
}

#[test]
fn in_the_plane_paths_are_straight() {
    let grid = ManifoldMesh::try_from(shapes::grid(17, 13)).unwrap();
    let n = grid.vertex_count() as u32;
    for [a, b] in [[0, n - 1], [3, n - 20], [17, 100], [5, 5 + 18]] {
        let path = through(&grid, &[a, b], ThroughOptions::default());
        check(&grid, &path);
        let [p, q] = [a, b].map(|v| grid.positions()[v as usize]);
        assert!((path.length - p.distance(q)).abs() < 1e-12, "{a} {b}: {path:?}");
    }
    // Through a third vertex it is two straight lines, else one.
    let corners = [0, n / 2 + 4, n - 1];
    let places = corners.map(|v: u32| grid.positions()[v as usize]);
    let kept = through(&grid, &corners, ThroughOptions { closed: false, pass_vertices: true });
    let broken = places[0].distance(places[1]) + places[1].distance(places[2]);
    assert!((kept.length - broken).abs() < 1e-12);
    let free = through(&grid, &corners, ThroughOptions::default());
    assert!((free.length - places[0].distance(places[2])).abs() < 1e-12);
    // A loop in the plane is nothing.
    let closed = through(&grid, &corners, LOOP);
    assert!(closed.length < 1e-12 || !closed.is_geodesic, "{closed:?}");
}

/// A tube is a rolled-up strip: who winds around k times goes √((k c)² + h²), and a loop k c.
#[test]
fn on_a_tube_paths_wind_as_they_are_told() {
    let (around, along, height) = (24, 16, 3.0);
    let tube = tube(around, along, height);
    let circumference = 2.0 * f64::from(around) * (PI / f64::from(around)).sin();
    for turns in [0, 1, 2, 3] {
        // A third of the way around, at least three times a turn, and steadily upwards.
        let all = 3 * turns.max(1);
        let level = |k: u32| along * k / all;
        let column = |k: u32| if turns == 0 { 0 } else { 8 * k };
        let vertices: Vec<u32> = (0..=all).map(|k| level(k) * around + column(k) % around).collect();
        let path = through(&tube, &vertices, ThroughOptions::default());
        check(&tube, &path);
        let exact = (f64::from(turns) * circumference).hypot(height);
        assert!((path.length - exact).abs() < 1e-9, "{turns} turns: {} {exact}", path.length);
    }
    let zigzag = [5, 9, 5, 9].map(|level: u32| level * around);
    let vertices: Vec<u32> = (0..4).map(|k| zigzag[k as usize] + 6 * k).collect();
    let ring = through(&tube, &vertices, LOOP);
    check(&tube, &ring);
    assert!((ring.length - circumference).abs() < 1e-9, "{} {circumference}", ring.length);
    assert_eq!(ring.points.first(), ring.points.last());
}

/// No path is shorter than the shortest, and between vertices that are close it is that.
#[test]
fn between_neighbours_paths_are_the_shortest() {
    for shape in [shapes::icosphere(3), shapes::torus(40, 20, 1.0, 0.4), shapes::trefoil_knot(120, 12, 0.24)]
    {
        let mesh = ManifoldMesh::try_from(shape).unwrap();
        let intrinsic = IntrinsicMesh::from_mesh(&mesh);
        let (mut shortest, mut near) = (0, 0);
        for a in (0..mesh.vertex_count() as u32).step_by(97) {
            let source = SurfacePoint::Vertex(Vertex(a));
            let exact =
                exact_distances(&intrinsic, &[source], &ExactOptions::default(), &NoProgress).unwrap();
            for b in (0..mesh.vertex_count() as u32).filter(|&b| b != a) {
                let distance = exact.distances()[b as usize];
                let is_near = distance < 0.35;
                if !is_near && b % 61 != 0 {
                    continue;
                }
                let path = through(&mesh, &[a, b], ThroughOptions::default());
                check(&mesh, &path);
                assert!(path.length > distance - 1e-9, "{} {distance}", path.length);
                near += usize::from(is_near);
                shortest += usize::from(is_near && path.length < distance + 1e-9);
            }
        }
        assert!(20 * shortest >= 19 * near && near > 30, "{shortest} of {near}");
    }
}

/// Loops around a handle are closed geodesics: the equators of a torus, outer and inner, and its meridians.
#[test]
fn loops_around_handles_get_tight() {
    let (around, tube) = (60, 30);
    let torus = ManifoldMesh::try_from(shapes::torus(around, tube, 1.0, 0.4)).unwrap();
    let near = |p: DVec3| {
        let places = torus.positions().iter().enumerate();
        places.min_by(|x, y| x.1.distance(p).total_cmp(&y.1.distance(p))).unwrap().0 as u32
    };
    let ring =
        |radius: f64| [0.0, 2.1, 4.2].map(|a: f64| near(DVec3::new(radius * a.cos(), radius * a.sin(), 0.0)));
    let top = [0.0, 2.1, 4.2].map(|a: f64| near(DVec3::new(a.cos(), a.sin(), 0.4)));
    let inner = TAU * 0.6;
    for vertices in [ring(0.6), top] {
        let path = through(&torus, &vertices, LOOP);
        check(&torus, &path);
        assert!((path.length / inner - 1.0).abs() < 0.01, "{} {inner}", path.length);
    }
    let angles = [0.0, 2.1, 4.2];
    let meridian = angles.map(|a: f64| near(DVec3::new(1.0 + 0.4 * a.cos(), 0.0, 0.4 * a.sin())));
    let path = through(&torus, &meridian, LOOP);
    check(&torus, &path);
    assert!((path.length / (TAU * 0.4) - 1.0).abs() < 0.01, "{}", path.length);
}

#[test]
fn wrong_vertices_are_named() {
    let mut two = shapes::grid(2, 2);
    let more = shapes::grid(2, 2);
    let n = two.vertex_count() as u32;
    let points =
        two.positions().iter().copied().chain(more.positions().iter().map(|p| *p + DVec3::Z)).collect();
    let faces = two.faces().iter().copied().chain(more.faces().iter().map(|f| f.map(|v| v + n))).collect();
    two = TriangleMesh::new(points, faces).unwrap();
    let mesh = ManifoldMesh::try_from(two).unwrap();
    let wrong = |vertices: &[u32]| {
        let vertices: Vec<Vertex> = vertices.iter().copied().map(Vertex).collect();
        geodesic_through(&mesh, &vertices, ThroughOptions::default(), &NoProgress).unwrap_err()
    };
    assert!(matches!(wrong(&[0]), GeodesicError::NoSource));
    assert!(matches!(wrong(&[0, 2 * n]), GeodesicError::NotOnMesh { .. }));
    assert!(matches!(wrong(&[0, n]), GeodesicError::Unreached { .. }));
}

/// The shortest loop around a tube of revolution is a meridian, wherever it begins; on the way it may be a single edge.
#[test]
fn loops_of_one_edge_get_straight() {
    let torus = ManifoldMesh::try_from(shapes::torus(160, 80, 1.0, 0.4)).unwrap();
    let polygon = 2.0 * 80.0 * 0.4 * (PI / 80.0).sin();
    for first in [0_u32, 37, 80 * 40 + 3] {
        let start = first / 80 * 80;
        let around: Vec<u32> = [0, 27, 53].iter().map(|k| start + (first + k) % 80).collect();
        let path = through(&torus, &around, LOOP);
        check(&torus, &path);
        assert!((path.length / polygon - 1.0).abs() < 1e-3, "{} {polygon}", path.length);
    }
}
