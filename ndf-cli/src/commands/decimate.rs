//! `ndf decimate`: fewer faces.

use std::time::Instant;

use clap::{ArgGroup, Args};
use ndf_meshing::{DecimationOptions, decimate, decimate_within};

use crate::arguments::{MeshToMesh, crease, share};
use crate::context::Context;
use crate::output::{Failure, Outcome, grouped, table};
use crate::remeshed::{carried_scalars, measured, mended_scalars, not_within, read_manifold, sampling, told};

/// Arguments of `ndf decimate`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("goal").args(["faces", "error"]).required(true)))]
pub struct Arguments {
    #[command(flatten)]
    meshes: MeshToMesh,
    /// The number of faces to reach.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    faces: Option<u32>,
    /// Go as far as the distance allows, of all samples and vertices of either mesh from the other, such as 0.1%: a share of
    /// the diagonal of the bounds.
    #[arg(long, value_name = "X", value_parser = share)]
    error: Option<f64>,
    /// Leave all vertices of the boundary where they are.
    #[arg(long)]
    lock_boundary: bool,
    /// Keep edges at which the normals of the faces are more than so many degrees apart.
    #[arg(long, value_name = "DEG", value_parser = crease)]
    creases: Option<f64>,
}

/// Decimates a mesh.
///
/// # Errors
/// If the input is no mesh that can be mended, or the mesh cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let MeshToMesh { input, output, .. } = &arguments.meshes;
    arguments.meshes.check()?;
    context.expect(&["decimation"]);
    let (file, mended) = read_manifold(&arguments.meshes, context)?;
    let mesh = &mended.mesh;
    let started = Instant::now();
    // No closed surface has fewer faces.
    let faces = arguments.faces.map_or(4, |faces| faces as usize);
    let options = DecimationOptions {
        keep_boundary: arguments.lock_boundary,
        crease_angle: arguments.creases.map(f64::to_radians),
        ..DecimationOptions::to_faces(faces)
    };
    let (found, distances) = match arguments.error {
        Some(share) => {
            let distance = share * mesh.bounds().diagonal();
            let found = decimate_within(mesh, distance, &options, &sampling(context), &context.progress());
            found.map_err(|error| not_within(input, error))?
        }
        None => {
            let found = decimate(mesh, &options, &context.progress());
            let distances = measured(input, mesh, &found.mesh, context)?;
            (found, distances)
        }
    };
    let left = found.mesh.face_count();
    if arguments.faces.is_some() && !found.reached {
        context.warn(&format!(
            "{}: decimation ended at {} faces; topology, shape and what is to be kept need them",
            input.display(),
            grouped(left)
        ));
    }
    let seconds = started.elapsed().as_secs_f64();
    let scalars = carried_scalars(mesh, &mended_scalars(&file, &mended), found.mesh.positions());
    context.write_mesh(output, &found.mesh, &scalars)?;
    let (mut json, rows) = told(&found.mesh, &distances, seconds, context)?;
    json["faces_before"] = mesh.face_count().into();
    json["reached"] = found.reached.into();
    json["area_left_out"] = mended.area_left_out.into();
    let text = format!(
        "{}: {} of {} faces\n{}",
        output.display(),
        grouped(left),
        grouped(mesh.face_count()),
        table(&rows)
    );
    Ok(Outcome::new(json, text))
}
