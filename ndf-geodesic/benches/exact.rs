//! Exact distances from one source on one thread and on two, in turns.
//!
//! `cargo bench -p ndf-geodesic --bench exact`

#![allow(clippy::print_stdout)]

use std::time::Instant;

use ndf_core::NoProgress;
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleMesh, Vertex, shapes};

/// Turns; the least time of each counts.
const TURNS: usize = 7;

fn main() {
    println!("| mesh | faces | windows | one thread, s | two threads, s | ratio |");
    println!("|---|--:|--:|--:|--:|--:|");
    measure("sphere", shapes::icosphere(7));
    measure("torus", shapes::torus(600, 300, 1.0, 0.4));
    measure("rope-1000x50", shapes::rope_knot(1000, 50, 0.1));
    measure("rope-5000x50", shapes::rope_knot(5000, 50, 0.1));
}

fn measure(name: &str, mesh: TriangleMesh) {
    let mesh = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh).expect("a manifold"));
    let pools =
        [1, 2].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads"));
    let mut least = [f64::INFINITY; 2];
    let mut windows = 0;
    for _ in 0..TURNS {
        for (pool, least) in pools.iter().zip(&mut least) {
            pool.install(|| {
                let start = Instant::now();
                let source = [SurfacePoint::Vertex(Vertex(0))];
                let geodesics = exact_distances(&mesh, &source, &ExactOptions::default(), &NoProgress)
                    .expect("distances");
                *least = least.min(start.elapsed().as_secs_f64());
                windows = geodesics.report().windows;
            });
        }
    }
    let [one, two] = least;
    println!("| {name} | {} | {windows} | {one:.4} | {two:.4} | {:.2} |", mesh.face_count(), one / two);
}
