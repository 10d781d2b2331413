//! `ndf path`: geodesics that wind as they are told.

use std::borrow::Cow;
use std::path::PathBuf;
use std::time::Instant;

use clap::{ArgGroup, Args};
use ndf::{DVec3, DistanceError, DistanceSolver, GeodesicError, Place, ThroughOptions};
use ndf_mesh::io::{Lines, format_of_lines};
use serde_json::json;

use crate::arguments::{Sources, TriangulationArguments, point};
use crate::context::Context;
use crate::output::{Failure, Outcome, check_output, grouped, readable, table};
use crate::streams::output_file;
use crate::triangulation::{no_distances, read_triangulation};

use super::geodesic::corners;

/// Arguments of `ndf path`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("places").args(["through", "through_vertex"]).required(true)))]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    /// Where the path goes: .ply with an element `edge`, .obj with lines, or .glb; `ndf render --paths` draws it.
    #[arg(short, long, value_name = "LINES", value_parser = output_file("ply"))]
    output: PathBuf,
    /// A place on the way, at the vertex closest to it; to be given several times, in order.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    through: Vec<DVec3>,
    /// The same, as the number of a vertex of the mesh file, counted from 0.
    #[arg(long, value_name = "I")]
    through_vertex: Vec<u32>,
    /// Lead back to the first place: a closed geodesic.
    #[arg(long)]
    closed: bool,
    /// Pass all of the places; else those between the ends only say how the path winds.
    #[arg(long)]
    pass: bool,
}

/// Finds a path.
///
/// # Errors
/// If the input is no usable manifold, places are not on it or not joined, or the file cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let (input, output) = (&arguments.triangulation.input, &arguments.output);
    format_of_lines(output)?;
    check_output(output, &[input])?;
    context.expect(&["extraction", "straightening"]);
    let only_of_meshes = (!arguments.through_vertex.is_empty()).then_some(Sources::VERTICES);
    let read = read_triangulation(&arguments.triangulation, only_of_meshes, context)?;
    let started = Instant::now();
    let vertices = arguments.through_vertex.iter().map(|&v| Place::Vertex(v.into()));
    let places: Vec<Place> = vertices.chain(arguments.through.iter().copied().map(Place::Near)).collect();
    let options = ThroughOptions { closed: arguments.closed, pass_vertices: arguments.pass };
    let solver =
        DistanceSolver::new(Cow::Borrowed(&read.surface)).map_err(|error| no_distances(input, error))?;
    let found = solver.through(&places, options, &context.progress()).map_err(|error| match error {
        DistanceError::Geodesic(GeodesicError::NoSource) => Failure::new("a path needs two places")
            .try_instead("give --through or --through-vertex more than once"),
        error => no_distances(input, error),
    })?;
    let seconds = started.elapsed().as_secs_f64();
    let name = input.display();
    found.notes.iter().for_each(|note| context.warn_of(&name, note));
    if !found.is_geodesic {
        context.warn(&format!("{name}: the path bends where it touches itself; other places may free it"));
    }
    let mesh = read.surface.mesh();
    let positions: Vec<DVec3> = found.points.iter().map(|point| point.position(mesh)).collect();
    context.write_lines(output, &Lines::from_polylines([positions.as_slice()]))?;
    let mut json = json!({
        "seconds": seconds,
        "length": found.length,
        "closed": arguments.closed,
        "geodesic": found.is_geodesic,
        "flips": found.flips,
        "points": corners(&found.points, mesh),
        "area_left_out": read.surface.area_left_out,
    });
    let mut rows = vec![
        ("length", readable(found.length)),
        ("flips", grouped(found.flips)),
        ("time", format!("{seconds:.3} s")),
    ];
    read.tell_metric(|factors| factors.distances, &mut json, &mut rows);
    read.tell(&arguments.triangulation, &mut json, &mut rows);
    let what = if arguments.closed { "closed geodesic" } else { "geodesic" };
    Ok(Outcome::new(json, format!("{}: {what}\n{}", output.display(), table(&rows))))
}
