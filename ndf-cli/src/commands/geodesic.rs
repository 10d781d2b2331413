//! `ndf geodesic`: distances over a surface.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use ndf::{
    DVec3, DistanceMethod, DistanceOptions, Distances, GeodesicError, Place, SurfacePath, TriangleMesh,
};
use ndf_mesh::FacePoint;
use ndf_mesh::io::{Lines, MeshFormat, format_of_lines, format_to_write};
use serde_json::{Value, json};

use crate::arguments::{Sources, TriangulationArguments, length, point};
use crate::context::Context;
use crate::output::{Failure, Outcome, check_output, grouped, is_same, readable, table};
use crate::streams::{is_output, output_file};
use crate::triangulation::{no_distances, read_triangulation};

/// Arguments of `ndf geodesic`.
#[derive(Args, Debug)]
#[command(group(Sources::required()))]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    /// The mesh to write, with the vertex scalar `distance` (.ply, or .glb for viewers; .obj and .stl have no scalars and lose it).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    output: PathBuf,
    #[command(flatten)]
    sources: Sources,
    /// How.
    #[arg(long, value_enum, default_value_t)]
    method: Method,
    /// Time step of the heat method, in squared mean edge lengths [default: 1, or larger where heat must go farther].
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = length)]
    time_step: Option<f64>,
    /// Also write the number of the nearest source at every vertex as `nearest`, counted as --source-vertex and then --source give them,
    /// and -1 where there is none: the regions of a Voronoi diagram.
    #[arg(long)]
    nearest: bool,
    /// Go no farther than this; what lies beyond is infinitely far.
    #[arg(long, value_name = "D", allow_negative_numbers = true, value_parser = length)]
    max_distance: Option<f64>,
    /// Also find the shortest path from the nearest source to the surface's point closest to this one; may be given several
    /// times. The paths are lines in the file of --paths, which `ndf render --paths` draws; --json has them with faces and
    /// barycentric coordinates, too.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    path_to: Vec<DVec3>,
    /// Where the paths go: .ply with an element `edge` (for MeshLab, trimesh), .obj with lines (for pyvista, ParaView), or .glb
    /// [default: the name of the mesh with .paths.ply].
    #[arg(long, value_name = "FILE", requires = "path_to")]
    paths: Option<PathBuf>,
}

impl Arguments {
    /// Where paths go, if there are any.
    fn paths(&self) -> Option<PathBuf> {
        let beside = || self.output.with_extension("paths.ply");
        (!self.path_to.is_empty()).then(|| self.paths.clone().unwrap_or_else(beside))
    }
}

/// Ways to measure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Exact distances on the triangles.
    #[default]
    Exact,
    /// The heat method: smooth, about one per cent off on fine, even meshes.
    Heat,
}

impl From<Method> for DistanceMethod {
    fn from(method: Method) -> Self {
        match method {
            Method::Exact => Self::Exact,
            Method::Heat => Self::Heat,
        }
    }
}

/// Measures distances over a surface.
///
/// # Errors
/// If the input cannot be read, a source is not on it, or the output cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    check_places(arguments, context)?;
    if arguments.time_step.is_some() && arguments.method == Method::Exact {
        return Err(Failure::new("--time-step is for the heat method").try_instead("add --method heat"));
    }
    if arguments.nearest && arguments.method == Method::Heat {
        return Err(Failure::new("heat does not tell from which source it comes")
            .try_instead("--nearest takes --method exact"));
    }
    let name = arguments.triangulation.input.display();
    context.expect(&["extraction", "geodesic distances"]);
    let read = read_triangulation(&arguments.triangulation, arguments.sources.only_of_meshes(), context)?;
    let found = &read.surface;
    let mesh = found.mesh();
    let started = Instant::now();
    let vertices = mesh.vertex_count();
    let sources = arguments.sources.places();
    let options = DistanceOptions {
        method: arguments.method.into(),
        time_step: arguments.time_step,
        paths_to: arguments.path_to.iter().copied().map(Place::Near).collect(),
        nearest: arguments.nearest,
        max_distance: arguments.max_distance,
    };
    let progress = context.progress();
    let distances = found
        .distances(&sources, &options, &progress)
        .map_err(|error| no_distances(&arguments.triangulation.input, error))?;
    drop(progress);
    let seconds = started.elapsed().as_secs_f64();
    let mut scalars = vec![distances.scalars()];
    scalars.extend(arguments.nearest.then(|| distances.nearest_scalars()));
    context.write_mesh(&arguments.output, mesh, &scalars)?;
    let Distances { values: distances, heat, paths, notes, .. } = distances;
    notes.iter().for_each(|note| context.warn_of(&name, note));
    let unused = found.unused_vertices();
    let unreached = distances.iter().filter(|d| d.is_infinite()).count() - unused.len();
    let max = distances.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
    let mut json = json!({
        "seconds": seconds,
        "vertices": vertices,
        "max_distance": max,
        "unreached": unreached,
        "unused_vertices": unused,
        "area_left_out": found.area_left_out,
    });
    let mut rows = vec![
        ("vertices", grouped(vertices)),
        ("farthest", readable(max)),
        ("unreached", grouped(unreached)),
        ("time", format!("{seconds:.3} s")),
    ];
    read.tell_metric(|factors| factors.distances, &mut json, &mut rows);
    if let Some(heat) = heat {
        json["heat"] = json!(heat);
        rows.push(("time step", format!("{} squared mean edge lengths", heat.time_step)));
        context.warn_of_reach(&name, &heat, "distances", "try a larger --time-step, or --method exact");
    }
    read.tell(&arguments.triangulation, &mut json, &mut rows);
    let lengths =
        arguments.paths().map(|place| write_paths(arguments, &place, &paths, mesh, context)).transpose()?;
    rows.extend(lengths.map(|lengths| ("paths", lengths)));
    let paths: Vec<Value> = paths.iter().flatten().map(|path| described(path, mesh)).collect();
    if let [path] = &paths[..] {
        json["path"] = path.clone();
    }
    json["paths"] = paths.into();
    let output = arguments.output.display();
    Ok(Outcome::new(json, format!("{output}: distances from {}\n{}", counted(sources.len()), table(&rows))))
}

/// Whether the outputs can be expected to appear, and hold what is asked for.
fn check_places(arguments: &Arguments, context: &Context) -> Result<(), Failure> {
    let (output, input) = (&arguments.output, arguments.triangulation.input.as_path());
    if !matches!(format_to_write(output)?, MeshFormat::Ply | MeshFormat::Glb) {
        context.warn(&format!(
            "{}: this format holds no scalars; .ply and .glb have the distances",
            output.display()
        ));
    }
    check_output(output, &[input])?;
    let Some(paths) = arguments.paths() else { return Ok(()) };
    if arguments.paths.is_none() && is_output(output) {
        let failure = Failure::new("the standard output takes the mesh, and the paths need a file");
        return Err(failure.try_instead("name it with --paths"));
    }
    format_of_lines(&paths)?;
    check_output(&paths, &[input])?;
    if is_same(output, &paths) {
        return Err(Failure::new(format!("{} is the name of two outputs", paths.display()))
            .try_instead("give the paths another with --paths"));
    }
    Ok(())
}

/// Writes the paths that were found, and says how long they are.
///
/// # Errors
/// If the file cannot be written, or one of the paths was not found.
fn write_paths(
    arguments: &Arguments,
    place: &Path,
    paths: &[Result<SurfacePath, GeodesicError>],
    mesh: &TriangleMesh,
    context: &Context,
) -> Result<String, Failure> {
    let corners = |path: &SurfacePath| path.points.iter().map(|p| p.position(mesh)).collect();
    let polylines: Vec<Vec<DVec3>> = paths.iter().flatten().map(corners).collect();
    let output = arguments.output.display();
    let mut found = format!("the distances are in {output}");
    if !polylines.is_empty() {
        context.write_lines(place, &Lines::from_polylines(polylines.iter().map(Vec::as_slice)))?;
        found += &format!(", the other paths in {}", place.display());
    }
    for (path, DVec3 { x, y, z }) in paths.iter().zip(&arguments.path_to) {
        let failure = match path {
            Ok(_) => continue,
            Err(GeodesicError::Unreached { .. }) => Failure::new(format!(
                "{}: there is no path to ({x}, {y}, {z}), which is on another component than the sources",
                arguments.triangulation.input.display()
            )),
            Err(error) => Failure::new(format!("{}: {error}", arguments.triangulation.input.display())),
        };
        return Err(failure.try_instead(&found));
    }
    let lengths: Vec<String> = paths.iter().flatten().map(|path| readable(path.length)).collect();
    Ok(format!("{}: {} long", place.display(), lengths.join(", ")))
}

fn counted(sources: usize) -> String {
    if sources == 1 { "1 source".to_owned() } else { format!("{} sources", grouped(sources)) }
}

/// A path as positions and as faces with barycentric coordinates, from the source on.
fn described(path: &SurfacePath, mesh: &TriangleMesh) -> Value {
    json!({"length": path.length, "source": path.source, "points": corners(&path.points, mesh)})
}

/// Points of faces with their positions.
pub(super) fn corners(points: &[FacePoint], mesh: &TriangleMesh) -> Vec<Value> {
    let corner = |point: &FacePoint| {
        let FacePoint { face, barycentric } = point;
        json!({"face": face, "barycentric": barycentric, "position": point.position(mesh).to_array()})
    };
    points.iter().map(corner).collect()
}
