//! Centres of points against symmetry and closed forms.

#![allow(clippy::unwrap_used)]

use ndf_core::{DVec3, NoProgress};
use ndf_fields::{Centre, CentreKind, FieldError, geodesic_centre};
use ndf_geodesic::{ExactOptions, GeodesicError, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Face, FacePoint, ManifoldMesh, SurfacePoint, TriangleMesh, Vertex, shapes};

fn manifold(mesh: TriangleMesh) -> ManifoldMesh {
    ManifoldMesh::try_from(mesh).unwrap()
}

fn centre(mesh: &ManifoldMesh, points: &[(SurfacePoint, f64)], kind: CentreKind) -> Centre {
    let found = geodesic_centre(&IntrinsicMesh::from_mesh(mesh), points, kind, 200, &NoProgress).unwrap();
    assert!(found.has_converged, "{found:?}");
    found
}

fn vertices(numbers: &[u32]) -> Vec<(SurfacePoint, f64)> {
    numbers.iter().map(|&v| (SurfacePoint::Vertex(Vertex(v)), 1.0)).collect()
}

/// A convex piece of the plane whose inner vertices are moved.
fn crooked_grid() -> ManifoldMesh {
    let unit = shapes::grid(14, 11);
    let size = unit.bounds().extent();
    let unit = unit.map_positions(|p| DVec3::new(p.x / size.x, p.y / size.y, 0.0));
    let moved = |p: DVec3| {
        let inside = (p.x * (1.0 - p.x) * p.y * (1.0 - p.y)).max(0.0);
        p + DVec3::new(2.0 * inside * (7.0 * p.y).sin(), inside * (9.0 * p.x).cos(), 0.0) * 0.2
    };
    manifold(unit.map_positions(moved).map_positions(|p| DVec3::new(5.0 * p.x, p.y, 0.0)))
}

#[test]
fn means_in_the_plane_are_weighted_means() {
    let mesh = crooked_grid();
    let inside = FacePoint { face: Face(200), barycentric: [0.2, 0.3, 0.5] };
    let mut points = vertices(&[3, 40, 77, 120, 170]);
    points.push((SurfacePoint::Face(inside), 1.0));
    points.iter_mut().zip([2.0, 0.5, 1.0, 3.0, 0.25, 1.5]).for_each(|(point, weight)| point.1 = weight);
    let total: f64 = points.iter().map(|(_, weight)| weight).sum();
    let expected = points.iter().map(|(p, weight)| p.position(&mesh) * *weight).sum::<DVec3>() / total;
    let found = centre(&mesh, &points, CentreKind::Mean);
    assert!((found.point.position(&mesh) - expected).length() < 1e-6, "{found:?}");
    let squares = points.iter().map(|(p, weight)| weight * p.position(&mesh).distance_squared(expected));
    approx::assert_relative_eq!(found.variance, squares.sum::<f64>() / total, max_relative = 1e-9);
}

#[test]
fn pulls_on_medians_in_the_plane_cancel() {
    let mesh = crooked_grid();
    let points = vertices(&[3, 40, 77, 120, 170]);
    let at = centre(&mesh, &points, CentreKind::Median).point.position(&mesh);
    let pull = |(p, weight): &(SurfacePoint, f64)| (p.position(&mesh) - at).normalize() * *weight;
    assert!(points.iter().map(pull).sum::<DVec3>().length() < 1e-4);
    // A point with more than half of the weight is the median.
    let mut heavy = points;
    heavy[2].1 = 4.5;
    let at = centre(&mesh, &heavy, CentreKind::Median).point.position(&mesh);
    assert!((at - mesh.positions()[77]).length() < 1e-6, "{at}");
}

#[test]
fn centres_of_symmetric_points_of_a_sphere_are_symmetric() {
    let corners = manifold(shapes::icosphere(0));
    let ring: Vec<u32> = corners.topology().ring(Vertex(4)).map(|v| v.0).collect();
    let face = corners.faces()[7];
    let middle = face.iter().map(|&v| corners.positions()[v as usize]).sum::<DVec3>().normalize();
    for kind in [CentreKind::Mean, CentreKind::Median] {
        let errors = [2, 3, 4].map(|level| {
            let mesh = manifold(shapes::icosphere(level));
            // The corners of the icosahedron keep their numbers.
            assert_eq!(mesh.positions()[..12], corners.positions()[..]);
            let centre =
                |points: &[u32]| centre(&mesh, &vertices(points), kind).point.position(&mesh).normalize();
            [centre(&ring).distance(mesh.positions()[4]), centre(&face).distance(middle)]
        });
        let [[a, e], [b, f], [c, g]] = errors;
        // Shortest paths of a polyhedron shun its corners, and many of them run in parallel here: an error of a part of an edge.
        assert!(b < 0.6 * a && c < 0.6 * b && c < 0.03, "{errors:?}");
        assert!(f < 0.7 * e && g < 0.7 * f && g < 0.02, "{errors:?}");
    }
}

#[test]
fn centres_of_two_points_divide_their_shortest_path() {
    let mesh = manifold(shapes::torus(40, 20, 1.0, 0.4));
    let intrinsic = IntrinsicMesh::from_mesh(&mesh);
    let [a, b] = [17, 105].map(|v| SurfacePoint::Vertex(Vertex(v)));
    let distances = |point| exact_distances(&intrinsic, &[point], &ExactOptions::with_windows(), &NoProgress);
    let length = distances(a).unwrap().distance_at(b).unwrap();
    for weight in [1.0, 3.0] {
        let found = centre(&mesh, &[(a, 1.0), (b, weight)], CentreKind::Mean);
        let at = SurfacePoint::Face(found.point);
        let [from_a, from_b] = [a, b].map(|point| distances(point).unwrap().distance_at(at).unwrap());
        approx::assert_relative_eq!(from_a, length * weight / (1.0 + weight), max_relative = 1e-4);
        approx::assert_relative_eq!(from_b, length / (1.0 + weight), max_relative = 1e-4);
    }
}

#[test]
fn what_has_no_centre_is_refused() {
    let mesh = IntrinsicMesh::from_mesh(&crooked_grid());
    let refused = |points: &[(SurfacePoint, f64)]| {
        geodesic_centre(&mesh, points, CentreKind::Mean, 10, &NoProgress).unwrap_err()
    };
    assert_eq!(refused(&[]), FieldError::NoSource);
    let [on, off] = [1, 99_999].map(|v| SurfacePoint::Vertex(Vertex(v)));
    assert_eq!(refused(&[(on, -1.0)]), FieldError::NotPositive { name: "a weight", value: -1.0 });
    assert!(matches!(refused(&[(off, 1.0)]), FieldError::Distances(GeodesicError::NotOnMesh { .. })));
    let two = shapes::icosphere(1);
    let apart = two.map_positions(|p| p + DVec3::X * 5.0);
    let (mut positions, mut faces) = two.into_parts();
    let offset = positions.len() as u32;
    let (others, other_faces) = apart.into_parts();
    positions.extend(others);
    faces.extend(other_faces.iter().map(|face| face.map(|v| v + offset)));
    let mesh = manifold(TriangleMesh::new(positions, faces).unwrap());
    let points = vertices(&[0, offset]);
    let found = geodesic_centre(&IntrinsicMesh::from_mesh(&mesh), &points, CentreKind::Mean, 10, &NoProgress);
    assert!(matches!(found, Err(FieldError::Distances(GeodesicError::Unreached { .. }))));
}
