//! `ndf extract`: a mesh of a model, as fine as is asked for.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use ndf::ModelExt;
use ndf::figures::ExtractionFigures;
use ndf_mesh::io::format_to_write;

use crate::arguments::EdgeLength;
use crate::context::Context;
use crate::files::read_model;
use crate::output::{Failure, Outcome, check_output, grouped, table};
use crate::remeshed::rows_of;
use crate::streams::{input_file, output_file};

/// Arguments of `ndf extract`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The model.
    #[arg(value_parser = input_file())]
    model: PathBuf,
    /// The mesh to write; the extension sets the format (.ply, .glb, .obj, .stl).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    output: PathBuf,
    #[command(flatten)]
    edge_length: EdgeLength,
    /// Only subdivide the base faces, until no edge is longer than the edge length; do not improve the triangles.
    #[arg(long)]
    no_refine: bool,
}

/// Writes a mesh of a model.
///
/// # Errors
/// If the model cannot be read, the edge length asks for too much, or the mesh cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    format_to_write(&arguments.output)?;
    check_output(&arguments.output, &[&arguments.model])?;
    context.expect(&["extraction"]);
    let model = read_model(&arguments.model)?;
    let started = Instant::now();
    let failed = |e: &dyn std::fmt::Display| Failure::new(format!("{}: {e}", arguments.model.display()));
    let length = arguments.edge_length.get().unwrap_or_default();
    let (mesh, report) = if arguments.no_refine {
        (model.tessellate(length, &context.progress()).map_err(|e| failed(&e))?, None)
    } else {
        let found = model.extract_with(length, &context.progress()).map_err(|e| failed(&e))?;
        (found.mesh, Some(found.report))
    };
    let seconds = started.elapsed().as_secs_f64();
    context.write_mesh(&arguments.output, &mesh, &[])?;
    let figures = ExtractionFigures::of(&mesh, report.as_ref(), &context.progress())?;
    let mut json = serde_json::to_value(&figures)?;
    json["seconds"] = seconds.into();
    let target = length.world(&model);
    json["target_edge_length"] = target.into();
    let mut rows = rows_of(&figures);
    for (label, value) in &mut rows {
        if *label == "edge length" {
            *value += &format!("; asked: {}", arguments.edge_length.in_words(target));
        }
    }
    rows.push(("time", format!("{seconds:.3} s")));
    let path = arguments.output.display();
    Ok(Outcome::new(json, format!("{path}: {} faces\n{}", grouped(mesh.face_count()), table(&rows))))
}
