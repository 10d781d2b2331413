//! Exact distances on one thread: `cargo bench -p ndf-geodesic --bench exact -- [MESH …]`.
#![allow(clippy::print_stdout)]
use std::time::Instant;
use ndf_core::{ManifoldMesh, SurfacePoint};
use ndf_geodesic::*;
use ndf_intrinsic::IntrinsicMesh;

fn main() {
    for path in std::env::args().skip(1).filter(|arg| !arg.starts_with('-')) {
        let mesh = ndf_core::io::read_mesh(&path).unwrap().mesh;
        let mesh = ManifoldMesh::try_from(mesh).unwrap();
        let mesh = IntrinsicMesh::of_mesh(&mesh);
        let mut best = f64::INFINITY;
        let mut last = None;
        for _ in 0..3 {
            let t = Instant::now();
            let g = exact_distances(&mesh, &[SurfacePoint::Vertex(0)], &ExactOptions::default()).unwrap();
            best = best.min(t.elapsed().as_secs_f64());
            last = Some(g);
        }
        let g = last.unwrap();
        let max = g.distances().iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
        println!("{path} {} {} {:?} {best:.3}s max {max} unreached {}", mesh.vertex_count(), mesh.face_count(), g.statistics(), g.unreached());
        if let Ok(reference) = std::fs::read_to_string(path.replace(".obj", ".vtp.txt")) {
            let r: Vec<f64> = reference.split_whitespace().map(|x| x.parse().unwrap()).collect();
            let worst = r.iter().zip(g.distances()).map(|(a, b)| (b - a) / max).fold((0.0f64, 0.0f64), |m, e| (m.0.min(e), m.1.max(e)));
            println!("   ours - vtp, relative to max: {worst:?}");
        }
    }
}
