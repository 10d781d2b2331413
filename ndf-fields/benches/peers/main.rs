//! Fields beside those of other programs.
//!
//! `cargo bench -p ndf-fields --bench peers -- [--python PYTHON] [--geometry-central PROGRAM] [--speed] [MESH…]`
//!
//! Without `--speed` tables of what differs: beside closed forms, and potpourri3d's values if PYTHON has it ([`closed_forms`]), and beside
//! what geometry-central finds ([`geometry_central`]). With `--speed` times in turns, each on one thread ([`speed`]).
//! `experiments/peers/geometry_central` holds PROGRAM. A sphere and a torus come before the meshes that are given.

#![allow(clippy::print_stdout)]

mod closed_forms;
mod exchange;
mod geometry_central;
mod speed;

use std::path::{Path, PathBuf};

use ndf_mesh::io::read_mesh;
use ndf_mesh::{ManifoldMesh, shapes};

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("nothing ran before");
    let [mut python, mut program] = [None, None];
    let mut is_speed = false;
    let mut meshes: Vec<PathBuf> = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--python" => python = arguments.next().map(PathBuf::from),
            "--geometry-central" => program = arguments.next().map(PathBuf::from),
            "--speed" => is_speed = true,
            // Cargo's own.
            "--bench" => {}
            path => meshes.push(path.into()),
        }
    }
    let (python, program) = (python.as_deref(), program.as_deref());
    if is_speed {
        speed::print(&all(&meshes), python, program);
        return;
    }
    if python.is_some() || program.is_none() {
        closed_forms::print(python);
    }
    if let Some(program) = program {
        geometry_central::print(&all(&meshes), program);
    }
}

/// A sphere, a torus, and the meshes of files, with their names.
fn all(paths: &[PathBuf]) -> Vec<(String, ManifoldMesh)> {
    let made = [("sphere", shapes::icosphere(5)), ("torus", shapes::torus(120, 60, 1.0, 0.4))];
    let made = made.into_iter().map(|(name, mesh)| (name.to_owned(), mesh));
    let read = |path: &PathBuf| {
        let file = read_mesh(path).unwrap_or_else(|error| panic!("{error}"));
        let name = path.file_stem().unwrap_or(Path::new("mesh").as_os_str());
        (name.to_string_lossy().into_owned(), file.mesh)
    };
    let manifold = |(name, mesh)| {
        let mesh = ManifoldMesh::try_from(mesh).unwrap_or_else(|error| panic!("{name}: {error}"));
        (name, mesh)
    };
    made.chain(paths.iter().map(read)).map(manifold).collect()
}
