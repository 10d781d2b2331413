//! `ndf transport`: a tangent vector carried over a surface.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use ndf::{Transported, Vertex};
use ndf_mesh::io::format_to_write;
use serde_json::json;

use super::directions::vector_scalars;
use crate::arguments::{Sources, TriangulationArguments, angle};
use crate::context::Context;
use crate::output::{Failure, Outcome, check_output, grouped, readable, table};
use crate::streams::output_file;
use crate::triangulation::{no_field, read_triangulation};

/// Arguments of `ndf transport`.
#[derive(Args, Debug)]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    /// The mesh to write, with the vector at every vertex as `transport_x`, `transport_y` and `transport_z` (.ply, .glb; other formats
    /// hold no scalars).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    output: PathBuf,
    /// The vertex where the vector is, counted from 0.
    #[arg(long, value_name = "I")]
    source_vertex: u32,
    /// The vector's angle, in degrees to the left of the vertex' first axis, which --json gives.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = angle)]
    angle: f64,
}

/// Carries a unit vector to all vertices along shortest paths.
///
/// # Errors
/// If the input is no usable triangulation, the vertex is not there, or the mesh cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let Arguments { triangulation, output, source_vertex, angle } = arguments;
    let input = &triangulation.input;
    format_to_write(output)?;
    check_output(output, &[input])?;
    context.expect(&["extraction", "factoring"]);
    let read = read_triangulation(triangulation, Some(Sources::VERTICES), context)?;
    let started = Instant::now();
    let fields = read.surface.fields().map_err(|error| no_field(input, error))?;
    let source = Vertex(*source_vertex);
    let found = fields.transport(source, angle.to_radians(), &context.progress());
    let Transported { vectors, heat, .. } = found.map_err(|error| no_field(input, error))?;
    let axes = fields.axes(source).map_err(|error| no_field(input, error))?;
    let seconds = started.elapsed().as_secs_f64();
    let mesh = read.surface.mesh();
    let names = ["transport_x", "transport_y", "transport_z"];
    context.write_mesh(output, mesh, &vector_scalars(names, &vectors))?;
    let vector = vectors[source.index()];
    let mut json = json!({
        "seconds": seconds,
        "vertices": mesh.vertex_count(),
        "vector": vector.to_array(),
        "axes": axes.map(|axis| axis.to_array()),
        "heat": heat,
        "area_left_out": read.surface.area_left_out,
    });
    let [x, y, z] = vector.to_array().map(readable);
    let mut rows = vec![
        ("vertices", grouped(mesh.vertex_count())),
        ("at the source", format!("({x}, {y}, {z})")),
        ("time step", format!("{} squared mean edge lengths", heat.time_step)),
        ("time", format!("{seconds:.2} s")),
    ];
    context.warn_of_reach(&input.display(), &heat, "vectors", "a coarser mesh is crossed in fewer edges");
    read.tell_metric(|factors| factors.distances, &mut json, &mut rows);
    read.tell(triangulation, &mut json, &mut rows);
    Ok(Outcome::new(
        json,
        format!("{}: a vector carried to all vertices\n{}", output.display(), table(&rows)),
    ))
}
