//! Round trips of surfaces of all kinds, and streams that are none.

use super::super::range_coder::{Decoder, Encoder};
use super::*;
use ndf_core::DVec3;
use ndf_mesh::shapes;
use ndf_mesh::{Halfedge, TriangleMesh, Vertex};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// The mesh's faces in the order and with the vertices of what was read.
fn round_trip(mesh: &ManifoldMesh) -> (usize, BaseOrder, Vec<[u32; 3]>) {
    let mut encoder = Encoder::new();
    let order = encode(&mut encoder, mesh).unwrap();
    let bytes = encoder.finish();
    let mut decoder = Decoder::new(&bytes);
    let (faces, vertices) = decode(&mut decoder, mesh.face_count()).unwrap();
    assert_eq!(vertices, mesh.vertex_count());
    for (face, &first) in faces.iter().zip(&order.faces) {
        let first = Halfedge(first);
        let corners = [first, first.next(), first.previous()].map(|h| mesh.topology().tail(h));
        assert_eq!(face.map(|v| Vertex(order.vertices[v as usize])), corners);
    }
    (bytes.len(), order, faces)
}

fn check(mesh: TriangleMesh, what: &str) -> f64 {
    let mesh = ManifoldMesh::try_from(mesh).unwrap();
    let (bytes, order, faces) = round_trip(&mesh);
    let mut seen = order.vertices.clone();
    seen.sort_unstable();
    assert!(seen.iter().copied().eq(0..mesh.vertex_count() as u32), "{what}");
    // Reading gives the order that is written again.
    let positions = order.vertices.iter().map(|&v| mesh.positions()[v as usize]).collect();
    let read = ManifoldMesh::try_from(TriangleMesh::new(positions, faces.clone()).unwrap()).unwrap();
    let (_, again, faces_again) = round_trip(&read);
    assert!(again.vertices.iter().copied().eq(0..mesh.vertex_count() as u32), "{what}");
    assert!(again.faces.iter().copied().eq((0..mesh.face_count() as u32).map(|f| 3 * f)), "{what}");
    assert_eq!(faces_again, faces, "{what}");
    8.0 * bytes as f64 / mesh.vertex_count() as f64
}

/// What is left of a mesh without some of its faces, where that is a manifold.
fn without(mesh: &TriangleMesh, share: f64, rng: &mut ChaCha8Rng) -> Option<TriangleMesh> {
    let faces: Vec<[u32; 3]> = mesh.faces().iter().copied().filter(|_| !rng.random_bool(share)).collect();
    let mut used: Vec<u32> = faces.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let index = |v: u32| used.binary_search(&v).unwrap() as u32;
    let positions = used.iter().map(|&v| mesh.positions()[v as usize]).collect();
    let faces: Vec<[u32; 3]> = faces.into_iter().map(|f| f.map(index)).collect();
    let left = TriangleMesh::new(positions, faces).unwrap();
    ManifoldMesh::try_from(left.clone()).is_ok().then_some(left)
}

fn shifted(mesh: &TriangleMesh, faces: &mut Vec<[u32; 3]>, positions: &mut Vec<DVec3>) {
    let offset = positions.len() as u32;
    positions.extend(mesh.positions());
    faces.extend(mesh.faces().iter().map(|f| f.map(|v| v + offset)));
}

#[test]
fn closed_bounded_and_many_handled_surfaces_come_back() {
    let one = TriangleMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]);
    check(one.unwrap(), "one face");
    for level in 0..4 {
        check(shapes::icosphere(level), "sphere");
    }
    check(shapes::torus(7, 5, 1.0, 0.3), "torus");
    check(shapes::torus(60, 30, 1.0, 0.3), "torus");
    check(shapes::trefoil_knot(200, 12, 0.1), "knot");
    check(shapes::grid(1, 1), "grid");
    check(shapes::grid(20, 13), "grid");
    check(shapes::cube(5), "cube");
    let (mut faces, mut positions) = (Vec::new(), Vec::new());
    for mesh in [shapes::icosphere(1), shapes::grid(3, 4), shapes::torus(5, 4, 1.0, 0.2)] {
        shifted(&mesh, &mut faces, &mut positions);
    }
    check(TriangleMesh::new(positions, faces).unwrap(), "three components");
}

/// Fronts that meet themselves and one another around holes of all kinds.
#[test]
fn surfaces_with_random_holes_come_back() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let wholes = [shapes::icosphere(2), shapes::torus(16, 9, 1.0, 0.3), shapes::grid(12, 12)];
    let mut tried = 0;
    while tried < 300 {
        let whole = &wholes[rng.random_range(0..wholes.len())];
        let share = rng.random_range(0.001..0.12);
        if let Some(mesh) = without(whole, share, &mut rng) {
            check(mesh, "holes");
            tried += 1;
        }
    }
}

/// Vertices and faces in random order, corners turned: the size is the same within the first face's freedom.
#[test]
fn a_regular_mesh_costs_less_than_two_bits_a_vertex() {
    let (torus, sphere) =
        (check(shapes::torus(80, 40, 1.0, 0.3), "torus"), check(shapes::icosphere(4), "sphere"));
    assert!(torus < 1.0 && sphere < 1.0, "{torus} {sphere}");
}

#[test]
fn random_bytes_give_faces_or_an_error() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut encoder = Encoder::new();
    let mesh = ManifoldMesh::try_from(shapes::torus(30, 20, 1.0, 0.3)).unwrap();
    encode(&mut encoder, &mesh).unwrap();
    let good = encoder.finish();
    for round in 0..2000 {
        let mut bytes = good.clone();
        if round % 2 == 0 {
            bytes.iter_mut().for_each(|b| *b = rng.random());
        } else {
            let at = rng.random_range(0..bytes.len());
            bytes[at] = rng.random();
        }
        let faces = rng.random_range(0..3000);
        if let Ok((faces, vertices)) = decode(&mut Decoder::new(&bytes), faces) {
            assert!(faces.iter().flatten().all(|&v| (v as usize) < vertices));
        }
    }
    assert!(decode(&mut Decoder::new(&[]), usize::MAX).is_err());
}
