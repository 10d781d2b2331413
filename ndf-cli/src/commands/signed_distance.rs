//! `ndf signed-distance`: distances from curves, negative on their left.

use std::path::PathBuf;
use std::time::Instant;

use clap::{ArgGroup, Args, ValueEnum};
use ndf::{Place, SignedDistanceOptions, ZeroSet};
use ndf_mesh::io::{VertexScalars, format_to_write, read_lines};
use serde_json::json;

use crate::arguments::{Sources, TriangulationArguments, Vertices, length, vertices};
use crate::context::Context;
use crate::output::{Failure, Outcome, check_output, grouped, readable, table};
use crate::streams::output_file;
use crate::triangulation::{no_field, read_triangulation};

/// Arguments of `ndf signed-distance`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("from").args(["curve", "curve_vertices", "source", "source_vertex"]).required(true).multiple(true)))]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    /// The mesh to write, with the vertex scalar `signed_distance` (.ply, .glb; other formats hold no scalars).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    output: PathBuf,
    /// A file of oriented lines, such as `ndf path` and `ndf geodesic --paths` write (.ply with an element `edge`, .obj with lines, .glb);
    /// may be given several times. Distances are negative on the left of them, and so inside a loop that runs counter-clockwise. Gaps
    /// may be left open.
    #[arg(long, value_name = "LINES")]
    curve: Vec<PathBuf>,
    /// A curve through vertices of the mesh file, counted from 0, by shortest paths where they are no neighbours; may be given several
    /// times.
    #[arg(long, value_name = "I,I,…", value_parser = vertices)]
    curve_vertices: Vec<Vertices>,
    /// Lead every curve of --curve-vertices back to its first vertex.
    #[arg(long, requires = "curve_vertices")]
    closed: bool,
    /// Points whose distance has no sign, beside curves or alone.
    #[command(flatten)]
    sources: Sources,
    /// What is zero.
    #[arg(long, value_enum, default_value_t)]
    zero: Zero,
    /// How long the normals of the curves diffuse, in squared mean edge lengths [default: 0.25, or larger where heat must go farther].
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = length)]
    time_step: Option<f64>,
}

/// What is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Zero {
    /// The points by which curves are given.
    #[default]
    Curves,
    /// The mean over the curves: noise and steps are smoothed.
    Mean,
}

impl From<Zero> for ZeroSet {
    fn from(zero: Zero) -> Self {
        match zero {
            Zero::Curves => Self::Curves,
            Zero::Mean => Self::Mean,
        }
    }
}

/// Measures signed distances.
///
/// # Errors
/// If the input is no usable triangulation, a curve cannot be read or is not on it, or the mesh cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let Arguments { triangulation, output, curve, curve_vertices, sources, .. } = arguments;
    let input = &triangulation.input;
    format_to_write(output)?;
    check_output(output, &[input])?;
    let curves = curves(arguments)?;
    context.expect(&["extraction", "factoring"]);
    let only_of_meshes = if curve_vertices.is_empty() {
        sources.only_of_meshes()
    } else {
        Some("--curve-vertices counts the vertices of a mesh; say where with --curve LINES")
    };
    let read = read_triangulation(triangulation, only_of_meshes, context)?;
    let started = Instant::now();
    let fields = read.surface.fields().map_err(|error| no_field(input, error))?;
    let options = SignedDistanceOptions {
        curves,
        points: sources.places(),
        zero_set: arguments.zero.into(),
        time_step: arguments.time_step,
    };
    let found = fields.signed_distance(&options, &context.progress());
    let found = found.map_err(|error| no_field(input, error))?;
    let seconds = started.elapsed().as_secs_f64();
    found.notes.iter().for_each(|note| context.warn_of(&input.display(), note));
    let mesh = read.surface.mesh();
    let values = found.values.iter().map(|&d| d as f32).collect();
    context.write_mesh(output, mesh, &[VertexScalars { name: "signed_distance".to_owned(), values }])?;
    let known = || found.values.iter().copied().filter(|d| d.is_finite());
    let [min, max] = [known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max)];
    let unused = read.surface.unused_vertices();
    let unreached = found.values.len() - known().count() - unused.len();
    let mut json = json!({
        "seconds": seconds,
        "vertices": mesh.vertex_count(),
        "curve_length": found.curve_length,
        "min": min,
        "max": max,
        "unreached": unreached,
        "unused_vertices": unused,
        "heat": found.heat,
        "area_left_out": read.surface.area_left_out,
    });
    let mut rows = vec![
        ("vertices", grouped(mesh.vertex_count())),
        ("length of curves", readable(found.curve_length)),
        ("distances", format!("{} to {}", readable(min), readable(max))),
        ("unreached", grouped(unreached)),
        ("time step", format!("{} squared mean edge lengths", found.heat.time_step)),
        ("time", format!("{seconds:.2} s")),
    ];
    context.warn_of_reach(&input.display(), &found.heat, "distances", "try a larger --time-step");
    read.tell_metric(|factors| factors.distances, &mut json, &mut rows);
    read.tell(triangulation, &mut json, &mut rows);
    let what = if curve.is_empty() && curve_vertices.is_empty() { "points" } else { "curves" };
    Ok(Outcome::new(json, format!("{}: signed distances from {what}\n{}", output.display(), table(&rows))))
}

/// The curves of files and of vertices.
fn curves(arguments: &Arguments) -> Result<Vec<Vec<Place>>, Failure> {
    let mut curves = Vec::new();
    for path in &arguments.curve {
        let lines = read_lines(path)?;
        let point = |v: u32| Place::Near(lines.points[v as usize]);
        curves.extend(lines.segments.iter().map(|ends| ends.map(point).to_vec()));
    }
    for Vertices(numbers) in &arguments.curve_vertices {
        let back = arguments.closed.then(|| numbers[0]);
        curves.push(numbers.iter().copied().chain(back).map(|v| Place::Vertex(v.into())).collect());
    }
    Ok(curves)
}
