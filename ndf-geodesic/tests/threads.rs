//! Rounds of the wavefront run on all threads, and their results do not depend on how many there are.

use ndf_core::NoProgress;
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Edge, Face, FacePoint, ManifoldMesh, SurfacePoint, TriangleMesh, Vertex, shapes};

/// Distances, paths and figures, bit by bit.
fn outcome(mesh: &IntrinsicMesh, sources: &[SurfacePoint], options: &ExactOptions, threads: usize) -> String {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| {
        let geodesics = exact_distances(mesh, sources, options, &NoProgress).expect("distances");
        let bits: Vec<u64> = geodesics.distances().iter().map(|d| d.to_bits()).collect();
        let paths = if options.keep_windows {
            [17, 1000].map(|v| format!("{:?}", geodesics.path_to(SurfacePoint::Vertex(Vertex(v))))).join(" ")
        } else {
            String::new()
        };
        let report = geodesics.report();
        format!("{bits:?} {paths} {} {} {}", report.windows, report.tasks, report.peak_windows)
    })
}

fn check(mesh: TriangleMesh, sources: &[SurfacePoint]) {
    let mesh = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh).expect("a manifold"));
    let near = ExactOptions { radius: 0.7, ..ExactOptions::default() };
    let targets = vec![SurfacePoint::Vertex(Vertex(1)), SurfacePoint::Vertex(Vertex(1500))];
    let few = ExactOptions { targets, ..ExactOptions::default() };
    for options in [ExactOptions::default(), ExactOptions::with_windows(), near, few] {
        let [one, two, three] = [1, 2, 3].map(|threads| outcome(&mesh, sources, &options, threads));
        assert_eq!(one, two, "{options:?}");
        assert_eq!(one, three, "{options:?}");
    }
}

#[test]
fn distances_of_all_threads_are_those_of_one() {
    let middle = SurfacePoint::Face(FacePoint { face: Face(5), barycentric: [0.2, 0.3, 0.5] });
    let edge = SurfacePoint::Edge { edge: Edge(77), t: 0.25 };
    // Fronts of hundreds of faces; many vertices that bend paths; many ties.
    check(shapes::icosphere(5), &[middle]);
    check(shapes::rope_knot(200, 30, 0.1), &[SurfacePoint::Vertex(Vertex(0)), edge]);
    check(shapes::grid(60, 60), &[SurfacePoint::Vertex(Vertex(61))]);
}
