//! `ndf remesh`: triangles of another size.

use std::time::Instant;

use clap::{ArgGroup, Args, ValueEnum};
use ndf_intrinsic::remesh_intrinsically;
use ndf_meshing::{IsotropicError, IsotropicOptions, remesh_isotropically, remesh_within};
use ndf_model::Similarity;

use crate::arguments::{MeshToMesh, crease, length, share};
use crate::context::Context;
use crate::output::{Failure, Outcome, grouped, readable, table};
use crate::remeshed::{carried_scalars, measured, mended_scalars, not_within, read_manifold, sampling, told};

/// Arguments of `ndf remesh`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("goal").args(["edge_length", "relative_edge_length", "error"]).required(true)))]
pub struct Arguments {
    #[command(flatten)]
    meshes: MeshToMesh,
    /// About how long the edges are, in the input's units.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length)]
    edge_length: Option<f64>,
    /// The same in the box [-1.5, 1.5]³ that the mesh fills.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length)]
    relative_edge_length: Option<f64>,
    /// Edges as long as the distance allows, of all samples and vertices of either mesh from the other, such as 0.1%: a share
    /// of the diagonal of the bounds.
    #[arg(long, value_name = "X", value_parser = share)]
    error: Option<f64>,
    /// How triangles are made.
    #[arg(long, value_enum, default_value_t)]
    method: Method,
    /// Keep edges at which the normals of the faces are more than so many degrees apart. Boundaries are kept anyway.
    #[arg(long, value_name = "DEG", value_parser = crease)]
    creases: Option<f64>,
    /// How often edges are split, collapsed and flipped and vertices moved.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
}

/// How triangles are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Method {
    /// Edges are split, collapsed and flipped, and vertices moved over the surface.
    #[default]
    Isotropic,
    /// All vertices stay, and others come onto the surface, until intrinsic Delaunay triangles have angles of 25° and edges about as long.
    Intrinsic,
}

/// Remeshes.
///
/// # Errors
/// If the input is no mesh that can be mended, the edges would make too many faces, or the mesh cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let MeshToMesh { input, output, .. } = &arguments.meshes;
    arguments.meshes.check()?;
    if arguments.method == Method::Intrinsic && (arguments.error.is_some() || arguments.creases.is_some()) {
        return Err(Failure::new("--method intrinsic takes neither --error nor --creases").try_instead(
            "give it --edge-length; its vertices are on the surface, and creases stay where edges are short",
        ));
    }
    context.expect(&["isotropic remeshing"]);
    let (file, mended) = read_manifold(&arguments.meshes, context)?;
    let mesh = &mended.mesh;
    let started = Instant::now();
    let relative = |h| Similarity::from_bounds(&mesh.bounds()).length_to_world(h);
    let edge_length = arguments.edge_length.or_else(|| arguments.relative_edge_length.map(relative));
    let options = IsotropicOptions {
        edge_length: edge_length.unwrap_or(f64::INFINITY),
        rounds: arguments.rounds,
        crease_angle: arguments.creases.map(f64::to_radians),
    };
    let (found, edge_length, distances) = match arguments.error {
        Some(share) => {
            let distance = share * mesh.bounds().diagonal();
            let found = remesh_within(mesh, distance, &options, &sampling(context), &context.progress());
            found.map_err(|error| not_within(input, error))?
        }
        None if arguments.method == Method::Intrinsic => {
            let found = remesh_intrinsically(mesh, options.edge_length, &context.progress());
            let found = found.map_err(|error| Failure::new(format!("{}: {error}", input.display())))?;
            let distances = measured(input, mesh, &found, context)?;
            (found, options.edge_length, distances)
        }
        None => {
            let found = remesh_isotropically(mesh, None, &options, &context.progress());
            let found = found.map_err(|error| {
                let failure = Failure::new(format!("{}: {error}", input.display()));
                match error {
                    IsotropicError::EdgeLength(_) => failure.try_instead("ask for longer edges"),
                    IsotropicError::Cancelled(cancelled) => Failure::new(cancelled.to_string()),
                }
            })?;
            let distances = measured(input, mesh, &found, context)?;
            (found, options.edge_length, distances)
        }
    };
    let seconds = started.elapsed().as_secs_f64();
    let scalars = carried_scalars(mesh, &mended_scalars(&file, &mended), found.positions());
    context.write_mesh(output, &found, &scalars)?;
    let (mut json, mut rows) = told(&found, &distances, seconds, context)?;
    json["faces_before"] = mesh.face_count().into();
    json["target_edge_length"] = edge_length.into();
    json["area_left_out"] = mended.area_left_out.into();
    rows.insert(2, ("wanted edge length", readable(edge_length)));
    let text = format!(
        "{}: {} faces, from {}\n{}",
        output.display(),
        grouped(found.face_count()),
        grouped(mesh.face_count()),
        table(&rows)
    );
    Ok(Outcome::new(json, text))
}
