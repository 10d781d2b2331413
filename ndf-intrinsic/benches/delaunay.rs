//! Times of flips to Delaunay and of refinement to 25° on meshes given by path: `cargo bench -p ndf-intrinsic -- spot.obj …`.

use std::time::Instant;

use ndf_core::ManifoldMesh;
use ndf_core::io::read_mesh;
use ndf_intrinsic::{IntrinsicTriangulation, RefinementOptions};

fn main() {
    for path in std::env::args().skip(1).filter(|a| !a.starts_with("--")) {
        let mesh = match read_mesh(&path).map(|file| ManifoldMesh::try_from(file.mesh)) {
            Ok(Ok(mesh)) => mesh,
            Ok(Err(error)) => {
                eprintln!("{path}: {error}");
                continue;
            }
            Err(error) => {
                eprintln!("{error}");
                continue;
            }
        };
        let mut best = [f64::INFINITY; 3];
        let mut report = None;
        for _ in 0..3 {
            let start = Instant::now();
            let mut triangulation = IntrinsicTriangulation::new(&mesh);
            best[0] = best[0].min(start.elapsed().as_secs_f64());
            let start = Instant::now();
            let flips = triangulation.flip_to_delaunay();
            best[1] = best[1].min(start.elapsed().as_secs_f64());
            let delaunay = triangulation.mesh().is_delaunay();
            let mut triangulation = IntrinsicTriangulation::new(&mesh);
            let start = Instant::now();
            let refinement = triangulation.refine_delaunay(&RefinementOptions::default());
            best[2] = best[2].min(start.elapsed().as_secs_f64());
            report = Some((flips, delaunay, refinement, triangulation.mesh().is_delaunay()));
        }
        let Some((flips, delaunay, refined, still)) = report else { continue };
        eprintln!(
            "{path}: {} faces, construction {:.4} s, {} flips {:.4} s (Delaunay {delaunay}), refinement {:.4} s \
             (Delaunay {still}) {refined:?}",
            mesh.face_count(),
            best[0],
            flips.flips,
            best[1],
            best[2],
        );
    }
}
