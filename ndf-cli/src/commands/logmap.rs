//! `ndf logmap`: how to get from a vertex to all others.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use ndf::Vertex;
use ndf_mesh::io::{VertexScalars, format_to_write};
use serde_json::json;

use super::geodesic::Method;
use crate::arguments::{Sources, TriangulationArguments};
use crate::context::Context;
use crate::output::{Failure, Outcome, check_output, grouped, readable, table};
use crate::streams::output_file;
use crate::triangulation::{no_field, read_triangulation};

/// Arguments of `ndf logmap`.
#[derive(Args, Debug)]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    /// The mesh to write, with the scalars `log_x` and `log_y` (.ply, .glb; other formats hold no scalars).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    output: PathBuf,
    /// The vertex to leave from, counted from 0.
    #[arg(long, value_name = "I")]
    source_vertex: u32,
    /// How.
    #[arg(long, value_enum, default_value_t)]
    method: Method,
}

/// Computes the logarithmic map at a vertex: at every vertex the direction in which a shortest path leaves the source, as long as the
/// path.
///
/// # Errors
/// If the input is no usable triangulation, the vertex is not there, or the mesh cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let Arguments { triangulation, output, source_vertex, method } = arguments;
    let input = &triangulation.input;
    format_to_write(output)?;
    check_output(output, &[input])?;
    context.expect(&["extraction", "geodesic distances"]);
    let read = read_triangulation(triangulation, Some(Sources::VERTICES), context)?;
    let started = Instant::now();
    let fields = read.surface.fields().map_err(|error| no_field(input, error))?;
    let found = fields.log_map(Vertex(*source_vertex), (*method).into(), &context.progress());
    let found = found.map_err(|error| no_field(input, error))?;
    let seconds = started.elapsed().as_secs_f64();
    let mesh = read.surface.mesh();
    context.write_mesh(output, mesh, &VertexScalars::of_tuples(["log_x", "log_y"], &found.coordinates))?;
    let lengths = found.coordinates.iter().map(|[x, y]| x.hypot(*y));
    let farthest = lengths.filter(|d| d.is_finite()).fold(0.0, f64::max);
    let unreached = found.coordinates.iter().filter(|[x, _]| x.is_nan()).count();
    let mut json = json!({
        "seconds": seconds,
        "vertices": mesh.vertex_count(),
        "max_distance": farthest,
        "unreached": unreached - read.surface.unused_vertices().len(),
        "axes": found.axes.map(|axis| axis.to_array()),
        "area_left_out": read.surface.area_left_out,
    });
    let axis = |k: usize| {
        let [x, y, z] = found.axes[k].to_array().map(readable);
        format!("({x}, {y}, {z})")
    };
    let mut rows = vec![
        ("vertices", grouped(mesh.vertex_count())),
        ("farthest", readable(farthest)),
        ("x axis", axis(0)),
        ("y axis", axis(1)),
        ("time", format!("{seconds:.2} s")),
    ];
    if let Some(heat) = found.heat {
        json["heat"] = json!(heat);
        rows.push(("time step", format!("{} squared mean edge lengths", heat.time_step)));
        context.warn_of_reach(&input.display(), &heat, "coordinates", "try --method exact");
    }
    read.tell_metric(|factors| factors.distances, &mut json, &mut rows);
    read.tell(triangulation, &mut json, &mut rows);
    let what = format!("the logarithmic map at vertex {source_vertex}");
    Ok(Outcome::new(json, format!("{}: {what}\n{}", output.display(), table(&rows))))
}
