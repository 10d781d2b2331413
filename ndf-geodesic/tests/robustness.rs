//! What other implementations get wrong, made by code: flat vertices, slivers, needles, edges without length,
//! sources that coincide, boundaries, several components; and where computations stop.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod common;

use common::subdivided;
use ndf_core::DVec3;
use ndf_core::progress::{Cancelled, NoProgress, Progress};
#[cfg(feature = "heat")]
use ndf_geodesic::HeatSolver;
use ndf_geodesic::{ExactOptions, GeodesicError, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::shapes;
use ndf_mesh::{Edge, Face, FacePoint, Halfedge, ManifoldMesh, SurfacePoint, TriangleMesh, Vertex};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

fn intrinsic(mesh: &TriangleMesh) -> IntrinsicMesh {
    IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh.clone()).unwrap())
}

fn from_vertex(mesh: &IntrinsicMesh, v: u32) -> Vec<f64> {
    exact_distances(mesh, &[SurfacePoint::Vertex(Vertex(v))], &ExactOptions::default(), &NoProgress)
        .unwrap()
        .distances()
        .to_vec()
}

#[test]
fn a_finely_subdivided_cube_is_exact() {
    let cube = shapes::cube(52);
    assert!(cube.vertex_count() > 16_000);
    let mesh = intrinsic(&cube);
    let coarse = intrinsic(&shapes::cube(1));
    // A corner: compared with the cube of twelve triangles, asked at every vertex' place.
    let corner =
        |m: &TriangleMesh| m.positions().iter().position(|p| *p == DVec3::splat(-1.0)).unwrap() as u32;
    let d = from_vertex(&mesh, corner(&cube));
    let small = shapes::cube(1);
    let truth = exact_distances(
        &coarse,
        &[SurfacePoint::Vertex(Vertex(corner(&small)))],
        &ExactOptions::with_windows(),
        &NoProgress,
    )
    .unwrap();
    let small = ManifoldMesh::try_from(small).unwrap();
    let tree = ndf_mesh::TriangleTree::new(&small);
    let mut worst: f64 = 0.0;
    for (p, d) in cube.positions().iter().zip(&d) {
        let foot = tree.closest_point(*p, ndf_core::Hint::NONE).unwrap();
        let point = SurfacePoint::Face(foot.at);
        worst = worst.max((truth.distance_at(point).unwrap() - d).abs());
    }
    assert!(worst < 2e-14, "{worst:e}");
    // An inner vertex of a side: straight on that side.
    let source =
        cube.positions().iter().position(|p| p.z == -1.0 && p.x.abs() < 0.1 && p.y.abs() < 0.1).unwrap();
    let d = from_vertex(&mesh, source as u32);
    for (q, d) in cube.positions().iter().zip(&d) {
        if q.z == -1.0 {
            let truth = cube.positions()[source].distance(*q);
            assert!((d - truth).abs() < 1e-14, "{q}: {d} {truth}");
        }
    }
}

#[test]
fn a_flat_plate_has_no_saddles() {
    // Rotated, so that no coordinate is exact; random inner triangulation by moving vertices in the plane.
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let n = 60;
    let grid = shapes::grid(n, n);
    let (u, v) = (DVec3::new(0.8, 0.36, 0.48), DVec3::new(-0.6, 0.48, 0.64));
    let positions: Vec<DVec3> = grid
        .positions()
        .iter()
        .map(|p| {
            let inner = p.x > 0.0 && p.x < 1.0 && p.y > 0.0 && p.y < 1.0;
            let mut jitter = || if inner { rng.random_range(-0.3..0.3) / f64::from(n) } else { 0.0 };
            u * (p.x + jitter()) + v * (p.y + jitter())
        })
        .collect();
    let plate = TriangleMesh::new(positions, grid.faces().to_vec()).unwrap();
    let mesh = intrinsic(&plate);
    for source in [0, n / 2, (n + 1) * (n / 2) + 7] {
        let d = from_vertex(&mesh, source);
        let from = plate.positions()[source as usize];
        for (p, d) in plate.positions().iter().zip(&d) {
            assert!((d - p.distance(from)).abs() < 1e-13);
        }
    }
}

/// A surface cut by grid planes, as marching cubes leaves it: slivers down to 1e-9 of an edge.
fn slivers() -> TriangleMesh {
    // Spheres whose level passes grid corners by a hair.
    let n = 24_usize;
    let value = |i: usize, j: usize, k: usize| {
        let p = DVec3::new(i as f64, j as f64, k as f64) / n as f64 * 2.4 - 1.2;
        p.length() - 1.0 - 1e-9
    };
    let at = |i: usize, j: usize, k: usize| (i * (n + 1) + j) * (n + 1) + k;
    let mut index = std::collections::BTreeMap::new();
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    // Six tetrahedra a cell around its diagonal.
    let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    for cell in 0..n * n * n {
        let base = [cell / (n * n), cell / n % n, cell % n];
        for order in orders {
            let mut corner = base;
            let mut tet = vec![corner];
            for axis in order {
                corner[axis] += 1;
                tet.push(corner);
            }
            let values: Vec<f64> = tet.iter().map(|c| value(c[0], c[1], c[2])).collect();
            let (inside, outside): (Vec<usize>, Vec<usize>) = (0..4).partition(|&i| values[i] < 0.0);
            let mut vertex = |a: usize, b: usize| {
                let key = |c: [usize; 3]| at(c[0], c[1], c[2]);
                let (lo, hi) = if key(tet[a]) < key(tet[b]) { (a, b) } else { (b, a) };
                *index.entry((key(tet[lo]), key(tet[hi]))).or_insert_with(|| {
                    let t = values[lo] / (values[lo] - values[hi]);
                    let p = |c: [usize; 3]| DVec3::from_array(c.map(|x| x as f64)) / n as f64 * 2.4 - 1.2;
                    positions.push(p(tet[lo]).lerp(p(tet[hi]), t));
                    positions.len() as u32 - 1
                })
            };
            let polygon: Vec<u32> = match (&inside[..], &outside[..]) {
                ([a], [p, q, r]) | ([p, q, r], [a]) => vec![vertex(*a, *p), vertex(*a, *q), vertex(*a, *r)],
                ([a, b], [p, q]) => vec![vertex(*a, *p), vertex(*a, *q), vertex(*b, *q), vertex(*b, *p)],
                _ => continue,
            };
            for i in 1..polygon.len() - 1 {
                faces.push([polygon[0], polygon[i], polygon[i + 1]]);
            }
        }
    }
    let mesh = ndf_mesh::repair::oriented(&TriangleMesh::new(positions, faces).unwrap());
    ndf_mesh::repair::without_unreferenced_vertices(&mesh).0
}

#[test]
fn slivers_leave_nothing_unreached() {
    let mesh = slivers();
    let intrinsic = intrinsic(&mesh);
    let needle = intrinsic
        .faces()
        .map(|f| ndf_intrinsic::triangle::smallest_angle(intrinsic.sides(f)))
        .fold(f64::INFINITY, f64::min);
    assert!(needle < 1e-5, "the fixture has slivers: {needle}");
    let geodesics = exact_distances(
        &intrinsic,
        &[SurfacePoint::Vertex(Vertex(0))],
        &ExactOptions::with_windows(),
        &NoProgress,
    )
    .unwrap();
    assert_eq!(geodesics.unreached(), 0);
    let from = mesh.positions()[0].normalize();
    for (v, (p, d)) in mesh.positions().iter().zip(geodesics.distances()).enumerate() {
        let sphere = p.normalize().dot(from).clamp(-1.0, 1.0).acos();
        assert!((d - sphere).abs() < 0.02, "{d} {sphere}");
        if v % 97 == 0 {
            let back = from_vertex(&intrinsic, v as u32)[0];
            assert!((back - d).abs() < 1e-11, "{v}: {d} there, {back} back");
        }
    }
}

#[test]
fn a_mesh_stretched_sixty_times_is_symmetric() {
    let mesh = shapes::torus(40, 20, 1.0, 0.4).map_positions(|p| DVec3::new(p.x, p.y, 60.0 * p.z));
    let intrinsic = intrinsic(&mesh);
    let d: Vec<Vec<f64>> = (0..40).map(|i| from_vertex(&intrinsic, 20 * i + i % 20)).collect();
    for i in 0..40_usize {
        for j in 0..40_usize {
            let (there, back) = (d[i][20 * j + j % 20], d[j][20 * i + i % 20]);
            assert!((there - back).abs() < 1e-11, "{i} {j} {there} {back}");
        }
    }
    // A stretched plane stays Euclidean.
    let plane = shapes::grid(30, 30).map_positions(|p| DVec3::new(60.0 * p.x, p.y, 0.0));
    let d = from_vertex(&self::intrinsic(&plane), 77);
    for (p, d) in plane.positions().iter().zip(d) {
        assert!((d - p.distance(plane.positions()[77])).abs() < 1e-11);
    }
}

/// On a lattice of whole numbers lines from lattice points, and from the middles of edges and faces, run exactly through
/// vertices: windows are cut where they start or end, and what is left of them starts where it ends.
#[test]
fn windows_that_start_where_they_end_are_no_windows() {
    let n = 16;
    let lattice = shapes::grid(n, n).map_positions(|p| (p * f64::from(n)).round());
    // The same folded up and down along every column of vertices.
    let folded = lattice.map_positions(|p| DVec3::new(p.x, p.y, p.x % 2.0));
    let middle = n / 2 * (n + 1) + n / 2;
    let quads = n / 2 * n + n / 2;
    for (mesh, stretch) in [(&lattice, 1.0), (&folded, 2.0_f64.sqrt())] {
        let mesh = ManifoldMesh::try_from(mesh.clone()).unwrap();
        let intrinsic = IntrinsicMesh::from_mesh(&mesh);
        let edge = intrinsic.edges().nth(mesh.vertex_count()).unwrap();
        for source in [
            SurfacePoint::Vertex(Vertex(0)),
            SurfacePoint::Vertex(Vertex(middle)),
            SurfacePoint::Edge { edge, t: 0.5 },
            SurfacePoint::Face(FacePoint { face: Face(2 * quads), barycentric: [0.25, 0.25, 0.5] }),
            SurfacePoint::Face(FacePoint { face: Face(2 * quads + 1), barycentric: [0.5, 0.5, 0.0] }),
        ] {
            let geodesics =
                exact_distances(&intrinsic, &[source], &ExactOptions::with_windows(), &NoProgress).unwrap();
            assert_eq!(geodesics.unreached(), 0);
            // The folds of the second surface are straight: it unrolls to a plane, wider by √2.
            let unrolled = |p: DVec3| DVec3::new(p.x * stretch, p.y, 0.0);
            let from = unrolled(source.position(&mesh));
            for (v, (p, d)) in mesh.positions().iter().zip(geodesics.distances()).enumerate() {
                let truth = unrolled(*p).distance(from);
                assert!((d - truth).abs() <= 1e-14 * f64::from(n), "{source:?} to {v}: {d} {truth}");
                let path = geodesics.path_to(SurfacePoint::Vertex(Vertex(v as u32))).unwrap();
                let positions = path.positions(&mesh);
                let length: f64 = positions.windows(2).map(|p| p[0].distance(p[1])).sum();
                assert!((length - truth).abs() < 1e-12 * f64::from(n), "path to {v}: {length} {truth}");
            }
        }
    }
}

#[test]
fn edges_without_length_and_flat_faces_are_crossed() {
    // A plane whose vertices snap to a coarser lattice: many faces and edges have no length or area.
    let fine = shapes::grid(24, 24);
    let snapped =
        fine.map_positions(|p| DVec3::new((p.x * 10.0).round() / 10.0, (p.y * 10.0).round() / 10.0, 0.0));
    let mesh = ManifoldMesh::try_from(snapped).unwrap();
    let intrinsic = IntrinsicMesh::from_mesh(&mesh);
    assert!(intrinsic.lengths().contains(&0.0));
    for source in [0, 12, 300] {
        let geodesics = exact_distances(
            &intrinsic,
            &[SurfacePoint::Vertex(Vertex(source))],
            &ExactOptions::with_windows(),
            &NoProgress,
        )
        .unwrap();
        assert_eq!(geodesics.unreached(), 0);
        for (v, (p, d)) in mesh.positions().iter().zip(geodesics.distances()).enumerate() {
            let truth = p.distance(mesh.positions()[source as usize]);
            assert!((d - truth).abs() < 1e-12, "{source} to {v}: {d} {truth}");
            let path = geodesics.path_to(SurfacePoint::Vertex(Vertex(v as u32))).unwrap();
            let positions = path.positions(&mesh);
            let length: f64 = positions.windows(2).map(|p| p[0].distance(p[1])).sum();
            assert!((length - truth).abs() < 1e-9, "{source} to {v}: {length} {truth}");
        }
    }
    #[cfg(feature = "heat")]
    assert!(HeatSolver::new(&intrinsic).unwrap().distances(&[SurfacePoint::Vertex(Vertex(0))]).is_ok());
}

/// Spheres so flat that lengths do not determine their faces: distances, or an error in bounded time and memory.
#[test]
fn windows_do_not_multiply_without_end() {
    let round = shapes::icosphere(3);
    for flat in [1e-8, 1e-10, 1e-12, 0.0] {
        let mesh = intrinsic(&round.map_positions(|p| DVec3::new(p.x, flat * p.y, flat * p.z)));
        let source = [SurfacePoint::Vertex(Vertex(0))];
        for options in [ExactOptions::default(), ExactOptions::with_windows()] {
            match exact_distances(&mesh, &source, &options, &NoProgress) {
                Ok(geodesics) => assert!(geodesics.distances().iter().all(|d| *d < 8.0), "{flat}"),
                Err(error) => assert!(error.to_string().contains("too slender"), "{flat}: {error}"),
            }
        }
    }
}

#[test]
fn coinciding_sources_are_one() {
    let mesh = intrinsic(&shapes::torus(20, 10, 1.0, 0.4));
    let face = SurfacePoint::Face(FacePoint { face: Face(7), barycentric: [0.2, 0.5, 0.3] });
    let corner = SurfacePoint::Face(FacePoint { face: Face(3), barycentric: [0.0, 1.0, 0.0] });
    let at_corner = SurfacePoint::Vertex(mesh.tail(Halfedge(10)));
    let run = |sources: &[SurfacePoint]| {
        exact_distances(&mesh, sources, &ExactOptions::default(), &NoProgress).unwrap().distances().to_vec()
    };
    let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-13);
    assert!(close(&run(&[face]), &run(&[face, face, face])));
    assert!(close(&run(&[corner]), &run(&[at_corner])));
    assert!(close(&run(&[corner]), &run(&[at_corner, corner, at_corner])));
    let end = SurfacePoint::Edge { edge: Edge(5), t: 1.0 };
    let tip = SurfacePoint::Vertex(mesh.edge_vertices(Edge(5))[1]);
    assert!(close(&run(&[end]), &run(&[tip])));
    // From both faces of an edge the same point.
    let edge = Edge(9);
    let h = mesh.edge_halfedge(edge);
    let twin = mesh.twin(h).unwrap();
    let on = |h: Halfedge, t: f64| SurfacePoint::Face(FacePoint::on_halfedge(h, t));
    assert!(close(&run(&[on(h, 0.3)]), &run(&[on(twin, 0.7)])));
    assert!(close(&run(&[on(h, 0.3), on(twin, 0.7)]), &run(&[SurfacePoint::Edge { edge, t: 0.3 }])));
}

#[test]
fn other_components_are_unreached() {
    let sphere = shapes::icosphere(2);
    let n = sphere.vertex_count() as u32;
    let (mut positions, mut faces) = sphere.into_parts();
    positions.extend(positions.clone().iter().map(|p| *p + DVec3::X * 5.0));
    faces.extend(faces.clone().iter().map(|f| f.map(|v| v + n)));
    let mesh = intrinsic(&TriangleMesh::new(positions, faces).unwrap());
    let geodesics = exact_distances(
        &mesh,
        &[SurfacePoint::Vertex(Vertex(0))],
        &ExactOptions::with_windows(),
        &NoProgress,
    )
    .unwrap();
    assert_eq!(geodesics.unreached(), n as usize);
    assert!(geodesics.distances()[n as usize..].iter().all(|d| *d == f64::INFINITY));
    let far = SurfacePoint::Vertex(Vertex(n + 3));
    assert_eq!(geodesics.path_to(far).unwrap_err(), GeodesicError::Unreached { point: far });
    let inside = SurfacePoint::Face(FacePoint {
        face: Face::new(mesh.face_count() - 1),
        barycentric: [0.3, 0.3, 0.4],
    });
    assert_eq!(geodesics.distance_at(inside).unwrap(), f64::INFINITY);
}

/// Every vertex is reached as a target, alone or among others, also beside its source, where the ways to it over the corners of
/// its face are one and differ by rounding.
#[test]
fn targets_next_to_sources_are_reached() {
    let turned = |p: DVec3| {
        let p = p + 0.05 * DVec3::new((5.0 * p.y).sin(), (7.0 * p.z).cos(), (3.0 * p.x).sin());
        DVec3::new(0.6 * p.x - 0.8 * p.y, 0.8 * p.x + 0.6 * p.y, 1.1 * p.z) * 0.37
    };
    let mesh = ManifoldMesh::try_from(shapes::icosphere(3).map_positions(turned)).unwrap();
    let mesh = IntrinsicMesh::from_mesh(&mesh);
    for source in mesh.vertices().step_by(3) {
        let from = [SurfacePoint::Vertex(source)];
        let all = exact_distances(&mesh, &from, &ExactOptions::default(), &NoProgress).unwrap();
        let ring: Vec<_> = mesh.ring(source).collect();
        let alone = ring.iter().map(|&v| vec![v]);
        for targets in alone.chain([ring.clone()]) {
            let options = ExactOptions {
                targets: targets.iter().copied().map(SurfacePoint::Vertex).collect(),
                ..ExactOptions::with_windows()
            };
            let found = exact_distances(&mesh, &from, &options, &NoProgress).unwrap();
            for v in targets {
                let (distance, expected) = (found.distances()[v.index()], all.distances()[v.index()]);
                assert!(
                    (distance - expected).abs() <= 1e-12 * expected,
                    "{source} {v}: {distance} {expected}"
                );
                assert!(found.path_to(SurfacePoint::Vertex(v)).is_ok(), "{source} {v}");
            }
        }
    }
}

#[test]
fn radius_and_targets_stop_the_front_and_change_no_distance() {
    let mesh = intrinsic(&shapes::trefoil_knot(200, 16, 0.2));
    let source = [SurfacePoint::Face(FacePoint { face: Face(100), barycentric: [0.3, 0.3, 0.4] })];
    let full = exact_distances(&mesh, &source, &ExactOptions::with_windows(), &NoProgress).unwrap();
    for radius in [0.05, 0.7, 2.0] {
        let options = ExactOptions { radius, ..ExactOptions::default() };
        let near = exact_distances(&mesh, &source, &options, &NoProgress).unwrap();
        for (a, b) in near.distances().iter().zip(full.distances()) {
            assert!(if *b <= radius { (a - b).abs() < 1e-13 } else { *a == f64::INFINITY });
        }
        assert!(near.report().windows < full.report().windows);
    }
    for target in [
        SurfacePoint::Vertex(Vertex(1234)),
        SurfacePoint::Edge { edge: Edge(777), t: 0.2 },
        SurfacePoint::Face(FacePoint { face: Face(110), barycentric: [0.1, 0.1, 0.8] }),
        source[0],
    ] {
        let options = ExactOptions { targets: vec![target], ..ExactOptions::with_windows() };
        let near = exact_distances(&mesh, &source, &options, &NoProgress).unwrap();
        let d = near.distance_at(target).unwrap();
        assert!((d - full.distance_at(target).unwrap()).abs() < 1e-13);
        assert!(near.report().windows < full.report().windows);
        for (a, b) in near.distances().iter().zip(full.distances()) {
            assert!(a.is_infinite() || (a - b).abs() < 1e-13);
        }
        assert!((near.path_to(target).unwrap().length - d).abs() < 1e-13);
    }
}

#[test]
fn bad_requests_are_errors() {
    let mesh = intrinsic(&shapes::icosphere(1));
    let run = |sources: &[SurfacePoint]| {
        exact_distances(&mesh, sources, &ExactOptions::default(), &NoProgress).err()
    };
    assert_eq!(run(&[]), Some(GeodesicError::NoSource));
    for point in [
        SurfacePoint::Vertex(Vertex(42)),
        SurfacePoint::Edge { edge: Edge(1000), t: 0.5 },
        SurfacePoint::Edge { edge: Edge(0), t: 1.5 },
        SurfacePoint::Face(FacePoint { face: Face(80), barycentric: [1.0, 0.0, 0.0] }),
        SurfacePoint::Face(FacePoint { face: Face(0), barycentric: [0.7, 0.7, 0.0] }),
        SurfacePoint::Face(FacePoint { face: Face(0), barycentric: [1.5, -0.5, 0.0] }),
    ] {
        assert_eq!(run(&[point]), Some(GeodesicError::NotOnMesh { point }));
    }
    let nan = SurfacePoint::Face(FacePoint { face: Face(0), barycentric: [f64::NAN, 0.5, 0.5] });
    assert!(matches!(run(&[nan]), Some(GeodesicError::NotOnMesh { .. })));
    let bare =
        exact_distances(&mesh, &[SurfacePoint::Vertex(Vertex(0))], &ExactOptions::default(), &NoProgress)
            .unwrap();
    assert_eq!(bare.path_to(SurfacePoint::Vertex(Vertex(3))).unwrap_err(), GeodesicError::WindowsNotKept);
    let inside = SurfacePoint::Face(FacePoint { face: Face(0), barycentric: [0.5, 0.25, 0.25] });
    assert_eq!(bare.distance_at(inside).unwrap_err(), GeodesicError::WindowsNotKept);
}

struct Impatient;

impl Progress for Impatient {
    fn report(&self, _stage: &str, _fraction: f64) {}

    fn cancelled(&self) -> bool {
        true
    }
}

#[test]
fn the_observer_can_cancel_and_runs_repeat() {
    let mesh = intrinsic(&shapes::torus(60, 40, 1.0, 0.4));
    let error =
        exact_distances(&mesh, &[SurfacePoint::Vertex(Vertex(0))], &ExactOptions::default(), &Impatient)
            .err();
    assert_eq!(error, Some(GeodesicError::Cancelled(Cancelled)));
    assert_eq!(from_vertex(&mesh, 5), from_vertex(&mesh, 5));
}

/// Noise from small to senseless, stretched sixty times or pressed flat, and snapped to a lattice, which
/// makes faces without area and edges without length: subdivision must change no distance, and paths must be
/// as long as said.
#[test]
fn subdivision_changes_no_distance_on_noise_of_any_kind() {
    for seed in 0..180_u64 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let base = match seed % 4 {
            0 => shapes::icosphere(2),
            1 => shapes::torus(30, 15, 1.0, 0.4),
            2 => shapes::grid(20, 18),
            _ => shapes::cube(8),
        };
        let amplitude = [0.003, 0.03, 0.1, 0.5, 3.0][(seed / 4 % 5) as usize];
        let stretch = [1.0, 60.0, 0.01][(seed / 20 % 3) as usize];
        let lattice = if seed / 60 % 3 == 1 { 16.0 } else { 1e9 };
        let moved: Vec<DVec3> = base
            .positions()
            .iter()
            .map(|p| {
                let noise = DVec3::from_array([0; 3].map(|_| rng.random_range(-amplitude..amplitude)));
                ((*p + noise) * lattice).round() / lattice * DVec3::new(1.0, 1.0, stretch)
            })
            .collect();
        let mesh = TriangleMesh::new(moved, base.faces().to_vec()).unwrap();
        let fine = intrinsic(&subdivided(&mesh));
        let mesh = ManifoldMesh::try_from(mesh).unwrap();
        let coarse = IntrinsicMesh::from_mesh(&mesh);
        let source = rng.random_range(0..mesh.vertex_count() as u32);
        let geodesics = exact_distances(
            &coarse,
            &[SurfacePoint::Vertex(Vertex(source))],
            &ExactOptions::with_windows(),
            &NoProgress,
        )
        .unwrap();
        let max = geodesics.distances().iter().copied().fold(0.0, f64::max);
        for (v, (a, b)) in geodesics.distances().iter().zip(from_vertex(&fine, source)).enumerate() {
            assert!((a - b).abs() < 1e-12 * max, "{seed}, vertex {v}: {a} {b}");
        }
        for v in mesh.topology().vertices().step_by(17) {
            let path = geodesics.path_to(SurfacePoint::Vertex(v)).unwrap();
            let length: f64 = path.positions(&mesh).windows(2).map(|p| p[0].distance(p[1])).sum();
            assert!(
                (length - path.length).abs() < 1e-9 * max,
                "{seed}, path to {v}: {length} {}",
                path.length
            );
        }
    }
}

/// The regions of sources are those in which their own distances are the smallest.
#[test]
fn nearest_sources_are_those_with_the_smallest_distances() {
    let mut mesh = shapes::torus(40, 24, 1.0, 0.4);
    // Vertices at one place: a face without area.
    let mut points = mesh.positions().to_vec();
    points[100] = points[101];
    mesh = TriangleMesh::new(points, mesh.faces().to_vec()).unwrap();
    let mesh = intrinsic(&mesh);
    let at = |face: u32, barycentric| SurfacePoint::Face(FacePoint { face: Face(face), barycentric });
    let sources = [
        SurfacePoint::Vertex(Vertex(100)),
        at(700, [0.2, 0.3, 0.5]),
        SurfacePoint::Vertex(Vertex(640)),
        SurfacePoint::Edge { edge: Edge(1300), t: 0.3 },
        SurfacePoint::Vertex(Vertex(100)),
    ];
    let distances = |sources: &[SurfacePoint]| {
        exact_distances(&mesh, sources, &ExactOptions::default(), &NoProgress).unwrap()
    };
    let all = distances(&sources);
    let each: Vec<Vec<f64>> = sources.iter().map(|&s| distances(&[s]).distances().to_vec()).collect();
    let mut sizes = [0; 5];
    for (v, source) in all.nearest_sources().into_iter().enumerate() {
        let source = source.unwrap();
        assert!(each[source][v] <= all.distances()[v] * (1.0 + 1e-12) + 1e-15, "vertex {v}: {source}");
        sizes[source] += 1;
    }
    assert!(sizes[..4].iter().all(|&size| size > 50) && sizes[4] == 0, "{sizes:?}");
    let near = ExactOptions { radius: 0.3, ..ExactOptions::default() };
    let found = exact_distances(&mesh, &sources, &near, &NoProgress).unwrap();
    let none = found.nearest_sources().iter().filter(|source| source.is_none()).count();
    assert!(none > 0 && none == found.unreached());
}

/// Also where fans of faces meet in one vertex.
#[test]
fn sources_are_nearest_beyond_joined_vertices() {
    let grid = shapes::grid(2, 2);
    let n = grid.vertex_count() as u32;
    let corner = grid.positions()[n as usize - 1];
    let points = grid.positions().iter().copied().chain(grid.positions().iter().map(|p| *p + corner));
    let faces = grid.faces().iter().copied().chain(grid.faces().iter().map(|f| f.map(|v| v + n)));
    let mesh = intrinsic(&TriangleMesh::new(points.collect(), faces.collect()).unwrap());
    let joined = vec![vec![Vertex(n - 1), Vertex(n)]];
    let options = ExactOptions { joined, ..ExactOptions::default() };
    let source = SurfacePoint::Vertex(Vertex(0));
    let found = exact_distances(&mesh, &[source], &options, &NoProgress).unwrap();
    assert!(found.nearest_sources().iter().all(|&source| source == Some(0)));
}
