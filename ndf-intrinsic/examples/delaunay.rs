//! Flips a mesh file to its intrinsic Delaunay triangulation and refines it: `delaunay INPUT`.

use ndf_intrinsic::{IntrinsicTriangulation, RefinementOptions};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::io::read_mesh;

#[expect(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input] = &arguments[..] else { return Err("usage: delaunay INPUT".into()) };
    let mesh = ManifoldMesh::try_from(read_mesh(input)?.mesh)?;
    let mut triangulation = IntrinsicTriangulation::new(&mesh);
    println!("{:?}", triangulation.flip_to_delaunay());
    println!("{:#?}", triangulation.refine_delaunay(&RefinementOptions::default()));
    Ok(())
}
