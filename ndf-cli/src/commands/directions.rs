//! `ndf directions`: smooth fields of vectors, lines and crosses.

use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};
use ndf::{Alignment, DVec3};
use ndf_mesh::io::{VertexScalars, format_to_write};
use serde_json::json;

use crate::arguments::{Sources, TriangulationArguments};
use crate::context::Context;
use crate::output::{Failure, Outcome, check_output, grouped, readable, table};
use crate::streams::output_file;
use crate::triangulation::{no_field, read_triangulation};

/// The properties that hold the vectors.
pub const PROPERTIES: [&str; 3] = ["direction_x", "direction_y", "direction_z"];

/// Arguments of `ndf directions`.
#[derive(Args, Debug)]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    /// The mesh to write, with one direction at every vertex as `direction_x`, `direction_y` and `direction_z` (.ply, .glb; other formats
    /// hold no scalars).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    output: PathBuf,
    /// Directions at every vertex, at equal angles: 1 for vectors, 2 for lines, 4 for crosses.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=16))]
    symmetry: u32,
    /// What the field follows. With --source it leads away from the sources [default: nothing, as smooth as can be].
    #[arg(long, value_enum, conflicts_with_all = ["source", "source_vertex"])]
    align: Option<Align>,
    #[command(flatten)]
    sources: Sources,
}

/// What fields follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Align {
    /// The direction of the largest principal curvature; for an even symmetry.
    Curvature,
}

/// Computes a direction field.
///
/// # Errors
/// If the input is no usable triangulation, the field is not found, or the mesh cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let Arguments { triangulation, output, symmetry, align, sources } = arguments;
    if *align == Some(Align::Curvature) && symmetry % 2 == 1 {
        return Err(Failure::new("lines of curvature have no sides, so that vectors cannot follow them")
            .try_instead("--symmetry 2 for lines, or 4 for crosses"));
    }
    format_to_write(output)?;
    check_output(output, &[&triangulation.input])?;
    context.expect(&["extraction", "factoring", "smoothest field"]);
    let read = read_triangulation(triangulation, sources.only_of_meshes(), context)?;
    let started = Instant::now();
    let alignment = match (align, sources.places()) {
        (Some(Align::Curvature), _) => Alignment::Curvature,
        (None, places) if places.is_empty() => Alignment::Free,
        (None, places) => Alignment::AwayFrom(places),
    };
    let input = &triangulation.input;
    let fields = read.surface.fields().map_err(|error| no_field(input, error))?;
    let found = fields.directions(*symmetry, &alignment, &context.progress());
    let found = found.map_err(|error| no_field(input, error))?;
    let seconds = started.elapsed().as_secs_f64();
    found.notes.iter().for_each(|note| context.warn_of(&input.display(), note));
    let mesh = read.surface.mesh();
    context.write_mesh(output, mesh, &vector_scalars(PROPERTIES, &found.vectors))?;
    let mut json = json!({
        "seconds": seconds,
        "vertices": mesh.vertex_count(),
        "symmetry": symmetry,
        "singularities": found.singularities.len(),
        "singular_points": found.singularities,
        "index_sum": found.index_sum,
        "energy": found.field.energy,
        "area_left_out": read.surface.area_left_out,
    });
    let mut rows = vec![
        ("vertices", grouped(mesh.vertex_count())),
        ("singularities", grouped(found.singularities.len())),
        ("sum of indices", readable(found.index_sum)),
        ("time", format!("{seconds:.2} s")),
    ];
    read.tell_metric(|factors| factors.distances, &mut json, &mut rows);
    read.tell(triangulation, &mut json, &mut rows);
    let what = match symmetry {
        1 => "vectors".to_owned(),
        2 => "lines".to_owned(),
        4 => "crosses".to_owned(),
        n => format!("fields of {n} directions"),
    };
    Ok(Outcome::new(json, format!("{}: {what}\n{}", output.display(), table(&rows))))
}

/// Vectors as three properties.
pub fn vector_scalars(names: [&str; 3], vectors: &[DVec3]) -> Vec<VertexScalars> {
    let tuples: Vec<[f64; 3]> = vectors.iter().map(DVec3::to_array).collect();
    VertexScalars::of_tuples(names, &tuples)
}
