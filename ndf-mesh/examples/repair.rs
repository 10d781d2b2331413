//! Says what is wrong with a mesh file and writes a manifold of it: `repair INPUT OUTPUT`.

use ndf_mesh::ValidationReport;
use ndf_mesh::io::{read_mesh, write_mesh};
use ndf_mesh::repair::{self, RepairOptions};

#[expect(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output] = &arguments[..] else { return Err("usage: repair INPUT OUTPUT".into()) };
    let file = read_mesh(input)?;
    println!("{}", ValidationReport::of(&file.mesh));
    let repaired = repair::repaired(&file.mesh, &RepairOptions::default())?;
    for note in &repaired.notes {
        println!("{note}");
    }
    println!("{}", ValidationReport::of(&repaired.mesh));
    write_mesh(output, &repaired.mesh, &[])?;
    Ok(())
}
