//! Exact distances from a vertex of a mesh file beside those of the heat method: `distances INPUT VERTEX`.

use ndf_core::NoProgress;
use ndf_geodesic::{ExactOptions, HeatSolver, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::io::read_mesh;
use ndf_mesh::{ManifoldMesh, SurfacePoint};

#[expect(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, vertex] = &arguments[..] else { return Err("usage: distances INPUT VERTEX".into()) };
    let mesh = IntrinsicMesh::of_mesh(&ManifoldMesh::try_from(read_mesh(input)?.mesh)?);
    let source = [SurfacePoint::Vertex(vertex.parse()?)];
    let exact = exact_distances(&mesh, &source, &ExactOptions::default(), &NoProgress)?;
    let heat = HeatSolver::new(&mesh)?.distances(&source)?;
    for (v, (exact, heat)) in exact.distances().iter().zip(heat).enumerate() {
        println!("{v} {exact} {heat}");
    }
    Ok(())
}
