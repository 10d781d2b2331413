use ndf_core::DVec3;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::{FacePoint, ManifoldMesh, ValidationReport, Vertex, shapes};

/// Bodies apart, closed and open.
fn bodies() -> TriangleMesh {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let shapes = [shapes::torus(12, 8, 1.0, 0.3), shapes::icosphere(1), shapes::grid(4, 3)];
    for (k, body) in shapes.into_iter().enumerate() {
        let (p, f) = body.into_parts();
        let first = positions.len() as u32;
        positions.extend(p.into_iter().map(|p| p + 5.0 * k as f64 * DVec3::X));
        faces.extend(f.into_iter().map(|f| f.map(|v| v + first)));
    }
    TriangleMesh::new(positions, faces).unwrap()
}

/// A mesh as files have it: some corners with vertices of their own, some faces turned, vertices that no face uses, in a
/// random order.
fn as_in_a_file(mesh: &TriangleMesh, random: &mut ChaCha8Rng) -> TriangleMesh {
    let (mut positions, mut faces) = mesh.clone().into_parts();
    for face in &mut faces {
        for corner in face.iter_mut() {
            if random.random_bool(0.2) {
                positions.push(positions[*corner as usize]);
                *corner = positions.len() as u32 - 1;
            }
        }
        if random.random_bool(0.3) {
            face.swap(0, 1);
        }
    }
    for _ in 0..20 {
        positions.push(DVec3::new(random.random(), random.random(), 7.0));
    }
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.shuffle(random);
    let mut mixed = vec![DVec3::ZERO; positions.len()];
    positions.iter().zip(&order).for_each(|(&p, &place)| mixed[place as usize] = p);
    faces.iter_mut().for_each(|face| *face = face.map(|v| order[v as usize]));
    TriangleMesh::new(mixed, faces).unwrap()
}

#[test]
fn every_vertex_of_a_file_finds_back() {
    let clean = bodies();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..20 {
        let file = as_in_a_file(&clean, &mut random);
        let found = repaired(&file, &RepairOptions::default()).unwrap();
        let counts = |mesh: &TriangleMesh| (mesh.vertex_count(), mesh.face_count());
        assert_eq!(counts(&found.mesh), counts(&clean));
        assert_eq!(ValidationReport::of(&found.mesh).components, 3);
        let used = |v: &Vertex| file.faces().as_flattened().contains(&v.0);
        let all = || (0..file.vertex_count()).map(Vertex::new);
        assert!(found.origins.unused().eq(all().filter(|v| !used(v))));
        let places = found.origins.values(found.mesh.positions(), DVec3::NAN, |_, _| DVec3::NAN);
        assert!(all().filter(used).all(|v| places[v.index()] == file.positions()[v.index()]));
        for face in found.mesh.face_indices() {
            let point = FacePoint { face, barycentric: [0.5, 0.3, 0.2] };
            let there = found.origins.point(point).position(&file);
            assert!(there.distance(point.position(&found.mesh)) < 1e-15 * 20.0);
        }
    }
}

#[test]
fn seams_stay_cuts_where_they_are_to() {
    let soup = soup(&shapes::icosphere(1));
    let keep_seams = RepairOptions { keep_seams: true, ..RepairOptions::default() };
    assert_eq!(Components::of(&repaired(&soup, &keep_seams).unwrap().mesh).len(), 80);
    assert_eq!(Components::of(&repaired(&soup, &RepairOptions::default()).unwrap().mesh).len(), 1);
}

/// Merging all vertices in one place would make an edge of four faces of the edge in which two soups of boxes touch.
#[test]
fn boxes_that_touch_are_closed_and_stay_apart() {
    let (mut positions, mut faces) = soup(&shapes::cube(2)).into_parts();
    let (more, their) = soup(&shapes::cube(2)).into_parts();
    let first = positions.len() as u32;
    positions.extend(more.into_iter().map(|p| p + DVec3::new(2.0, 2.0, 0.0)));
    faces.extend(their.into_iter().map(|f| f.map(|v| v + first)));
    let found = repaired(&TriangleMesh::new(positions, faces).unwrap(), &RepairOptions::default()).unwrap();
    let report = ValidationReport::of(&found.mesh);
    assert_eq!((report.components, report.boundary_edges, report.euler_characteristic), (2, 0, 4));
}

#[test]
fn what_has_one_side_is_named() {
    let error = repaired(&shapes::moebius_strip(20, 3), &RepairOptions::default()).unwrap_err();
    assert_eq!(error, Irreparable::OneSided);
}

#[test]
fn corners_that_are_not_finite_count_as_left_out() {
    let (mut positions, faces) = shapes::icosphere(2).into_parts();
    positions[0] = DVec3::NAN;
    let found = repaired(&TriangleMesh::new(positions, faces).unwrap(), &RepairOptions::default()).unwrap();
    assert!((found.area_left_out - 5.0 / 320.0).abs() < 1e-12, "{}", found.area_left_out);
    assert_eq!(found.origins.unused().collect::<Vec<_>>(), [Vertex(0)]);
}

#[test]
fn everything_mendable_is_mended() {
    let mesh = shapes::torus(20, 12, 1.0, 0.3);
    let clean = repaired(&mesh, &RepairOptions::default()).unwrap();
    assert!(clean.notes.is_empty() && *clean.mesh == mesh && clean.area_left_out == 0.0);

    let (mut positions, mut faces) = soup(&mesh).into_parts();
    faces.iter_mut().step_by(2).for_each(|f| f.swap(0, 1));
    faces.push([0, 0, 1]);
    positions.push(DVec3::ZERO);
    let last = positions.len() as u32;
    positions.extend([DVec3::X, DVec3::Y, DVec3::Z].map(|p| 1.5 * p));
    faces.push([last, last + 1, last + 2]);
    let result = repaired(&TriangleMesh::new(positions, faces).unwrap(), &RepairOptions::LARGEST).unwrap();
    assert_eq!(result.mesh.topology().euler_characteristic(), 0);
    assert_eq!(result.mesh.topology().boundary_edge_count(), 0);
    assert!(result.mesh.signed_volume() > 0.0);
    assert_eq!(result.notes.len(), 5, "{:?}", result.notes);
}

#[test]
fn three_faces_at_an_edge_are_reported() {
    let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_Y];
    let mesh = TriangleMesh::new(positions, vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]]).unwrap();
    assert!(
        repaired(&mesh, &RepairOptions::default()).unwrap_err().to_string().contains("1 edge with 3 faces")
    );
}

/// Every face with three vertices of its own, as in an STL file.
fn soup(mesh: &TriangleMesh) -> TriangleMesh {
    let positions = mesh.face_indices().flat_map(|f| mesh.corner_positions(f)).collect();
    let faces = (0..mesh.face_count() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    TriangleMesh::from_parts(positions, faces)
}

#[test]
fn welding_a_soup_gives_the_mesh_back() {
    let mesh = shapes::torus(20, 12, 1.0, 0.3);
    let exact = welded(&soup(&mesh), 0.0);
    assert_eq!(exact.vertex_count(), mesh.vertex_count());
    assert!(ManifoldMesh::try_from(exact).is_ok());

    let mut k = 0.0;
    let (positions, faces) = soup(&mesh).into_parts();
    let noisy = positions.into_iter().map(|p| {
        k += 1.0;
        p + 1e-9 * DVec3::new((k * 1.3_f64).sin(), (k * 2.1_f64).cos(), (k * 0.7_f64).sin())
    });
    let noisy = TriangleMesh::new(noisy.collect(), faces).unwrap();
    assert!(
        ManifoldMesh::try_from(welded(&noisy, 0.0)).is_ok_and(|m| m.topology().boundary_edge_count() > 0)
    );
    let near = welded(&noisy, 1e-7);
    assert_eq!(near.vertex_count(), mesh.vertex_count());
    assert!(ManifoldMesh::try_from(near).is_ok());
}

#[test]
fn vertices_that_are_not_finite_stay_apart_in_linear_time() {
    // Were they gathered in one cell, these would be compared with each other: tens of seconds.
    let positions = vec![DVec3::NAN; 200_000];
    let mesh = TriangleMesh::from_parts(positions, Vec::new());
    for tolerance in [0.0, 1e-3] {
        assert_eq!(welded(&mesh, tolerance).vertex_count(), mesh.vertex_count());
    }
}

#[test]
fn unusable_faces_go_and_vertices_follow() {
    let (positions, mut faces) = shapes::cube(1).into_parts();
    let count = faces.len();
    faces.push([0, 0, 1]);
    faces.push([faces[3][1], faces[3][0], faces[3][2]]);
    let mut positions = positions;
    positions.push(DVec3::NAN);
    faces.push([0, 1, 8]);
    let repaired = without_unusable_faces(&TriangleMesh::new(positions, faces).unwrap());
    assert_eq!(repaired.face_count(), count);
    let (repaired, kept) = without_unreferenced_vertices(&repaired);
    assert_eq!(kept, (0..8).collect::<Vec<_>>());
    assert!(ManifoldMesh::try_from(repaired).is_ok());
}

/// Two squares with vertices of their own along the side that they share, and a triangle that meets them in an end of it.
#[test]
fn what_was_joined_and_separated_again_is_one_place() {
    let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let positions = vec![
        p(0.0, 0.0),
        p(1.0, 0.0),
        p(1.0, 1.0),
        p(0.0, 1.0),
        p(1.0, 0.0),
        p(2.0, 0.0),
        p(2.0, 1.0),
        p(1.0, 1.0),
        p(1.0, 0.0),
        p(0.5, -1.0),
        p(1.5, -1.0),
    ];
    let faces = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7], [8, 9, 10]];
    let mesh = TriangleMesh::new(positions, faces).unwrap();
    let found = repaired(&mesh, &RepairOptions::default()).unwrap();
    let groups: Vec<&[Vertex]> = found.origins.separated().collect();
    let [[a, b]] = groups[..] else { panic!("{groups:?}") };
    assert!([*a, *b].iter().all(|v| found.mesh.positions()[v.index()] == p(1.0, 0.0)));
    let apart = RepairOptions { keep_seams: true, ..RepairOptions::default() };
    assert_eq!(repaired(&mesh, &apart).unwrap().origins.separated().count(), 0);
}

#[test]
fn fans_are_separated() {
    // Two tetrahedra that share a vertex.
    let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let positions = vec![
        p(0.0, 0.0, 0.0),
        p(1.0, 0.0, 0.0),
        p(0.0, 1.0, 0.0),
        p(0.0, 0.0, 1.0),
        p(-1.0, 0.0, 0.0),
        p(0.0, -1.0, 0.0),
        p(0.0, 0.0, -1.0),
    ];
    let tetrahedron = |a: u32, b: u32, c: u32, d: u32| [[a, c, b], [a, b, d], [b, c, d], [c, a, d]];
    let faces = [tetrahedron(0, 1, 2, 3), tetrahedron(0, 4, 5, 6)].concat();
    let mesh = TriangleMesh::new(positions, faces).unwrap();
    assert_eq!(ValidationReport::of(&mesh).nonmanifold_vertices.count, 1);
    let split = split_fans(&mesh);
    assert_eq!(split.vertex_count(), 8);
    assert!(ManifoldMesh::try_from(oriented(&split)).is_ok());
    assert_eq!(Components::of(&split).len(), 2);
    let repaired = repaired(&mesh, &RepairOptions::default()).unwrap();
    assert_eq!(repaired.origins.separated().collect::<Vec<_>>(), [&[Vertex(0), Vertex(7)]]);
}
