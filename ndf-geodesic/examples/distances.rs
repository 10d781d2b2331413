//! Exact distances and a shortest path on a mesh: `cargo run --release -p ndf-geodesic --example distances -- MESH`.
//! Without a mesh on a torus.

use std::error::Error;

use ndf_core::NoProgress;
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Face, FacePoint, ManifoldMesh, SurfacePoint, Vertex, io, shapes};

#[allow(clippy::print_stdout, reason = "what an example shows")]
fn main() -> Result<(), Box<dyn Error>> {
    let mesh = match std::env::args().nth(1) {
        Some(path) => io::read_mesh(path)?.mesh,
        None => shapes::torus(120, 50, 1.0, 0.4),
    };
    let mesh = ManifoldMesh::try_from(mesh)?;
    let intrinsic = IntrinsicMesh::from_mesh(&mesh);

    // From two sources: a vertex, and the middle of the first face. Paths need the windows.
    let sources = [
        SurfacePoint::Vertex(Vertex(0)),
        SurfacePoint::Face(FacePoint { face: Face(0), barycentric: [1.0 / 3.0; 3] }),
    ];
    let geodesics = exact_distances(&intrinsic, &sources, &ExactOptions::with_windows(), &NoProgress)?;
    let reached = geodesics.distances().iter().enumerate().filter(|(_, d)| d.is_finite());
    let Some((farthest, distance)) = reached.max_by(|a, b| a.1.total_cmp(b.1)) else { return Ok(()) };
    println!("vertex {farthest} is farthest: {distance}");

    let path = geodesics.path_to(SurfacePoint::Vertex(Vertex(farthest as u32)))?;
    println!("its path to source {} crosses {} edges", path.source, path.points.len().saturating_sub(2));
    for position in path.positions(&mesh) {
        println!("{:.4} {:.4} {:.4}", position.x, position.y, position.z);
    }
    Ok(())
}
