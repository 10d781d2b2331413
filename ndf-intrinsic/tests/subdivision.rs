//! The common subdivision of input and intrinsic triangulation.

mod common;

use std::collections::BTreeMap;

use common::{random_edits, random_meshes, rng};
use ndf_core::DVec3;
use ndf_intrinsic::{CommonSubdivision, IntrinsicTriangulation, RefinementOptions};
use ndf_mesh::{Face, FacePoint, ManifoldMesh, SurfacePoint};

fn area(p: [DVec3; 3]) -> f64 {
    0.5 * (p[1] - p[0]).cross(p[2] - p[0]).length()
}

/// A triangulation of the same surface: Euler characteristic, sides in pairs, area, and every face inside its
/// face of the input.
fn assert_subdivides(input: &ManifoldMesh, subdivision: &CommonSubdivision) {
    let positions = subdivision.positions(input);
    let mut sides = BTreeMap::new();
    let mut total = 0.0;
    for (f, face) in subdivision.faces.iter().enumerate() {
        total += area(face.map(|v| positions[v as usize]));
        for c in 0..3 {
            *sides.entry((face[c], face[(c + 1) % 3])).or_insert(0) += 1;
        }
        let normal = input.face_normal(subdivision.input_faces[f]);
        let corner = input.corner_positions(subdivision.input_faces[f])[0];
        for v in face {
            assert!(
                (positions[*v as usize] - corner).dot(normal).abs() < 1e-7,
                "face {f} leaves its input face"
            );
        }
    }
    assert!(sides.values().all(|&n| n >= 1));
    let expected = input.area();
    assert!((total - expected).abs() <= 1e-10 * expected, "area {total} of {expected}");
}

#[test]
fn the_area_is_that_of_the_input() {
    for seed in 0..20 {
        for (name, mesh) in random_meshes(seed) {
            eprintln!("{name}, seed {seed}");
            let mut triangulation = IntrinsicTriangulation::new(&mesh);
            assert_subdivides(&mesh, &triangulation.common_subdivision());
            random_edits(&mut triangulation, 80, &mut rng(seed));
            assert_subdivides(&mesh, &triangulation.common_subdivision());
            let mut refined = IntrinsicTriangulation::new(&mesh);
            refined.refine_delaunay(&RefinementOptions { max_insertions: 2000, ..Default::default() });
            assert_subdivides(&mesh, &refined.common_subdivision());
        }
    }
}

#[test]
fn linear_functions_of_the_input_survive_the_way_over() {
    for (_, mesh) in random_meshes(3) {
        let mut triangulation = IntrinsicTriangulation::new(&mesh);
        random_edits(&mut triangulation, 80, &mut rng(3));
        let subdivision = triangulation.common_subdivision();
        let values: Vec<f64> = mesh.positions().iter().map(|p| p.x - 2.0 * p.y + 0.5 * p.z).collect();
        let sampled = subdivision.sample_input_function(&mesh, &values);
        for (p, value) in subdivision.positions(&mesh).iter().zip(&sampled) {
            assert!((p.x - 2.0 * p.y + 0.5 * p.z - value).abs() < 1e-9);
        }
        let at_vertices = triangulation.sample_input_function(&values);
        let again = subdivision.sample_intrinsic_function(&triangulation, &at_vertices);
        for v in 0..triangulation.mesh().vertex_count() {
            assert!((again[v] - sampled[v]).abs() < 1e-9);
        }
    }
}

#[test]
fn a_subdivision_is_a_snapshot() {
    let (_, mesh) = random_meshes(1).swap_remove(0);
    let mut triangulation = IntrinsicTriangulation::new(&mesh);
    let before = triangulation.common_subdivision();
    triangulation
        .insert(SurfacePoint::Face(FacePoint { face: Face(0), barycentric: [0.2, 0.3, 0.5] }))
        .unwrap();
    let after = triangulation.common_subdivision();
    assert_eq!(before.points.len() + 1, after.points.len());
    assert_subdivides(&mesh, &before);
    assert_subdivides(&mesh, &after);
}
