//! Flips to Delaunay and refinement to 25° on meshes given by path, as a table:
//! `RAYON_NUM_THREADS=1 cargo bench -p ndf-intrinsic --bench delaunay -- MESH…`. The least of five times is given.

use std::time::Instant;

use ndf_intrinsic::{IntrinsicTriangulation, RefinementOptions};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::io::read_mesh;

const RUNS: usize = 5;

#[allow(clippy::print_stdout, reason = "a table is what it makes")]
fn main() {
    println!(
        "| mesh | faces | construction, ms | flips | flips, ms | faces refined | refinement, ms | smallest angle |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|");
    for path in std::env::args().skip(1).filter(|a| !a.starts_with("--")) {
        match measure(&path) {
            Ok(row) => println!("{row}"),
            Err(error) => eprintln!("{error}"),
        }
    }
}

fn milliseconds<T>(best: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *best = best.min(1e3 * start.elapsed().as_secs_f64());
    result
}

/// A row of the table.
fn measure(path: &str) -> Result<String, String> {
    let file = read_mesh(path).map_err(|e| e.to_string())?;
    let mesh = ManifoldMesh::try_from(file.mesh).map_err(|e| format!("{path}: {e}"))?;
    let [mut construction, mut flipping, mut refining] = [f64::INFINITY; 3];
    let mut row = String::new();
    for _ in 0..RUNS {
        let mut flipped = milliseconds(&mut construction, || IntrinsicTriangulation::new(&mesh));
        let flips = milliseconds(&mut flipping, || flipped.flip_to_delaunay());
        let mut refined = IntrinsicTriangulation::new(&mesh);
        let report = milliseconds(&mut refining, || refined.refine_delaunay(&RefinementOptions::default()));
        let delaunay = flipped.mesh().is_delaunay() && refined.mesh().is_delaunay();
        let failed = if delaunay && report.unrefined_faces == 0 { "" } else { "; NOT REACHED" };
        row = format!(
            "| {path} | {} | {construction:.2} | {} | {flipping:.2} | {} | {refining:.2} | {:.2}°{failed} |",
            mesh.face_count(),
            flips.flips,
            refined.mesh().face_count(),
            report.min_angle.to_degrees(),
        );
    }
    Ok(row)
}
