//! The smallest eigenvalues of the Laplacian of a mesh file: `eigenvalues INPUT COUNT`.

use ndf_core::NoProgress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::io::read_mesh;
use ndf_spectral::{ModeOptions, modes};

#[expect(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, count] = &arguments[..] else { return Err("usage: eigenvalues INPUT COUNT".into()) };
    let mesh = ManifoldMesh::try_from(read_mesh(input)?.mesh)?;
    let options = ModeOptions { count: count.parse()?, ..ModeOptions::default() };
    let modes = modes(&IntrinsicMesh::of_mesh(&mesh), &options, &NoProgress)?;
    for value in &modes.eigenvalues {
        println!("{value}");
    }
    Ok(())
}
