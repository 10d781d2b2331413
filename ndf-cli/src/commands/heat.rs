//! `ndf heat`: heat that flows over a surface.

use std::path::PathBuf;
use std::time::Instant;

use clap::{ArgGroup, Args};
use ndf::files::begins_as_model;
use ndf::{HeatOptions, InitialHeat, ModelExt, stored_scalars};
use ndf_mesh::io::{VertexScalars, format_to_write, read_mesh};
use serde_json::json;

use crate::arguments::{Boundary, Sources, TriangulationArguments, length};
use crate::context::Context;
use crate::files::read_model;
use crate::output::{Failure, Outcome, check_output, grouped, readable, table};
use crate::streams::output_file;
use crate::triangulation::{Found, no_field, read_triangulation};

/// Arguments of `ndf heat`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("start").args(["source", "source_vertex", "initial"]).required(true).multiple(true)))]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    /// The mesh to write, with the temperature at every vertex as `heat`, or, of several frames, as `heat_00`, `heat_01`, … (.ply, .glb;
    /// other formats hold no scalars).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    output: PathBuf,
    /// How long heat flows, in squared units of length.
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = length)]
    time: f64,
    /// At how many times up to that, equally far from each other, temperatures are written.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    frames: u32,
    /// One unit of heat at each source.
    #[command(flatten)]
    sources: Sources,
    /// The scalar of the input that temperatures begin with, in place of sources.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["source", "source_vertex"])]
    initial: Option<String>,
    /// What happens at a boundary.
    #[arg(long, value_enum, default_value_t)]
    boundary: Boundary,
}

/// Lets heat flow.
///
/// # Errors
/// If the input is no usable triangulation, has no such scalar, or the mesh cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let Arguments { triangulation, output, time, frames, sources, initial, boundary } = arguments;
    let input = &triangulation.input;
    format_to_write(output)?;
    check_output(output, &[input])?;
    context.expect(&["extraction", "factoring", "heat"]);
    let only_of_meshes = match initial {
        Some(_) => Some("--initial names a scalar of a mesh or a model; heat may begin at --source X,Y,Z"),
        None => sources.only_of_meshes(),
    };
    let read = read_triangulation(triangulation, only_of_meshes, context)?;
    let start = match initial {
        Some(scalar) => InitialHeat::Values(values_of(scalar, triangulation, &read, context)?),
        None => InitialHeat::Sources(sources.places()),
    };
    let started = Instant::now();
    let options = HeatOptions {
        time: *time,
        frames: *frames as usize,
        is_boundary_held: *boundary == Boundary::Dirichlet,
    };
    let found = read.surface.heat(&start, &options, &context.progress());
    let found = found.map_err(|error| no_field(input, error))?;
    let seconds = started.elapsed().as_secs_f64();
    found.notes.iter().for_each(|note| context.warn_of(&input.display(), note));
    let mesh = read.surface.mesh();
    let name = |frame: usize| if *frames == 1 { "heat".to_owned() } else { format!("heat_{frame:02}") };
    let scalars = found.frames.iter().enumerate().map(|(frame, values)| VertexScalars {
        name: name(frame),
        values: values.iter().map(|&x| x as f32).collect(),
    });
    context.write_mesh(output, mesh, &scalars.collect::<Vec<_>>())?;
    let last = found.frames.last().map_or(&[][..], Vec::as_slice);
    let known = || last.iter().copied().filter(|x| x.is_finite());
    let [least, most] = [known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max)];
    let mut json = json!({
        "seconds": seconds,
        "vertices": mesh.vertex_count(),
        "times": found.times,
        "totals": found.totals,
        "min": least,
        "max": most,
        "area_left_out": read.surface.area_left_out,
    });
    let totals = [found.totals.first(), found.totals.last()].map(|total| readable(*total.unwrap_or(&0.0)));
    let mut rows = vec![
        ("vertices", grouped(mesh.vertex_count())),
        ("heat in all", format!("{} at first, {} in the end", totals[0], totals[1])),
        ("in the end", format!("{} to {}", readable(least), readable(most))),
        ("time", format!("{seconds:.2} s")),
    ];
    read.tell_metric(|factors| factors.operators, &mut json, &mut rows);
    read.tell(triangulation, &mut json, &mut rows);
    let what =
        if *frames == 1 { "temperatures".to_owned() } else { format!("temperatures at {frames} times") };
    Ok(Outcome::new(json, format!("{}: {what}\n{}", output.display(), table(&rows))))
}

/// The values of a scalar of the input at the vertices of the surface.
fn values_of(
    scalar: &str,
    triangulation: &TriangulationArguments,
    read: &Found,
    context: &Context,
) -> Result<Vec<f64>, Failure> {
    let input = &triangulation.input;
    let scalars = if begins_as_model(input) {
        let model = read_model(input)?;
        let length = triangulation.edge_length.get().unwrap_or_default();
        let extracted = model.extract_with(length, &context.progress());
        stored_scalars(&model, &extracted.map_err(|e| Failure::new(format!("{}: {e}", input.display())))?)
    } else {
        read_mesh(input)?.scalars
    };
    let names: Vec<&str> = scalars.iter().map(|scalars| scalars.name.as_str()).collect();
    let found = scalars.iter().find(|scalars| scalars.name == scalar).ok_or_else(|| {
        let failure = Failure::new(format!("{} has no scalar {scalar:?}", input.display()));
        match &names[..] {
            [] => failure.try_instead("PLY files and models hold scalars; heat may begin at --source X,Y,Z"),
            names => failure.try_instead(&format!("it has {}", names.join(", "))),
        }
    })?;
    // No face uses a vertex without a value, or its temperature would spread.
    let mut values: Vec<f64> = found.values.iter().map(|&x| x.into()).collect();
    for v in read.surface.unused_vertices() {
        values[v.index()] = 0.0;
    }
    Ok(values)
}
