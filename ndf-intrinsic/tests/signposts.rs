//! Integer coordinates beside an independent structure, [signposts](common::signposts): lengths, and the input edges
//! that every edge crosses.

mod common;

use common::signposts::Signposts;
use common::{random_meshes, rng};
use ndf_intrinsic::IntrinsicTriangulation;
use ndf_mesh::{Edge, Halfedge, ManifoldMesh};
use rand::RngExt;

/// Whether the two say the same of every edge. Returns the number of crossings.
fn assert_agreement(
    name: &str,
    input: &ManifoldMesh,
    triangulation: &IntrinsicTriangulation<'_>,
    signposts: &Signposts<'_>,
) -> usize {
    let mesh = triangulation.mesh();
    let size = input.bounds().diagonal();
    let mut crossings = 0;
    for e in mesh.edges() {
        let h = mesh.edge_halfedge(e);
        assert_eq!(signposts.tail(h), mesh.tail(h));
        let error = (signposts.length(h) - mesh.length(e)).abs();
        assert!(error < 1e-8 * size, "{name}: edge {e} is {} or {}", signposts.length(h), mesh.length(e));
        let (mut crossed, end) = signposts.trace(h);
        // A straight line does not cross an edge of the vertex where it ends; walks do by rounding, all but there.
        let tip = mesh.tip(h);
        while crossed
            .last()
            .is_some_and(|&c| [input.topology().tail(c), input.topology().tip(c)].contains(&tip))
        {
            crossed.pop();
        }
        let trace: Vec<Halfedge> = triangulation.trace_edge(e).iter().map(|c| c.input_halfedge).collect();
        assert_eq!(trace, crossed, "{name}: edge {e}");
        let off = end.distance(input.positions()[tip.index()]);
        assert!(off < 1e-6 * size, "{name}: edge {e} ends {off} beside its tip");
        crossings += trace.len();
    }
    crossings
}

#[test]
fn signposts_and_integers_agree_after_random_flips() {
    let mut crossings = 0;
    for seed in 0..40 {
        for (name, mesh) in random_meshes(seed) {
            let mut rng = rng(seed);
            let mut triangulation = IntrinsicTriangulation::new(&mesh);
            let mut signposts = Signposts::new(&mesh);
            for _ in 0..3 {
                for _ in 0..40 {
                    let e = Edge(rng.random_range(0..triangulation.mesh().edge_count() as u32));
                    let h = triangulation.mesh().edge_halfedge(e);
                    if triangulation.flip(e).is_ok() {
                        signposts.flip(h);
                    }
                }
                crossings += assert_agreement(name, &mesh, &triangulation, &signposts);
            }
        }
    }
    assert!(crossings > 10_000, "{crossings} crossings");
}
