//! Eigenmodes and a signature of a mesh: `cargo run --release -p ndf-spectral --example modes -- MESH`. Without a mesh
//! those of a torus.

use std::error::Error;

use ndf_core::NoProgress;
use ndf_mesh::io::{VertexScalars, read_mesh, write_mesh};
use ndf_mesh::shapes;
use ndf_spectral::{LaplaceBeltrami, ModeOptions, OperatorOptions};

#[allow(clippy::print_stdout, reason = "what an example shows")]
fn main() -> Result<(), Box<dyn Error>> {
    let mesh = match std::env::args().nth(1) {
        Some(path) => read_mesh(path)?.mesh,
        None => shapes::torus(120, 50, 1.0, 0.4),
    };
    // Any triangles will do: those that are not manifold get the Laplacian of their tufted cover.
    let operator = LaplaceBeltrami::from_triangle_mesh(&mesh, OperatorOptions::default())?;
    let options = ModeOptions { count: 30, ..ModeOptions::default() };
    let modes = operator.modes(&options, &NoProgress)?;
    for (k, eigenvalue) in modes.eigenvalues.iter().enumerate() {
        println!("{k:3} {eigenvalue:12.6}");
    }
    println!("residuals up to {:.1e}, complete: {}", modes.max_residual(), modes.verified);

    // Scalars of a PLY file: the third mode, and the heat that stays at every vertex over the shortest useful time.
    let heat = modes.heat_kernel_signatures(&modes.heat_times(8));
    let scalar = |name: &str, values: &[f64]| VertexScalars {
        name: name.to_owned(),
        values: values.iter().map(|&x| x as f32).collect(),
    };
    let path = std::env::temp_dir().join("modes.ply");
    write_mesh(&path, &mesh, &[scalar("mode", modes.mode(2)), scalar("heat", &heat[0])])?;
    println!("{}", path.display());
    Ok(())
}
