//! Signed distances against closed forms and laws.

#![allow(clippy::unwrap_used)]

use approx::assert_abs_diff_eq;
use ndf_core::{DVec3, NoProgress};
use ndf_fields::{FieldError, SignedDistances, SignedHeatOptions, ZeroSet, joined_curve, signed_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Edge, Face, FacePoint, ManifoldMesh, SurfacePoint, TriangleMesh, Vertex, shapes};

fn manifold(mesh: TriangleMesh) -> ManifoldMesh {
    ManifoldMesh::try_from(mesh).unwrap()
}

/// The pieces of a level set of a function, with what is negative on their left.
fn level_set(mesh: &ManifoldMesh, f: impl Fn(DVec3) -> f64) -> Vec<Vec<SurfacePoint>> {
    let topology = mesh.topology();
    let value = |v: Vertex| f(mesh.positions()[v.index()]);
    let mut curves = Vec::new();
    for face in topology.faces() {
        let (mut start, mut end) = (None, None);
        for h in face.halfedges() {
            let (a, b) = (value(topology.tail(h)), value(topology.tip(h)));
            if (a < 0.0) == (b < 0.0) {
                continue;
            }
            let t = a / (a - b);
            let edge = topology.halfedge_edge(h);
            let t = if topology.edge_halfedge(edge) == h { t } else { 1.0 - t };
            *(if a < 0.0 { &mut start } else { &mut end }) = Some(SurfacePoint::Edge { edge, t });
        }
        curves.extend(start.zip(end).map(|(start, end)| vec![start, end]));
    }
    curves
}

fn reversed(curves: &[Vec<SurfacePoint>]) -> Vec<Vec<SurfacePoint>> {
    curves.iter().map(|curve| curve.iter().rev().copied().collect()).collect()
}

fn distances(mesh: &ManifoldMesh, curves: &[Vec<SurfacePoint>], zero_set: ZeroSet) -> SignedDistances {
    let options = SignedHeatOptions { zero_set, ..SignedHeatOptions::default() };
    signed_distances(&IntrinsicMesh::from_mesh(mesh), curves, &[], &options, &NoProgress).unwrap()
}

/// The mean and the largest difference from a function of positions.
fn errors(mesh: &ManifoldMesh, values: &[f64], exact: impl Fn(DVec3) -> f64) -> [f64; 2] {
    let differences = mesh.positions().iter().zip(values).map(|(p, d)| (d - exact(*p)).abs());
    let (sum, max) = differences.fold((0.0, 0.0_f64), |(sum, max), d| (sum + d, max.max(d)));
    [sum / values.len() as f64, max]
}

/// A grid whose inner vertices are moved and whose cells are wider than high, 5 × 1.
fn crooked_grid(n: u32) -> ManifoldMesh {
    let unit = shapes::grid(4 * n, n);
    let size = unit.bounds().extent();
    let unit = unit.map_positions(|p| DVec3::new(p.x / size.x, p.y / size.y, 0.0));
    let moved = |p: DVec3| {
        let inside = (p.x * (1.0 - p.x) * p.y * (1.0 - p.y)).max(0.0);
        p + DVec3::new(2.0 * inside * (7.0 * p.y).sin(), inside * (9.0 * p.x).cos(), 0.0) * 0.2
    };
    manifold(unit.map_positions(moved).map_positions(|p| DVec3::new(5.0 * p.x, p.y, 0.0)))
}

#[test]
fn lines_in_the_plane_have_the_distance_of_lines() {
    let mesh = crooked_grid(12);
    for (normal, at) in [(DVec3::X, 2.3), (DVec3::new(0.8, 0.6, 0.0), 2.0), (DVec3::Y, 0.4)] {
        let exact = |p: DVec3| p.dot(normal) - at;
        let curves = level_set(&mesh, exact);
        for zero_set in [ZeroSet::Curves, ZeroSet::Mean] {
            let found = distances(&mesh, &curves, zero_set);
            assert_eq!(found.out_of_reach, 0);
            let [mean, max] = errors(&mesh, &found.values, exact);
            // Normals stay parallel, which is exact.
            assert!(mean <= max && max < 1e-9, "{normal} {zero_set:?} {mean:e} {max:e}");
        }
    }
}

#[test]
fn circles_of_latitude_have_the_distance_along_meridians() {
    for zero_set in [ZeroSet::Curves, ZeroSet::Mean] {
        for height in [0.0, 0.4] {
            let errors = [3, 4, 5].map(|level| {
                let mesh = manifold(shapes::icosphere(level));
                let curves = level_set(&mesh, |p| p.z - height);
                let found = distances(&mesh, &curves, zero_set);
                errors(&mesh, &found.values, |p| p.z.clamp(-1.0, 1.0).asin() - f64::asin(height))
            });
            let [[_, a], [_, b], [mean, c]] = errors;
            assert!(b < 0.6 * a && c < 0.6 * b && mean < 1e-3, "{zero_set:?} {height} {errors:?}");
        }
    }
}

#[test]
fn curves_that_are_turned_around_change_the_sign() {
    let mesh = manifold(shapes::torus(40, 20, 1.0, 0.4));
    let curves = level_set(&mesh, |p| p.x - 0.2);
    for zero_set in [ZeroSet::Curves, ZeroSet::Mean] {
        let [found, turned] = [curves.clone(), reversed(&curves)].map(|c| distances(&mesh, &c, zero_set));
        for (a, b) in found.values.iter().zip(&turned.values) {
            assert_abs_diff_eq!(*a, -b, epsilon = 1e-9);
        }
        assert_abs_diff_eq!(found.curve_length, turned.curve_length, epsilon = 1e-12);
    }
}

#[test]
fn signs_continue_over_gaps() {
    let mesh = manifold(shapes::icosphere(5));
    let height = 0.3;
    let is_kept = |point: &SurfacePoint| {
        let p = point.position(&mesh);
        // Every second of six pieces has a gap of a third.
        (p.y.atan2(p.x) * 6.0).cos() < 0.5
    };
    let mut curves = level_set(&mesh, |p| p.z - height);
    let whole = curves.len();
    curves.retain(|curve| is_kept(&curve[0]));
    assert!(curves.len() < whole * 3 / 4, "{} of {whole}", curves.len());
    let found = distances(&mesh, &curves, ZeroSet::Curves);
    let exact = |p: DVec3| p.z.clamp(-1.0, 1.0).asin() - f64::asin(height);
    let [mean, max] = errors(&mesh, &found.values, exact);
    assert!(mean < 3e-3 && max < 0.02, "{mean} {max}");
    for (p, d) in mesh.positions().iter().zip(&found.values).filter(|(p, _)| exact(**p).abs() > 0.06) {
        assert_eq!(*d > 0.0, exact(*p) > 0.0, "{p} {d}");
    }
}

#[test]
fn curves_are_zero() {
    let mesh = manifold(shapes::torus(40, 20, 1.0, 0.4));
    // A way through vertices, and one through faces.
    let ring: Vec<SurfacePoint> = (0..=40).map(|k| SurfacePoint::Vertex(Vertex(k % 40 * 20))).collect();
    let found = distances(&mesh, &[ring], ZeroSet::Curves);
    assert!((0..40).all(|k| found.values[k * 20] == 0.0));
    let crossing = level_set(&mesh, |p| p.x - 0.2);
    let found = distances(&mesh, &crossing, ZeroSet::Curves);
    for point in crossing.iter().flatten() {
        let SurfacePoint::Edge { edge, t } = *point else { unreachable!() };
        let [a, b] = mesh.topology().edge_vertices(edge).map(|v| found.values[v.index()]);
        assert_abs_diff_eq!(a + (b - a) * t, 0.0, epsilon = 1e-6);
    }
}

#[test]
fn distances_from_points_are_those_of_points() {
    let mesh = manifold(shapes::icosphere(4));
    let source = Vertex(30);
    let options = SignedHeatOptions::default();
    let intrinsic = IntrinsicMesh::from_mesh(&mesh);
    let found = signed_distances(&intrinsic, &[], &[source], &options, &NoProgress).unwrap();
    let origin = mesh.positions()[source.index()];
    let [mean, max] = errors(&mesh, &found.values, |p| p.dot(origin).clamp(-1.0, 1.0).acos());
    assert!(mean < 0.03 && max < 0.06, "{mean} {max}");
    // To the right of a curve, each has its part.
    let curves = level_set(&mesh, |p| p.dot(origin) + 0.8);
    let found = signed_distances(&intrinsic, &curves, &[source], &options, &NoProgress).unwrap();
    assert_eq!(found.values[source.index()], 0.0);
    let [mean, max] = errors(&mesh, &found.values, |p| {
        let angle = p.dot(origin).clamp(-1.0, 1.0).acos();
        let cap = f64::acos(-0.8);
        angle.min(cap - angle)
    });
    assert!(mean < 0.03 && max < 0.15, "{mean} {max}");
}

#[test]
fn boundaries_are_sources_and_other_components_are_far() {
    // The lower side of a square, whose inside is on its left.
    let n = 20;
    let square = shapes::grid(n, n);
    let side = square.bounds().extent().x;
    let far = square.map_positions(|p| p + DVec3::X * 10.0 * side);
    let low = square.bounds().min.y;
    let mut along: Vec<u32> =
        (0..square.vertex_count() as u32).filter(|&v| square.positions()[v as usize].y == low).collect();
    along.sort_by(|&a, &b| square.positions()[a as usize].x.total_cmp(&square.positions()[b as usize].x));
    let (mut positions, mut faces) = square.clone().into_parts();
    let first = positions.len();
    faces.extend(far.faces().iter().map(|face| face.map(|v| v + first as u32)));
    positions.extend(far.positions());
    let mesh = manifold(TriangleMesh::new(positions, faces).unwrap());
    let curve: Vec<SurfacePoint> = along.iter().map(|&v| SurfacePoint::Vertex(Vertex(v))).collect();
    let found = distances(&mesh, &[curve], ZeroSet::Curves);
    assert!(mesh.face_normal(Face(0)).z > 0.0);
    for (p, d) in mesh.positions().iter().zip(&found.values).take(first) {
        assert_abs_diff_eq!(*d, low - p.y, epsilon = 1e-6 * side);
    }
    assert!(found.values[first..].iter().all(|d| *d == f64::INFINITY));
    assert_abs_diff_eq!(found.curve_length, side, epsilon = 1e-9);
}

#[test]
fn what_is_no_curve_is_refused() {
    let mesh = IntrinsicMesh::from_mesh(&manifold(shapes::icosphere(2)));
    let of = |curve: &[SurfacePoint]| {
        signed_distances(&mesh, &[curve.to_vec()], &[], &SignedHeatOptions::default(), &NoProgress)
    };
    let vertex = |v: u32| SurfacePoint::Vertex(Vertex(v));
    assert_eq!(of(&[]), Err(FieldError::NoSource));
    assert_eq!(of(&[vertex(0)]), Err(FieldError::NoSource));
    assert_eq!(of(&[vertex(0), vertex(1)]), Err(FieldError::CurveLeavesFaces { curve: 0, point: 0 }));
    assert!(matches!(of(&[vertex(0), vertex(9999)]), Err(FieldError::NotOnMesh { .. })));
    let edge = SurfacePoint::Edge { edge: Edge(9999), t: 0.5 };
    assert!(matches!(of(&[edge, vertex(0)]), Err(FieldError::NotOnMesh { .. })));
    let off = SurfacePoint::Face(FacePoint { face: Face(0), barycentric: [2.0, -1.0, 0.0] });
    assert!(matches!(of(&[off, vertex(0)]), Err(FieldError::NotOnMesh { .. })));
    let time = SignedHeatOptions { time: 0.0, ..SignedHeatOptions::default() };
    let none = signed_distances(&mesh, &[], &[Vertex(0)], &time, &NoProgress);
    assert!(matches!(none, Err(FieldError::NotPositive { .. })));
    // Shortest paths complete a curve.
    let joined = joined_curve(&mesh, &[vertex(0), vertex(1), vertex(0)], &NoProgress).unwrap();
    assert!(joined.len() > 4 && of(&joined).is_ok());
}
