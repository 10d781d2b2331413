//! Decimates a mesh file: `decimate INPUT OUTPUT FACES [ROUNDS]`, with so many rounds of the final pass (0 if not
//! given). Prints the seconds it took and what the result is.

use std::error::Error;
use std::time::Instant;

use ndf_core::NoProgress;
use ndf_mesh::io::{read_mesh, write_mesh};
use ndf_mesh::repair;
use ndf_mesh::{ManifoldMesh, ValidationReport};
use ndf_meshing::{BaseMeshOptions, FinalPassOptions, base_mesh_of_manifold, triangle_shape};

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output, faces, rest @ ..] = &arguments[..] else {
        return Err("usage: decimate INPUT OUTPUT FACES [ROUNDS]".into());
    };
    let rounds = rest.first().map_or(Ok(0), |rounds| rounds.parse())?;
    let mesh = repair::without_unusable_faces(&read_mesh(input)?.mesh);
    let mesh = repair::split_fans(&repair::without_unreferenced_vertices(&mesh).0);
    let mesh = ManifoldMesh::try_from(mesh)?;
    let options = BaseMeshOptions {
        faces: faces.parse()?,
        final_pass: FinalPassOptions { rounds, ..Default::default() },
        ..Default::default()
    };
    let begin = Instant::now();
    let base = base_mesh_of_manifold(&mesh, None, &options, &NoProgress)?;
    println!(
        "{:.3} s for {} → {} faces",
        begin.elapsed().as_secs_f64(),
        mesh.face_count(),
        base.report.faces
    );
    let angles = triangle_shape::smallest_angles(&base.mesh);
    let degrees = |share: f64| angles[(share * (angles.len() - 1) as f64) as usize].to_degrees();
    println!("{:#?}", base.report);
    println!("was χ = {}, now {}", mesh.topology().euler_characteristic(), ValidationReport::of(&base.mesh));
    println!(
        "smallest angles: least {:.2}°, 1 % {:.2}°, median {:.2}°",
        degrees(0.0),
        degrees(0.01),
        degrees(0.5)
    );
    write_mesh(output, &base.mesh, &[])?;
    Ok(())
}
