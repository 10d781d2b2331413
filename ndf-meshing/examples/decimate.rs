//! Decimates a Wavefront OBJ file of triangles: `decimate INPUT OUTPUT FACES`. Prints the seconds it took and
//! what the result is.

use std::error::Error;
use std::fmt::Write as _;
use std::time::Instant;

use ndf_core::mesh::repair;
use ndf_core::{DVec3, ManifoldMesh, NoProgress, TriangleMesh, ValidationReport};
use ndf_meshing::{DecimationOptions, decimate, triangle_shape};

fn read(path: &str) -> Result<TriangleMesh, Box<dyn Error>> {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for line in std::fs::read_to_string(path)?.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.split_first() {
            Some((&"v", xyz)) if xyz.len() >= 3 => {
                positions.push(DVec3::new(xyz[0].parse()?, xyz[1].parse()?, xyz[2].parse()?));
            }
            Some((&"f", corners)) => {
                let index = |word: &&str| word.split('/').next().unwrap_or("").parse::<u32>().map(|i| i - 1);
                let corners = corners.iter().map(index).collect::<Result<Vec<_>, _>>()?;
                faces.extend((2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]));
            }
            _ => {}
        }
    }
    Ok(TriangleMesh::new(positions, faces)?)
}

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn Error>> {
    let [input, output, faces] = &std::env::args().skip(1).collect::<Vec<_>>()[..] else {
        return Err("usage: decimate INPUT.obj OUTPUT.obj FACES".into());
    };
    let mesh = repair::without_unreferenced_vertices(&repair::without_unusable_faces(&read(input)?)).0;
    let mesh = ManifoldMesh::try_from(repair::split_fans(&mesh))?;
    let begin = Instant::now();
    let result = decimate(&mesh, &DecimationOptions::to_faces(faces.parse()?), &NoProgress);
    let seconds = begin.elapsed().as_secs_f64();
    let report = ValidationReport::of(result.mesh.as_triangle_mesh());
    let degrees = triangle_shape::smallest_angles(&result.mesh)[0].to_degrees();
    println!(
        "{seconds:.3} s; was χ = {}; {report}; {} without area; smallest angle {degrees:.2}°",
        mesh.euler_characteristic(),
        report.degenerate_faces.count
    );
    let mut text = String::new();
    for p in result.mesh.positions() {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for f in result.mesh.faces() {
        writeln!(text, "f {} {} {}", f[0] + 1, f[1] + 1, f[2] + 1)?;
    }
    Ok(std::fs::write(output, text)?)
}
