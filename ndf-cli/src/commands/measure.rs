//! `ndf measure`: how far a mesh, a model or points are from a reference.

use std::path::{Path, PathBuf};

use clap::Args;
use ndf::deviations::{deviations, signed_deviations};
use ndf::figures::MeasureFigures;
use ndf::files::NoMesh;
use ndf::{CloudOptions, DVec3, TriangleMesh, read_mesh};
use ndf_formats::point_cloud::read_cloud;
use ndf_mesh::io::{VertexScalars, format_to_write};
use ndf_mesh::metrics::{Distances, MeasureError, MeasureOptions};
use serde_json::{Value, json};

use crate::arguments::EdgeLength;
use crate::context::Context;
use crate::files::{model_mesh, no_mesh, read_faces, told_faces};
use crate::output::{Failure, Outcome, check_output, grouped, readable, table};
use crate::streams::{input_file, output_file};

/// Arguments of `ndf measure`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The reference: a mesh, or a model of which one is made.
    #[arg(value_parser = input_file())]
    reference: PathBuf,
    /// The mesh to compare with it, or a model, or a cloud of points.
    #[arg(value_parser = input_file())]
    mesh: PathBuf,
    /// Write what is compared with the distance of every vertex from the reference as `distance`; of points that is how far each is (.ply,
    /// .glb; other formats hold no scalars).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    output: Option<PathBuf>,
    /// Write distances with a sign, negative inside of the reference, as `signed_distance`.
    #[arg(long, requires = "output")]
    signed: bool,
    #[command(flatten)]
    edge_length: EdgeLength,
    /// Samples on each mesh; vertices are measured too.
    #[arg(long, value_name = "N", default_value_t = 200_000, value_parser = clap::value_parser!(u32).range(1..=1_000_000_000))]
    samples: u32,
}

/// The mesh in a file, or that of a model.
fn mesh_of(path: &Path, length: EdgeLength, context: &Context) -> Result<TriangleMesh, Failure> {
    Ok(match model_mesh(path, length, context)? {
        Some(found) => found.extracted.mesh.into_triangle_mesh(),
        None => read_faces(path, context)?.mesh,
    })
}

/// What is compared: a mesh, that of a model, or points, which are a mesh without faces.
fn compared(path: &Path, length: EdgeLength, context: &Context) -> Result<TriangleMesh, Failure> {
    if let Some(found) = model_mesh(path, length, context)? {
        return Ok(found.extracted.mesh.into_triangle_mesh());
    }
    match read_mesh(path) {
        Ok(file) => Ok(told_faces(path, file, context).mesh),
        Err(error @ (NoMesh::Other { .. } | NoMesh::NoFaces { .. })) => {
            let Ok(file) = read_cloud(path, &CloudOptions::default()) else { return Err(no_mesh(&error)) };
            let points = file.cloud.positions().to_vec();
            context.tell(&format!("{} is a cloud of {} points", path.display(), grouped(points.len())));
            Ok(TriangleMesh::new(points, Vec::new())?)
        }
        Err(error) => Err(no_mesh(&error)),
    }
}

/// Tells of the share of the faces of a mesh that cannot be measured.
fn warn_of_left_out(path: &Path, left_out: f64, context: &Context) {
    if left_out > 0.0 {
        let (name, percent) = (path.display(), 100.0 * left_out);
        context.warn(&format!(
            "{name}: {percent:.1} % of the faces have corners that are not finite, and are left out"
        ));
    }
}

/// Measures two surfaces against each other.
///
/// # Errors
/// If one cannot be read, or has no area, or the distances cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let Arguments { reference: reference_path, mesh: path, output, edge_length, .. } = arguments;
    if let Some(output) = output {
        format_to_write(output)?;
        check_output(output, &[reference_path, path])?;
    }
    context.expect(&["extraction", "measuring"]);
    let reference = mesh_of(reference_path, *edge_length, context)?;
    let mesh = compared(path, *edge_length, context)?;
    let options = MeasureOptions { samples: arguments.samples as usize, seed: context.seed() };
    let measured = match mesh.face_count() {
        0 => MeasureFigures::of_points(&reference, mesh.positions(), &options, &context.progress()),
        _ => MeasureFigures::of(&reference, &mesh, &options, &context.progress()),
    };
    let found = measured.map_err(|error| {
        let path = match error {
            MeasureError::Reference => reference_path,
            MeasureError::Mesh | MeasureError::NoSamples | MeasureError::Cancelled(_) => path,
        };
        Failure::new(format!("cannot measure {}: {error}", path.display()))
            .try_instead("ndf info lists what is wrong with it")
    })?;
    warn_of_left_out(reference_path, found.area_left_out.reference, context);
    warn_of_left_out(path, found.area_left_out.mesh, context);
    let mut json = serde_json::to_value(&found)?;
    if let Some(output) = output {
        write_deviations(output, &reference, &mesh, arguments.signed, context, &mut json)?;
    }
    let share = |length: f64| {
        format!("{} ({:.4} % of the diagonal)", readable(length), 100.0 * length / found.diagonal)
    };
    let line =
        |d: Distances| format!("mean {}, rms {}, max {}", readable(d.mean), readable(d.rms), readable(d.max));
    let [forth, back] = match mesh.face_count() {
        0 => ["reference → points", "points → reference"],
        _ => ["reference → mesh", "mesh → reference"],
    };
    let mut rows = vec![
        (forth, line(found.reference_to_mesh)),
        (back, line(found.mesh_to_reference)),
        ("Hausdorff", share(found.hausdorff)),
    ];
    rows.extend(found.normal_deg_mean.map(|angle| ("normals", format!("{angle:.3}° apart on average"))));
    rows.extend(found.flipped_fraction.map(|share| ("flipped", format!("{:.4} %", 100.0 * share))));
    rows.extend(output.as_ref().map(|path| ("distances", path.display().to_string())));
    Ok(Outcome::new(json, table(&rows)))
}

/// Writes what is compared with how far each vertex is from the reference.
fn write_deviations(
    output: &Path,
    reference: &TriangleMesh,
    mesh: &TriangleMesh,
    is_signed: bool,
    context: &Context,
    json: &mut Value,
) -> Result<(), Failure> {
    let positions: &[DVec3] = mesh.positions();
    let progress = context.progress();
    let (name, values) = match is_signed {
        true => ("signed_distance", signed_deviations(reference, positions, &progress)?),
        false => ("distance", deviations(reference, positions, &progress)?),
    };
    if is_signed {
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        let range = [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)];
        json["signed"] = json!({ "min": range[0], "max": range[1] });
    }
    let values = values.iter().map(|&value| value as f32).collect();
    context.write_mesh(output, mesh, &[VertexScalars { name: name.to_owned(), values }])?;
    Ok(())
}
