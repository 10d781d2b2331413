//! Times of flips to Delaunay on meshes given by path: `cargo bench -p ndf-intrinsic -- spot.obj …`.

use std::time::Instant;

use ndf_core::ManifoldMesh;
use ndf_core::io::read_mesh;
use ndf_intrinsic::IntrinsicTriangulation;

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
        let mut best = [f64::INFINITY; 2];
        let mut report = None;
        for _ in 0..3 {
            let start = Instant::now();
            let mut triangulation = IntrinsicTriangulation::new(&mesh);
            best[0] = best[0].min(start.elapsed().as_secs_f64());
            let start = Instant::now();
            let flips = triangulation.flip_to_delaunay();
            best[1] = best[1].min(start.elapsed().as_secs_f64());
            report = Some((flips, triangulation.mesh().delaunay_fraction()));
        }
        eprintln!(
            "{path}: {} faces, construction {:.4} s, flips {:.4} s, {report:?}",
            mesh.face_count(),
            best[0],
            best[1]
        );
    }
}
