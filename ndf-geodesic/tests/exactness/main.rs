//! What holds for every exact distance, on lattices, where straight lines meet vertices exactly, and on noise:
//! distances are symmetric and those of a slower way, paths are as long as said and lie on the surface.

#![allow(clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;
mod lattices;
mod unfolding;

use ndf_core::glam::{DQuat, EulerRot};
use ndf_core::{DVec3, NoProgress};
use ndf_geodesic::{ExactOptions, Geodesics, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Edge, Face, FacePoint, Halfedge, ManifoldMesh, SurfacePoint, TriangleMesh, shapes};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// By how much distances that agree may differ, relatively.
const TOLERANCE: f64 = 1e-9;

/// Points in faces and on edges, half of them where lines from them meet vertices on a lattice.
fn others(mesh: &IntrinsicMesh, count: usize, rng: &mut ChaCha8Rng) -> Vec<SurfacePoint> {
    let mut point = |i| {
        let face = Face(rng.random_range(0..mesh.face_count() as u32));
        let edge = Edge(rng.random_range(0..mesh.edge_count() as u32));
        let (a, b): (f64, f64) = (rng.random(), rng.random());
        match i % 4 {
            0 => SurfacePoint::Edge { edge, t: 0.5 },
            1 => SurfacePoint::Face(FacePoint { face, barycentric: [0.25, 0.25, 0.5] }),
            2 => SurfacePoint::Edge { edge, t: a },
            _ => SurfacePoint::Face(FacePoint { face, barycentric: [1.0 - a, a * b, a * (1.0 - b)] }),
        }
    };
    (0..count).map(&mut point).collect()
}

/// The faces that a point belongs to.
fn faces_of(mesh: &IntrinsicMesh, point: SurfacePoint) -> Vec<Face> {
    match point {
        SurfacePoint::Vertex(v) => mesh.outgoing(v).map(Halfedge::face).collect(),
        SurfacePoint::Edge { edge, .. } => {
            let halfedge = mesh.edge_halfedge(edge);
            std::iter::once(halfedge).chain(mesh.twin(halfedge)).map(Halfedge::face).collect()
        }
        SurfacePoint::Face(point) => vec![point.face],
    }
}

/// Checks that the path to a point runs over the surface from there to the source, and is as long as the point is far.
fn check_path(
    mesh: &ManifoldMesh,
    intrinsic: &IntrinsicMesh,
    geodesics: &Geodesics<'_>,
    to: SurfacePoint,
    source: SurfacePoint,
) {
    let path = geodesics.path_to(to).unwrap_or_else(|error| panic!("from {source:?}: {error}"));
    assert_eq!(path.length, geodesics.distance_at(to).unwrap());
    let positions = path.positions(mesh);
    let scale = mesh.bounds().diagonal();
    assert!(positions[0].distance(to.position(mesh)) <= 1e-12 * scale, "{to:?}: begins at {}", positions[0]);
    let last = positions[positions.len() - 1];
    assert!(last.distance(source.position(mesh)) <= 1e-12 * scale, "{source:?}: ends at {last}");
    let length: f64 = positions.windows(2).map(|p| p[0].distance(p[1])).sum();
    assert!(agree(length, path.length), "{source:?} to {to:?}: {length} is not {}", path.length);
    let faces: Vec<Vec<Face>> = path.points.iter().map(|&p| faces_of(intrinsic, p)).collect();
    let is_on_surface = faces.windows(2).all(|f| f[0].iter().any(|face| f[1].contains(face)));
    assert!(is_on_surface, "{source:?} to {to:?}: {:?}", path.points);
}

fn agree(a: f64, b: f64) -> bool {
    a == b || (a - b).abs() <= TOLERANCE * a.max(b)
}

/// Checks the distances between all vertices and some other points of a mesh: they are symmetric, and those of the slow
/// way; and one path in `stride` from every point.
fn check(name: &str, mesh: &TriangleMesh, stride: usize) {
    let mesh = ManifoldMesh::try_from(mesh.clone()).unwrap();
    let intrinsic = IntrinsicMesh::from_mesh(&mesh);
    let others = others(&intrinsic, 8, &mut ChaCha8Rng::seed_from_u64(1));
    let points: Vec<SurfacePoint> =
        intrinsic.vertices().map(SurfacePoint::Vertex).chain(others.iter().copied()).collect();
    let mut matrix = Vec::new();
    for (i, &source) in points.iter().enumerate() {
        let geodesics =
            exact_distances(&intrinsic, &[source], &ExactOptions::with_windows(), &NoProgress).unwrap();
        matrix.push(points.iter().map(|&to| geodesics.distance_at(to).unwrap()).collect::<Vec<f64>>());
        let is_reached = |&to: &SurfacePoint| geodesics.distance_at(to).unwrap() < f64::INFINITY;
        for to in points.iter().copied().skip(i % stride).step_by(stride).filter(is_reached) {
            check_path(&mesh, &intrinsic, &geodesics, to, source);
        }
    }
    let truth = unfolding::distances(&intrinsic, &others);
    for (i, row) in matrix.iter().enumerate() {
        for (j, &d) in row.iter().enumerate() {
            let (from, to) = (points[i], points[j]);
            assert!(agree(d, matrix[j][i]), "{name}: {from:?} to {to:?}: {d}, back {}", matrix[j][i]);
            let truth = truth[i][j];
            assert!(agree(d, truth), "{name}: {from:?} to {to:?}: {d} is not {truth}");
        }
    }
}

#[test]
fn distances_on_lattices_are_shortest() {
    for (name, mesh) in lattices::all() {
        check(name, &mesh, 7);
    }
}

#[test]
fn distances_on_noise_are_shortest() {
    for seed in 0..20 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let base = match seed % 4 {
            0 => shapes::icosphere(1),
            1 => shapes::torus(12, 7, 1.0, 0.4),
            2 => shapes::grid(11, 7),
            _ => shapes::cube(4),
        };
        let amplitude = [0.01, 0.05, 0.2, 1.0, 5.0][(seed % 5) as usize];
        let mut noise = || DVec3::from_array([0; 3].map(|_| rng.random_range(-amplitude..amplitude)));
        let positions = base.positions().iter().map(|&p| p + noise()).collect();
        let mesh = TriangleMesh::new(positions, base.faces().to_vec()).unwrap();
        check(&format!("noise {seed}"), &mesh, 7);
    }
}

/// Lattices of all kinds, slender ones among them, on which lines run along faces and boundaries.
#[test]
fn any_lattice_has_shortest_distances_and_paths_as_long() {
    for seed in 0..60 {
        check(&format!("lattice {seed}"), &lattices::random(&mut ChaCha8Rng::seed_from_u64(seed)), 3);
    }
}

/// Straight paths along the border of a strip of slender triangles.
#[test]
fn paths_along_borders_are_followed() {
    for (columns, rows, width) in [(7, 1, 0.01), (59, 3, 0.01), (59, 3, 0.1), (59, 3, 1e-4)] {
        for turn in [DQuat::IDENTITY, DQuat::from_euler(EulerRot::XYZ, 0.3, 0.4, 0.5)] {
            let strip =
                shapes::grid(columns, rows).map_positions(|p| turn * (p * DVec3::new(100.0, width, 0.0)));
            check(&format!("strip {columns} × {rows}"), &strip, 5);
        }
    }
}

/// Sources as near to a vertex as numbers allow are as good as the vertex, and reach everything.
#[test]
fn sources_may_lie_next_to_a_vertex() {
    let mesh = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(shapes::cube(3)).unwrap());
    let from = |source| {
        let geodesics = exact_distances(&mesh, &[source], &ExactOptions::default(), &NoProgress).unwrap();
        geodesics.distances().to_vec()
    };
    for edge in mesh.edges().step_by(7) {
        let truth = from(SurfacePoint::Vertex(mesh.edge_vertices(edge)[0]));
        for t in [1e-300, 1e-20, 1e-16, 1e-15, 1e-14, 1e-12, 1e-11, 1e-10, 1e-9] {
            let h = mesh.edge_halfedge(edge);
            let mut inside = FacePoint { face: h.face(), barycentric: [t; 3] };
            inside.barycentric[h.corner()] = 1.0 - 2.0 * t;
            for source in [SurfacePoint::Edge { edge, t }, SurfacePoint::Face(inside)] {
                for (v, (d, truth)) in from(source).into_iter().zip(&truth).enumerate() {
                    assert!((d - truth).abs() <= 4.0 * t + 1e-14, "{source:?} to {v}: {d} is not {truth}");
                }
            }
        }
    }
}
