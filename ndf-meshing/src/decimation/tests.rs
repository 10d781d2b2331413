use ndf_core::{Hint, NoProgress};
use ndf_mesh::metrics::{MeasureOptions, measure};
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::triangle_tree::TriangleTree;
use ndf_mesh::{TriangleMesh, ValidationReport};
use ndf_mesh::{repair, shapes};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::*;

fn manifold(mesh: TriangleMesh) -> ManifoldMesh {
    ManifoldMesh::try_from(mesh).unwrap()
}

fn decimated(mesh: &ManifoldMesh, faces: usize) -> Decimated {
    decimate(mesh, &DecimationOptions::to_faces(faces), &NoProgress)
}

/// Root-mean-square and largest distance of samples of `from` to `to`.
fn distances(from: &ManifoldMesh, to: &ManifoldMesh) -> (f64, f64) {
    let tree = TriangleTree::new(to);
    let samples = AreaSampler::new(from).unwrap().sample(5_000, 1, 0);
    let square = |p| tree.closest_point(p, Hint::NONE).unwrap().distance_squared;
    let squares: Vec<f64> = samples.iter().map(|s| square(s.position(from))).collect();
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    (mean.sqrt(), squares.iter().copied().fold(0.0, f64::max).sqrt())
}

fn check_same_topology(before: &ManifoldMesh, after: &ManifoldMesh) {
    let [a, b] = [before, after].map(|m| ValidationReport::of(m));
    assert!(b.is_oriented_manifold(), "{b}");
    assert_eq!(a.euler_characteristic, b.euler_characteristic);
    assert_eq!(a.components, b.components);
    assert_eq!(a.boundary_loops, b.boundary_loops);
    assert!(b.degenerate_faces.count <= a.degenerate_faces.count, "{b:?}");
}

/// Every face has been a face of its own, in order, and its corners were merged into those it has.
#[test]
fn faces_know_their_births() {
    let mesh = manifold(shapes::icosphere(4));
    for faces in [5000, 500] {
        let Decimated { mesh: coarse, births, .. } = decimated(&mesh, faces);
        assert_eq!(births.len(), coarse.face_count());
        assert!(births.is_sorted_by(|a, b| a < b) && births.iter().all(|f| f.index() < mesh.face_count()));
        let center = |mesh: &TriangleMesh, f| mesh.corner_positions(f).iter().sum::<DVec3>() / 3.0;
        let moved =
            coarse.face_indices().zip(&births).map(|(f, &b)| center(&coarse, f).distance(center(&mesh, b)));
        assert!(moved.fold(0.0, f64::max) < 1.0);
    }
}

#[test]
fn topology_boundary_and_orientation_are_kept() {
    for (shape, faces) in [
        (shapes::icosphere(4), 300),
        (shapes::torus(80, 40, 1.0, 0.4), 400),
        (shapes::trefoil_knot(400, 24, 0.2), 1200),
        (shapes::grid(30, 20), 60),
    ] {
        let fine = manifold(shape);
        let coarse = decimated(&fine, faces);
        assert!(coarse.reached);
        assert!((faces - 1..=faces).contains(&coarse.mesh.face_count()));
        check_same_topology(&fine, &coarse.mesh);
        if fine.topology().boundary_edge_count() == 0 {
            let ratio = coarse.mesh.signed_volume() / fine.signed_volume();
            assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
        }
    }
}

#[test]
fn distance_falls_as_faces_are_added() {
    let fine = manifold(shapes::torus(120, 60, 1.0, 0.4));
    let errors: Vec<f64> =
        [200, 800, 3200].iter().map(|&n| distances(&decimated(&fine, n).mesh, &fine).0).collect();
    assert!(errors[0] > 2.5 * errors[1] && errors[1] > 2.5 * errors[2], "{errors:?}");
}

/// How far one result is from the input is a matter of luck: it differs as vertices are moved a little. Not so in the mean.
#[test]
fn blocks_come_as_close_as_the_whole() {
    let wavy = |p: DVec3| p * (1.0 + 0.05 * (9.0 * p.x).sin() * (11.0 * p.y).sin() * (7.0 * p.z).cos());
    let shapes = [
        shapes::rope_knot(600, 60, 0.24),
        shapes::torus(240, 150, 1.0, 0.4),
        shapes::icosphere(6).map_positions(wavy),
    ];
    let options = DecimationOptions::to_faces(400);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut rms, mut largest, mut rounds) = (0.0, 0.0, 0.0);
    for shape in shapes.iter().cycle().take(12) {
        let amount = 1e-5 * shape.bounds().diagonal();
        let (mut positions, faces) = shape.clone().into_parts();
        positions.iter_mut().for_each(|p| *p += amount * DVec3::from_array(rng.random()));
        let fine = manifold(TriangleMesh::new(positions, faces).unwrap());
        let reduced = blocks::reduced_by(1 << 13, 1 << 14, &fine, &options, &NoProgress).unwrap();
        let by_blocks = decimated_further(reduced, fine.bounds().center(), &options, &NoProgress);
        let [by_blocks, whole] = [by_blocks, decimated(&fine, options.faces)].map(|found| {
            assert!(found.reached);
            measure(&fine, &found.mesh, &MeasureOptions { samples: 20_000, seed: 0 }).unwrap()
        });
        let ratio = by_blocks.hausdorff / whole.hausdorff;
        assert!(ratio < 2.0, "{ratio}");
        rms += (by_blocks.reference_to_mesh.rms / whole.reference_to_mesh.rms).ln();
        largest += ratio.ln();
        rounds += 1.0;
    }
    let (rms, largest) = (f64::exp(rms / rounds), f64::exp(largest / rounds));
    assert!(rms < 1.05 && largest < 1.15, "{rms} {largest}");
}

#[test]
fn flat_regions_cost_nothing() {
    let cube = manifold(shapes::cube(20));
    let coarse = decimated(&cube, 12);
    assert!(coarse.reached, "{} faces", coarse.mesh.face_count());
    assert!(distances(&cube, &coarse.mesh).1 < 1e-7);
    assert!((coarse.mesh.area() - 24.0).abs() < 1e-6);
    let grid = manifold(shapes::grid(25, 25));
    let coarse = decimated(&grid, 2);
    assert!(coarse.mesh.face_count() <= 8, "{}", coarse.mesh.face_count());
    assert!((coarse.mesh.area() - 1.0).abs() < 1e-7);
}

#[test]
fn an_unreachable_target_ends_early_and_says_so() {
    let torus = manifold(shapes::torus(30, 20, 1.0, 0.4));
    let coarse = decimated(&torus, 2);
    assert!(!coarse.reached && coarse.mesh.face_count() >= 14);
    check_same_topology(&torus, &coarse.mesh);
}

#[test]
fn components_and_tiny_meshes_survive() {
    // Two tetrahedra and a lone triangle beside a sphere.
    let (mut positions, mut faces) = shapes::icosphere(2).into_parts();
    for shift in [3.0, 5.0] {
        let at = positions.len() as u32;
        positions.extend([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|p| p + DVec3::X * shift));
        faces.extend([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(|f| f.map(|v: u32| v + at)));
    }
    let at = positions.len() as u32;
    positions.extend([DVec3::Z * 4.0, DVec3::Z * 4.0 + DVec3::X, DVec3::Z * 4.0 + DVec3::Y]);
    faces.push([at, at + 1, at + 2]);
    let mesh = manifold(TriangleMesh::new(positions, faces).unwrap());
    let coarse = decimated(&mesh, 1);
    assert!(!coarse.reached);
    check_same_topology(&mesh, &coarse.mesh);
    let all = decimated(&mesh, 10_000);
    assert!(all.reached && all.collapses == 0);
    assert_eq!(all.mesh.faces(), mesh.faces());
}

#[test]
fn holes_stay_open() {
    // A sphere with holes of one face and of one ring.
    let (positions, mut faces) = shapes::icosphere(4).into_parts();
    let removed = faces[100];
    faces.retain(|f| *f != removed && !f.contains(&0));
    let mesh = repair::without_unreferenced_vertices(&TriangleMesh::new(positions, faces).unwrap()).0;
    let mesh = manifold(mesh);
    let coarse = decimated(&mesh, 200);
    assert!(coarse.reached);
    check_same_topology(&mesh, &coarse.mesh);
}

#[test]
fn the_same_again() {
    let fine = manifold(shapes::torus(60, 30, 1.0, 0.4));
    let [a, b] = [0, 1].map(|_| decimated(&fine, 300).mesh.into_triangle_mesh());
    assert_eq!(a, b);
}

#[test]
fn scanned_meshes_keep_topology_and_stay_close() {
    for (name, largest) in [
        ("armadillo_86k.obj", 7.5e-4),
        ("skull_100k.obj", 4.5e-4),
        ("rocker-arm.obj", 2.7e-4),
        ("rind_wide_g7.ply", 1.6e-4),
    ] {
        let Some(path) = ndf_testing::data_path(&format!("mesh/{name}")) else { continue };
        let read = ndf_mesh::io::read_mesh(&path).unwrap().mesh;
        let fine = manifold(repair::without_unreferenced_vertices(&read).0);
        let coarse = decimated(&fine, 4000);
        assert!(coarse.reached, "{name}");
        check_same_topology(&fine, &coarse.mesh);
        let size = fine.bounds().diagonal();
        let (to, from) = (distances(&coarse.mesh, &fine).0, distances(&fine, &coarse.mesh).0);
        assert!(to.max(from) < largest * size, "{name}: {:e} {:e}", to / size, from / size);
    }
}

/// A cylinder with caps: two circles as creases.
fn cylinder(around: usize, along: usize) -> ManifoldMesh {
    let ring = |z: f64| {
        (0..around).map(move |i| {
            let angle = std::f64::consts::TAU * i as f64 / around as f64;
            DVec3::new(angle.cos(), angle.sin(), z)
        })
    };
    let mut points: Vec<DVec3> = (0..=along).flat_map(|j| ring(2.0 * j as f64 / along as f64)).collect();
    points.extend([DVec3::ZERO, DVec3::new(0.0, 0.0, 2.0)]);
    let [bottom, top] = [points.len() - 2, points.len() - 1];
    let at = |i: usize, j: usize| j * around + i % around;
    let mut faces = Vec::new();
    for i in 0..around {
        for j in 0..along {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
        faces.extend([[bottom, at(i + 1, 0), at(i, 0)], [top, at(i, along), at(i + 1, along)]]);
    }
    let faces = faces.into_iter().map(|face| face.map(|v| v as u32)).collect();
    manifold(TriangleMesh::new(points, faces).unwrap())
}

/// A cube is its twelve edges, whatever is left of its faces; circles stay circles.
#[test]
fn creases_are_kept() {
    let cube = manifold(shapes::cube(12));
    let mut options = DecimationOptions { crease_angle: Some(0.5), ..DecimationOptions::to_faces(40) };
    let coarse = decimate(&cube, &options, &NoProgress);
    assert!(coarse.reached && (coarse.mesh.area() - cube.area()).abs() < 1e-9, "{:?}", coarse.collapses);
    check_same_topology(&cube, &coarse.mesh);
    options.faces = 400;
    let (fine, coarse) = (cylinder(200, 100), decimate(&cylinder(200, 100), &options, &NoProgress).mesh);
    check_same_topology(&fine, &coarse);
    let rim = |mesh: &ManifoldMesh| {
        let topology = mesh.topology();
        let sharp = topology.edges().filter(|&e| {
            topology.edge_vertices(e).iter().all(|v| {
                let p = mesh.positions()[v.index()];
                [0.0, 2.0].iter().any(|z| (p.z - z).abs() < 1e-9)
                    && (p.truncate().length() - 1.0).abs() < 0.01
            })
        });
        sharp
            .map(|e| {
                let [p, q] = topology.edge_vertices(e).map(|v| mesh.positions()[v.index()]);
                p.distance(q)
            })
            .sum::<f64>()
    };
    // Two circles.
    assert!((rim(&coarse) / rim(&fine) - 1.0).abs() < 0.01, "{} {}", rim(&coarse), rim(&fine));
}

#[test]
fn boundaries_are_kept_where_they_are() {
    let grid = manifold(shapes::grid(20, 20));
    let options = DecimationOptions { keep_boundary: true, ..DecimationOptions::to_faces(2) };
    let coarse = decimate(&grid, &options, &NoProgress).mesh;
    let border = |mesh: &ManifoldMesh| {
        let topology = mesh.topology();
        let on = |v: &ndf_mesh::Vertex| topology.is_boundary_vertex(*v);
        let mut points: Vec<[u64; 3]> = mesh
            .topology()
            .vertices()
            .filter(on)
            .map(|v| mesh.positions()[v.index()].to_array().map(|x| (x * 1e6).round().to_bits()))
            .collect();
        points.sort_unstable();
        points
    };
    assert_eq!(border(&grid), border(&coarse));
    assert!(coarse.face_count() < 100, "{}", coarse.face_count());
}
