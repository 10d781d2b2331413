//! Points carried from one triangulation to the other by two independent ways: regions among the curves and
//! their normal coordinates one way, straight walks by angles (as signposts do) the other.

mod common;

use common::{random_edits, random_meshes, random_point, rng};
use ndf_intrinsic::{IntrinsicTriangulation, RefinementOptions};
use ndf_mesh::{Face, FacePoint, SurfacePoint};
use rand::RngExt;

#[test]
fn walks_by_angle_and_integers_agree() {
    for seed in 0..20 {
        for (name, mesh) in random_meshes(seed) {
            let mut rng = rng(seed);
            let mut triangulation = IntrinsicTriangulation::new(&mesh);
            random_edits(&mut triangulation, 100, &mut rng);
            let size = mesh.bounds().diagonal();
            for _ in 0..50 {
                let face = Face(rng.random_range(0..mesh.face_count() as u32));
                let w: [f64; 3] = [0, 1, 2].map(|_| rng.random_range(0.05..1.0));
                let point =
                    SurfacePoint::Face(FacePoint { face, barycentric: w.map(|x| x / w.iter().sum::<f64>()) });
                let there = triangulation.to_intrinsic(point);
                let back = triangulation.to_input(there);
                let error = back.position(&mesh).distance(point.position(&mesh));
                assert!(error < 1e-8 * size, "{name}, seed {seed}: {point:?} -> {there:?} -> {back:?}");
            }
            for _ in 0..50 {
                let point = random_point(&triangulation, &mut rng);
                let here = triangulation.to_input(point);
                let again = triangulation.to_input(triangulation.to_intrinsic(here));
                let error = again.position(&mesh).distance(here.position(&mesh));
                assert!(error < 1e-8 * size, "{name}, seed {seed}: {point:?} -> {here:?} -> {again:?}");
            }
        }
    }
}

#[test]
fn inserted_vertices_are_where_walks_find_them() {
    for (name, mesh) in random_meshes(5) {
        let mut triangulation = IntrinsicTriangulation::new(&mesh);
        triangulation.refine_delaunay(&RefinementOptions { max_insertions: 200, ..Default::default() });
        let size = mesh.bounds().diagonal();
        for v in triangulation.mesh().vertices().skip(mesh.vertex_count()) {
            let location = triangulation.location(v);
            let SurfacePoint::Face(FacePoint { face, barycentric }) = triangulation.to_intrinsic(location)
            else {
                continue;
            };
            // The walk ends in a face at the vertex, all but at its corner.
            let corners = triangulation.mesh().face_vertices(face);
            let near = (0..3).find(|&c| barycentric[c] > 1.0 - 1e-5).map(|c| corners[c]);
            let found = triangulation.to_input(SurfacePoint::Face(FacePoint { face, barycentric }));
            let error = found.position(&mesh).distance(location.position(&mesh));
            assert!(near == Some(v) || error < 1e-8 * size, "{name}: vertex {v} at {near:?}, off by {error}");
        }
    }
}
