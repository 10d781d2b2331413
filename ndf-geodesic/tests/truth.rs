//! Agreement with distances known without a computer, and with laws that hold on any surface.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::f64::consts::TAU;

use ndf_core::{DVec3, NoProgress};
use ndf_geodesic::{ExactOptions, Geodesics, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::Topology;
use ndf_mesh::shapes;
use ndf_mesh::{Edge, Face, FacePoint, Halfedge, ManifoldMesh, SurfacePoint, TriangleMesh, Vertex};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

fn manifold(mesh: TriangleMesh) -> ManifoldMesh {
    ManifoldMesh::try_from(mesh).unwrap()
}

fn run<'a>(mesh: &'a IntrinsicMesh, sources: &[SurfacePoint]) -> Geodesics<'a> {
    exact_distances(mesh, sources, &ExactOptions::with_windows(), &NoProgress).unwrap()
}

/// Distances from vertex 0, without windows.
fn from_first(mesh: &IntrinsicMesh) -> Geodesics<'_> {
    let source = [SurfacePoint::Vertex(Vertex(0))];
    exact_distances(mesh, &source, &ExactOptions::default(), &NoProgress).unwrap()
}

fn random_point(mesh: &IntrinsicMesh, rng: &mut ChaCha8Rng) -> SurfacePoint {
    let face = Face(rng.random_range(0..mesh.face_count() as u32));
    match rng.random_range(0..4) {
        0 => SurfacePoint::Vertex(Vertex(rng.random_range(0..mesh.vertex_count() as u32))),
        1 => {
            SurfacePoint::Edge { edge: Edge(rng.random_range(0..mesh.edge_count() as u32)), t: rng.random() }
        }
        _ => {
            let (a, b): (f64, f64) = (rng.random(), rng.random());
            let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
            SurfacePoint::Face(FacePoint { face, barycentric: [1.0 - a - b, a, b] })
        }
    }
}

/// A path's length in space and its ends agree with what is said of it.
fn check_path(mesh: &ManifoldMesh, geodesics: &Geodesics<'_>, to: SurfacePoint, sources: &[SurfacePoint]) {
    let path = geodesics.path_to(to).unwrap();
    let positions = path.positions(mesh);
    let length: f64 = positions.windows(2).map(|p| p[0].distance(p[1])).sum();
    let scale = mesh.bounds().diagonal();
    assert!((length - path.length).abs() < 1e-9 * scale, "{length} {} {to:?}", path.length);
    assert_eq!(path.length, geodesics.distance_at(to).unwrap());
    assert!(positions[0].distance(to.position(mesh)) < 1e-12 * scale);
    let end = sources[path.source].position(mesh);
    assert!(positions.last().unwrap().distance(end) < 1e-7 * scale, "ends {:?} at {end}", path.points.last());
}

#[test]
fn plane_is_euclidean() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mesh = manifold(shapes::grid(23, 17));
    let intrinsic = IntrinsicMesh::from_mesh(&mesh);
    for _ in 0..40 {
        let source = random_point(&intrinsic, &mut rng);
        let geodesics = run(&intrinsic, &[source]);
        let from = source.position(&mesh);
        for (p, d) in mesh.positions().iter().zip(geodesics.distances()) {
            assert!((d - p.distance(from)).abs() < 1e-13, "{source:?} {d} {}", p.distance(from));
        }
        for _ in 0..20 {
            let to = random_point(&intrinsic, &mut rng);
            let d = geodesics.distance_at(to).unwrap();
            assert!((d - to.position(&mesh).distance(from)).abs() < 1e-13);
            check_path(&mesh, &geodesics, to, &[source]);
        }
    }
}

/// A flat plate with a notch: a boundary vertex bends paths.
#[test]
fn paths_bend_around_a_notch() {
    // The unit square without its upper right quarter, in squares of 1/8.
    let full = shapes::grid(8, 8);
    let keep = |f: &&[u32; 3]| {
        let c = f.iter().map(|&v| full.positions()[v as usize]).sum::<DVec3>() / 3.0;
        !(c.x > 0.5 && c.y > 0.5)
    };
    let faces: Vec<[u32; 3]> = full.faces().iter().filter(keep).copied().collect();
    let plate = TriangleMesh::new(full.positions().to_vec(), faces).unwrap();
    let (plate, _) = ndf_mesh::repair::without_unreferenced_vertices(&plate);
    let mesh = manifold(plate);
    let intrinsic = IntrinsicMesh::from_mesh(&mesh);
    let at = |x: f64, y: f64| {
        mesh.positions().iter().position(|p| p.distance(DVec3::new(x, y, 0.0)) < 1e-12).unwrap()
    };
    let source = SurfacePoint::Vertex(Vertex::new(at(0.125, 1.0)));
    let geodesics = run(&intrinsic, &[source]);
    let corner = DVec3::new(0.5, 0.5, 0.0);
    let from = DVec3::new(0.125, 1.0, 0.0);
    for (v, p) in mesh.positions().iter().enumerate() {
        // Visible where the straight line passes the notch on the left.
        let visible = (corner - from).cross(*p - from).z <= 1e-12 || p.x <= 0.5;
        let truth = if visible { p.distance(from) } else { from.distance(corner) + corner.distance(*p) };
        assert!(
            (geodesics.distances()[v] - truth).abs() < 1e-13,
            "{p}: {} {truth}",
            geodesics.distances()[v]
        );
        check_path(&mesh, &geodesics, SurfacePoint::Vertex(Vertex(v as u32)), &[source]);
    }
}

#[test]
fn spheres_and_cylinders_converge() {
    let mut errors = Vec::new();
    for level in 2..6 {
        let mesh = manifold(shapes::icosphere(level));
        let intrinsic = IntrinsicMesh::from_mesh(&mesh);
        let geodesics = from_first(&intrinsic);
        let from = mesh.positions()[0];
        let error = mesh.positions().iter().zip(geodesics.distances());
        errors.push(error.map(|(p, d)| (d - p.dot(from).clamp(-1.0, 1.0).acos()).abs()).fold(0.0, f64::max));
    }
    println!("sphere: {errors:?}");
    assert!(errors.windows(2).all(|e| e[1] < 0.35 * e[0]), "second order: {errors:?}");

    let mut errors = Vec::new();
    for n in [8, 16, 32, 64] {
        let sheet = shapes::grid(2 * n, n);
        let rolled = |p: DVec3| DVec3::new((TAU * p.x).cos(), (TAU * p.x).sin(), 3.0 * p.y);
        // Close the sheet: the last column becomes the first.
        let columns = 2 * n + 1;
        let close = |v: u32| if v % columns == columns - 1 { v + 1 - columns } else { v };
        let faces = sheet.faces().iter().map(|f| f.map(close)).collect();
        let tube = TriangleMesh::new(sheet.map_positions(rolled).positions().to_vec(), faces).unwrap();
        let (tube, _) = ndf_mesh::repair::without_unreferenced_vertices(&tube);
        let mesh = manifold(tube);
        let intrinsic = IntrinsicMesh::from_mesh(&mesh);
        let geodesics = from_first(&intrinsic);
        let worst = mesh
            .positions()
            .iter()
            .zip(geodesics.distances())
            .map(|(p, d)| (d - p.y.atan2(p.x).abs().hypot(p.z)).abs());
        errors.push(worst.fold(0.0, f64::max));
    }
    println!("cylinder: {errors:?}");
    assert!(errors.windows(2).all(|e| e[1] < 0.3 * e[0]), "second order: {errors:?}");
}

#[test]
fn cube_unfolds() {
    // From a corner of a cube with sides of length 2 the opposite corner is at √(2² + 4²); the rest of a far
    // face is reached over one of the unfoldings below.
    for n in [1, 2, 5, 12] {
        let mesh = manifold(shapes::cube(n));
        let intrinsic = IntrinsicMesh::from_mesh(&mesh);
        let corner = mesh.positions().iter().position(|p| *p == DVec3::splat(-1.0)).unwrap();
        let source = SurfacePoint::Vertex(Vertex::new(corner));
        let geodesics = run(&intrinsic, &[source]);
        for (v, p) in mesh.positions().iter().enumerate() {
            let [x, y, z] = (*p + 1.0).to_array();
            // On a face through the corner: straight. On a far face, say x = 2: over y = 0, over z = 0, or
            // around.
            let far = |h: f64, a: f64, b: f64| {
                let over = |a: f64, b: f64| (h + a).hypot(b);
                // Sideways over the face next to it: first along b's face, then a's.
                let around = |a: f64, b: f64| (h + h - a).hypot(h + b);
                over(a, b).min(over(b, a)).min(around(a, b)).min(around(b, a))
            };
            let mut truth = f64::INFINITY;
            for (c, a, b) in [(x, y, z), (y, z, x), (z, x, y)] {
                if c == 0.0 {
                    truth = truth.min(a.hypot(b));
                } else if c == 2.0 {
                    truth = truth.min(far(2.0, a, b));
                }
            }
            let d = geodesics.distances()[v];
            assert!((d - truth).abs() < 1e-13, "{p} {d} {truth}");
            check_path(&mesh, &geodesics, SurfacePoint::Vertex(Vertex(v as u32)), &[source]);
        }
    }
}

/// On a regular tetrahedron every unfolding tiles the plane with triangles: the surface is the plane modulo
/// half turns about the lattice points, and distances are least over the images of a point.
#[test]
fn tetrahedron_unfolds() {
    let p = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]].map(DVec3::from_array);
    let mesh =
        manifold(TriangleMesh::new(p.to_vec(), vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]).unwrap());
    let intrinsic = IntrinsicMesh::from_mesh(&mesh);
    let edge = 8.0_f64.sqrt();
    let lattice = |i: f64, j: f64| [edge * (i + 0.5 * j), edge * 0.75_f64.sqrt() * j];
    // Faces 0 and 3 share the edge 1–2: laid out as the triangles (0, 1, 2) and (2, 1, 3) of a strip.
    let layout = [
        (0, [lattice(0.0, 0.0), lattice(1.0, 0.0), lattice(0.0, 1.0)]),
        (3, [lattice(1.0, 0.0), lattice(1.0, 1.0), lattice(0.0, 1.0)]),
    ];
    let planar = |face: u32, b: [f64; 3]| {
        let (_, corners) = layout.iter().find(|(f, _)| *f == face).unwrap();
        [0, 1].map(|k| (0..3).map(|c| b[c] * corners[c][k]).sum::<f64>())
    };
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut random = |face: u32| {
        let (a, b): (f64, f64) = (rng.random(), rng.random());
        let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
        (face, [1.0 - a - b, a, b])
    };
    for k in 0..50 {
        let ((f, s), (g, t)) =
            (random(if k % 2 == 0 { 0 } else { 3 }), random(if k % 3 == 0 { 0 } else { 3 }));
        let source = SurfacePoint::Face(FacePoint { face: Face(f), barycentric: s });
        let to = SurfacePoint::Face(FacePoint { face: Face(g), barycentric: t });
        let geodesics = run(&intrinsic, &[source]);
        let (from, at) = (planar(f, s), planar(g, t));
        let mut truth = f64::INFINITY;
        for i in -4..=4 {
            for j in -4..=4 {
                // Translations by twice the lattice, and half turns about its points.
                let [x, y] = lattice(2.0 * f64::from(i), 2.0 * f64::from(j));
                truth = truth.min((at[0] + x - from[0]).hypot(at[1] + y - from[1]));
                truth = truth.min((x - at[0] - from[0]).hypot(y - at[1] - from[1]));
            }
        }
        let d = geodesics.distance_at(to).unwrap();
        assert!((d - truth).abs() < 1e-13, "{d} {truth}");
        check_path(&mesh, &geodesics, to, &[source]);
    }
}

/// A flat torus of `n × m` parallelograms, known by lengths only; vertex `i m + j` at `i/n a + j/m b`.
fn flat_torus(n: u32, m: u32, a: [f64; 2], b: [f64; 2]) -> IntrinsicMesh {
    let at = |i: u32, j: u32| (i % n) * m + j % m;
    let (mut tails, mut twins) = (Vec::new(), Vec::new());
    // Faces of a cell: (p, p + a, p + a + b) and (p, p + a + b, p + b).
    for i in 0..n {
        for j in 0..m {
            let f = at(i, j);
            tails.extend([
                at(i, j),
                at(i + 1, j),
                at(i + 1, j + 1),
                at(i, j),
                at(i + 1, j + 1),
                at(i, j + 1),
            ]);
            twins.extend([6 * at(i, j + m - 1) + 4, 6 * at(i + 1, j) + 5, 6 * f + 3].map(Halfedge));
            twins.extend([6 * f + 2, 6 * at(i, j + 1), 6 * at(i + n - 1, j) + 1].map(Halfedge));
        }
    }
    let complex = Topology::from_gluing((n * m) as usize, &tails, &twins).unwrap();
    let step = |x: f64, y: f64| {
        (x * a[0] / f64::from(n) + y * b[0] / f64::from(m))
            .hypot(x * a[1] / f64::from(n) + y * b[1] / f64::from(m))
    };
    let of_side =
        [step(1.0, 0.0), step(0.0, 1.0), step(1.0, 1.0), step(1.0, 1.0), step(1.0, 0.0), step(0.0, 1.0)];
    let lengths = complex.edges().map(|e| of_side[complex.edge_halfedge(e).index() % 6]).collect();
    IntrinsicMesh::new(&complex, lengths, 1e-12).unwrap()
}

#[test]
fn flat_torus_by_images() {
    for (n, m, a, b) in [
        (1, 1, [1.0, 0.0], [0.0, 1.0]),
        (1, 1, [1.0, 0.0], [0.3, 0.8]),
        (2, 3, [2.0, 0.1], [0.4, 1.0]),
        (30, 20, [1.0, 0.0], [0.35, 0.9]),
        (40, 7, [1.0, 0.2], [0.0, 3.0]),
    ] {
        let mesh = flat_torus(n, m, a, b);
        for source in [0, (n * m) / 2] {
            let geodesics = run(&mesh, &[SurfacePoint::Vertex(Vertex(source))]);
            for v in 0..n * m {
                let (di, dj) =
                    (f64::from(v / m) - f64::from(source / m), f64::from(v % m) - f64::from(source % m));
                let mut truth = f64::INFINITY;
                for p in -3..=3 {
                    for q in -3..=3 {
                        let (s, t) = (di / f64::from(n) + f64::from(p), dj / f64::from(m) + f64::from(q));
                        truth = truth.min((s * a[0] + t * b[0]).hypot(s * a[1] + t * b[1]));
                    }
                }
                let d = geodesics.distances()[v as usize];
                assert!((d - truth).abs() < 1e-13, "{n}×{m}, {source} to {v}: {d} {truth}");
            }
            // Points inside faces, by images too.
            let mut rng = ChaCha8Rng::seed_from_u64(9);
            for _ in 0..50 {
                let face = rng.random_range(0..mesh.face_count() as u32);
                let (x, y): (f64, f64) = (rng.random(), rng.random());
                let (x, y) = if x + y > 1.0 { (1.0 - x, 1.0 - y) } else { (x, y) };
                let cell = face / 2;
                // Corners relative to the cell.
                let corners = if face % 2 == 0 {
                    [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]
                } else {
                    [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
                };
                let local =
                    [0, 1].map(|k| (1.0 - x - y) * corners[0][k] + x * corners[1][k] + y * corners[2][k]);
                let di = f64::from(cell / m) + local[0] - f64::from(source / m);
                let dj = f64::from(cell % m) + local[1] - f64::from(source % m);
                let mut truth = f64::INFINITY;
                for p in -3..=3 {
                    for q in -3..=3 {
                        let (s, t) = (di / f64::from(n) + f64::from(p), dj / f64::from(m) + f64::from(q));
                        truth = truth.min((s * a[0] + t * b[0]).hypot(s * a[1] + t * b[1]));
                    }
                }
                let point =
                    SurfacePoint::Face(FacePoint { face: Face(face), barycentric: [1.0 - x - y, x, y] });
                let d = geodesics.distance_at(point).unwrap();
                assert!((d - truth).abs() < 1e-13, "{d} {truth}");
                let path = geodesics.path_to(point).unwrap();
                assert_eq!(*path.points.last().unwrap(), SurfacePoint::Vertex(Vertex(source)));
            }
        }
    }
}

fn bumpy(seed: u64) -> ManifoldMesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let base = match seed % 3 {
        0 => shapes::icosphere(2),
        1 => shapes::torus(16, 9, 1.0, 0.4),
        _ => shapes::grid(9, 8),
    };
    let noise: Vec<DVec3> = (0..base.vertex_count())
        .map(|_| DVec3::from_array([0; 3].map(|_| rng.random_range(-0.06..0.06))))
        .collect();
    let positions = base.positions().iter().zip(noise).map(|(p, n)| *p + n).collect();
    manifold(TriangleMesh::new(positions, base.faces().to_vec()).unwrap())
}

#[test]
fn symmetry_and_triangle_inequality() {
    for seed in 0..12 {
        let mesh = bumpy(seed);
        let intrinsic = IntrinsicMesh::from_mesh(&mesh);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let points: Vec<SurfacePoint> = (0..9).map(|_| random_point(&intrinsic, &mut rng)).collect();
        let runs: Vec<Geodesics<'_>> = points.iter().map(|&p| run(&intrinsic, &[p])).collect();
        let d: Vec<Vec<f64>> =
            runs.iter().map(|g| points.iter().map(|&p| g.distance_at(p).unwrap()).collect()).collect();
        for i in 0..points.len() {
            assert!(d[i][i].abs() < 1e-12);
            for j in 0..points.len() {
                assert!((d[i][j] - d[j][i]).abs() < 1e-11, "{seed} {i} {j}: {} {}", d[i][j], d[j][i]);
                for k in 0..points.len() {
                    assert!(d[i][k] <= d[i][j] + d[j][k] + 1e-11);
                }
                check_path(&mesh, &runs[i], points[j], &[points[i]]);
            }
        }
        // Several sources: the least of the single distances.
        let all = run(&intrinsic, &points[..4]);
        for v in 0..mesh.vertex_count() {
            let truth = runs[..4].iter().map(|g| g.distances()[v]).fold(f64::INFINITY, f64::min);
            assert!((all.distances()[v] - truth).abs() < 1e-12);
        }
        for &p in &points {
            check_path(&mesh, &all, p, &points[..4]);
        }
    }
}

/// Shortest paths in the graph of a mesh whose edges carry `k` extra points, joined across faces: upper
/// bounds that tighten as `k` grows.
fn graph_distances(mesh: &ManifoldMesh, source: u32, k: usize) -> Vec<f64> {
    let vertices = mesh.vertex_count();
    let mut positions = mesh.positions().to_vec();
    for e in mesh.topology().edges() {
        let [a, b] = mesh.topology().edge_vertices(e).map(|v| mesh.positions()[v.index()]);
        positions.extend((1..=k).map(|i| a.lerp(b, i as f64 / (k + 1) as f64)));
    }
    let mut neighbours = vec![Vec::new(); positions.len()];
    for f in mesh.face_indices() {
        let on_rim: Vec<usize> = f
            .halfedges()
            .into_iter()
            .flat_map(|h| {
                let e = mesh.topology().halfedge_edge(h).index();
                std::iter::once(mesh.topology().tail(h).index())
                    .chain((0..k).map(move |i| vertices + e * k + i))
            })
            .collect();
        for &a in &on_rim {
            neighbours[a].extend(on_rim.iter().copied().filter(|&b| b != a));
        }
    }
    let mut d = vec![f64::INFINITY; positions.len()];
    d[source as usize] = 0.0;
    let mut heap =
        std::collections::BinaryHeap::from([(std::cmp::Reverse(0.0_f64.to_bits()), source as usize)]);
    while let Some((std::cmp::Reverse(bits), a)) = heap.pop() {
        if f64::from_bits(bits) > d[a] {
            continue;
        }
        for &b in &neighbours[a] {
            let through = d[a] + positions[a].distance(positions[b]);
            if through < d[b] {
                d[b] = through;
                heap.push((std::cmp::Reverse(through.to_bits()), b));
            }
        }
    }
    d.truncate(vertices);
    d
}

#[test]
fn graphs_bound_from_above_and_come_near() {
    for seed in 0..6 {
        let mesh = bumpy(seed);
        let intrinsic = IntrinsicMesh::from_mesh(&mesh);
        let exact = exact_distances(
            &intrinsic,
            &[SurfacePoint::Vertex(Vertex(3))],
            &ExactOptions::default(),
            &NoProgress,
        )
        .unwrap();
        for (k, gap) in [(1, 0.2), (20, 0.006)] {
            for (v, bound) in graph_distances(&mesh, 3, k).into_iter().enumerate() {
                let d = exact.distances()[v];
                assert!(d <= bound + 1e-12 && d >= bound * (1.0 - gap), "{seed} {k} {v}: {d} {bound}");
            }
        }
    }
}

/// Where vertices are joined, a distance is that to the joint and from there.
#[test]
fn paths_pass_joined_vertices() {
    let (mut positions, mut faces) = shapes::grid(6, 5).into_parts();
    let (more, their) = bumpy(2).into_triangle_mesh().into_parts();
    let first = positions.len() as u32;
    positions.extend(more.iter().map(|p| *p + 4.0 * DVec3::X));
    faces.extend(their.into_iter().map(|face| face.map(|v| v + first)));
    let mesh = manifold(TriangleMesh::new(positions, faces).unwrap());
    let intrinsic = IntrinsicMesh::from_mesh(&mesh);
    let (source, here, there) = (Vertex(3), Vertex(20), Vertex(first + 7));
    let from =
        |v| exact_distances(&intrinsic, &[SurfacePoint::Vertex(v)], &ExactOptions::default(), &NoProgress);
    let (from_source, from_joint) = (from(source).unwrap(), from(there).unwrap());
    assert!(from_source.unreached() > 0);
    let options = ExactOptions { joined: vec![vec![here, there]], ..ExactOptions::with_windows() };
    let all = exact_distances(&intrinsic, &[SurfacePoint::Vertex(source)], &options, &NoProgress).unwrap();
    let to_joint = from_source.distances()[here.index()];
    for v in 0..mesh.vertex_count() {
        let expected = if v < first as usize {
            from_source.distances()[v]
        } else {
            to_joint + from_joint.distances()[v]
        };
        assert!((all.distances()[v] - expected).abs() < 1e-12, "{v}");
        let path = all.path_to(SurfacePoint::Vertex(Vertex::new(v))).unwrap();
        assert_eq!(path.source, 0);
        let positions = path.positions(&mesh);
        let jump = if v < first as usize {
            0.0
        } else {
            positions_of(&mesh, here).distance(positions_of(&mesh, there))
        };
        let walked: f64 = positions.windows(2).map(|w| w[0].distance(w[1])).sum();
        assert!((walked - jump - path.length).abs() < 1e-9, "{v}: {walked} {} {}", jump, path.length);
    }
    let missing = ExactOptions { joined: vec![vec![here, Vertex(1_000_000)]], ..ExactOptions::default() };
    assert!(exact_distances(&intrinsic, &[SurfacePoint::Vertex(source)], &missing, &NoProgress).is_err());
}

fn positions_of(mesh: &ManifoldMesh, vertex: Vertex) -> DVec3 {
    mesh.positions()[vertex.index()]
}
