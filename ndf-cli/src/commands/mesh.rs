//! `ndf mesh`: direct meshing, without learning.

use std::fmt::Display;
use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};
use ndf::left_out::check_left_out;
use ndf::{OpenOptions, Parts};
use ndf_mesh::ValidationReport;
use ndf_mesh::io::format_to_write;
use ndf_meshing::{DecimationOptions, IsosurfaceError, MarchingCubesOptions, decimate, marching_cubes};
use serde_json::json;

use crate::arguments::{PartArguments, Reading, length};
use crate::context::Context;
use crate::files::open;
use crate::output::{Failure, Outcome, check_output, grouped};
use crate::streams::{input_file, output_file};

/// Cells along the longest side, at most.
const MAX_GRID: u32 = 2048;

/// Arguments of `ndf mesh`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The surface to mesh.
    #[arg(value_parser = input_file())]
    input: PathBuf,
    /// The mesh to write; the extension sets the format (.ply, .glb, .obj, .stl).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    output: PathBuf,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    parts: PartArguments,
    /// How.
    #[arg(long, value_enum, default_value_t)]
    method: Method,
    /// Cells along the longest side.
    #[arg(long, value_name = "N", default_value_t = 128, conflicts_with = "edge_length", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_GRID)))]
    grid: u32,
    /// Side of a cell, in the input's units, instead of their number.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length)]
    edge_length: Option<f64>,
    /// Decimate to this many faces.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..))]
    faces: Option<u32>,
}

/// The failure of making an isosurface on a grid of so many cells.
fn not_meshed(name: &dyn Display, error: &IsosurfaceError, grid: u32) -> Failure {
    let failure = Failure::new(format!("{name}: {error}"));
    match error {
        IsosurfaceError::NoCrossing { .. } if grid <= MAX_GRID / 4 => {
            failure.try_instead(&format!("try a finer grid, such as --grid {}", 4 * grid))
        }
        _ => failure,
    }
}

/// Ways to mesh a scalar field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Method {
    /// Marching cubes, manifold by construction.
    #[default]
    MarchingCubes,
}

/// Meshes a surface.
///
/// # Errors
/// If the input encloses nothing, the grid is too fine, or the mesh cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let Method::MarchingCubes = arguments.method;
    format_to_write(&arguments.output)?;
    check_output(&arguments.output, &[&arguments.input])?;
    context.expect(&["orienting", "marching cubes", "decimation"]);
    let name = arguments.input.display();
    let repair = arguments.parts.options(Parts::All);
    let options = OpenOptions { repair, ..arguments.reading.options()? };
    let input = open(&arguments.input, &options, context)?;
    let started = Instant::now();
    let field = input.field_surface().and_then(ndf_core::Surface::as_field).ok_or_else(|| {
        let failure = Failure::new(format!("{name} encloses no volume, so that it has no isosurface"));
        failure.try_instead("close its holes, or fit it directly if it is a manifold")
    })?;
    let grid = match arguments.edge_length {
        None => arguments.grid,
        Some(h) => {
            let cells = (field.bounds().extent().max_element() / h).ceil();
            if cells > f64::from(MAX_GRID) {
                let failure =
                    Failure::new(format!("cells of {h} make a grid of {cells} cells along the longest side"));
                return Err(failure.try_instead(&format!("{MAX_GRID} are the most; ask for longer edges")));
            }
            (cells as u32).max(1)
        }
    };
    let progress = context.progress();
    let options = MarchingCubesOptions { grid, ..MarchingCubesOptions::default() };
    let found =
        marching_cubes(field, &options, &progress).map_err(|error| not_meshed(&name, &error, grid))?;
    let (area_left_out, notes) = input.lost_by(&found.mesh);
    notes.iter().for_each(|note| context.warn_of(&name, note));
    check_left_out(area_left_out, repair.parts).map_err(|error| {
        let failure = Failure::new(format!("{name}: {error}"));
        failure.try_instead("try a finer grid, or --largest-component if the rest is not wanted")
    })?;
    let mut mesh = found.mesh;
    if let Some(faces) = arguments.faces {
        let options = DecimationOptions::to_faces(faces as usize);
        let decimated = decimate(&mesh, &options, &progress);
        if !decimated.reached {
            let left = decimated.mesh.face_count();
            context
                .warn(&format!("{name}: decimation ended at {left} faces; its topology or shape needs them"));
        }
        mesh = decimated.mesh;
    }
    drop(progress);
    let seconds = started.elapsed().as_secs_f64();
    context.write_mesh(&arguments.output, &mesh, &[])?;
    let report = ValidationReport::of(&mesh);
    let path = arguments.output.display().to_string();
    let json = json!({
        "output": path,
        "seconds": seconds,
        "vertices": report.vertices,
        "faces": report.faces,
        "components": report.components,
        "euler_characteristic": report.euler_characteristic,
        "boundary_edges": report.boundary_edges,
        "manifold": report.is_manifold(),
        "grid": found.cells,
        "cell": found.cell,
        "evaluations": found.evaluations,
        "area_left_out": area_left_out,
    });
    let text = format!(
        "{path}: {report}\n  grid of {} × {} × {} cells, {} evaluations, {seconds:.2} s\n",
        found.cells[0],
        found.cells[1],
        found.cells[2],
        grouped(found.evaluations as usize)
    );
    Ok(Outcome::new(json, text))
}
