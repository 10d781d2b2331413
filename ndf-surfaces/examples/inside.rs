//! Generalised winding numbers of a mesh file, which need not be closed, at points of standard input: `inside INPUT`.

use std::io::BufRead;

use ndf_core::DVec3;
use ndf_mesh::io::read_mesh;
use ndf_surfaces::WindingNumber;

#[expect(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input] = &arguments[..] else { return Err("usage: inside INPUT < POINTS".into()) };
    let winding_number = WindingNumber::new(&read_mesh(input)?.mesh);
    for line in std::io::stdin().lock().lines() {
        let numbers: Vec<f64> = line?.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        let [x, y, z] = numbers[..] else { return Err("a line is a point: x y z".into()) };
        println!("{:.6}", winding_number.at(DVec3::new(x, y, z)));
    }
    Ok(())
}
