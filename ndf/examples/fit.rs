//! From a surface of any kind to a mesh of its model with geodesic distances.
//!
//! `cargo run --release -p ndf --example fit -- scan.e57 distances.ply`

use ndf::{DistanceOptions, EdgeLength, Fit, NoProgress, OpenOptions, Place, Triangulated, Vertex};
use ndf_mesh::io::write_mesh;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let input = arguments.next().ok_or("usage: fit INPUT OUTPUT.ply")?;
    let output = arguments.next().ok_or("usage: fit INPUT OUTPUT.ply")?;

    // With the defaults of the program.
    let opened = ndf::open(&input, &OpenOptions::default())?;
    let fitted = Fit::new(&opened).base_faces(1000).run()?;
    for note in opened.notes.iter().chain(&fitted.notes) {
        eprintln!("{input}: {note}");
    }

    // Edges of a hundredth of the box; distances are in the input's units.
    let mesh = Triangulated::from_model(&fitted.model, EdgeLength::Relative(0.03), &NoProgress)?;
    let distances = mesh.distances(&[Place::Vertex(Vertex(0))], &DistanceOptions::default(), &NoProgress)?;
    write_mesh(&output, mesh.mesh(), &[distances.scalars()])?;
    Ok(())
}
