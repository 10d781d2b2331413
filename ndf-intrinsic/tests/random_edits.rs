//! Random flips, insertions and removals on hundreds of random meshes.

mod common;

use common::{assert_lengths_agree, assert_sound, random_edits, random_meshes, rng};
use ndf_intrinsic::IntrinsicTriangulation;
use ndf_mesh::Edge;
use rand::RngExt;

#[test]
fn integers_lengths_and_input_stay_together() {
    for seed in 0..40 {
        for (name, mesh) in random_meshes(seed) {
            let mut rng = rng(seed);
            let mut triangulation = IntrinsicTriangulation::new(&mesh);
            assert_sound(&triangulation);
            for round in 0..4 {
                random_edits(&mut triangulation, 60, &mut rng);
                eprintln!("{name}, seed {seed}, round {round}");
                assert_sound(&triangulation);
                assert_lengths_agree(&triangulation, 1e-9);
            }
        }
    }
}

#[test]
fn a_flip_undone_is_the_identity() {
    for (_, mesh) in random_meshes(7) {
        let mut rng = rng(3);
        let mut triangulation = IntrinsicTriangulation::new(&mesh);
        random_edits(&mut triangulation, 100, &mut rng);
        for _ in 0..200 {
            let e = Edge(rng.random_range(0..triangulation.mesh().edge_count() as u32));
            let ends = triangulation.mesh().edge_vertices(e);
            let (length, normal) =
                (triangulation.mesh().length(e), triangulation.coordinates().normal_coordinate(e));
            let h = triangulation.mesh().edge_halfedge(e);
            let roundabout = triangulation.coordinates().roundabout(h);
            if triangulation.flip(e).is_err() {
                continue;
            }
            // Three more quarter turns bring the edge back, head to head.
            for _ in 0..3 {
                triangulation.flip(e).unwrap();
            }
            assert_eq!(triangulation.mesh().edge_vertices(e), ends);
            assert!((triangulation.mesh().length(e) - length).abs() < 1e-12 * (1.0 + length));
            assert_eq!(triangulation.coordinates().normal_coordinate(e), normal);
            let h = triangulation.mesh().edge_halfedge(e);
            assert_eq!(triangulation.coordinates().roundabout(h), roundabout);
        }
    }
}
