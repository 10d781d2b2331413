//! `ndf measure`: how far a mesh is from a reference.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use ndf_mesh::TriangleMesh;
use ndf_mesh::metrics::{Distances, MeasureError, MeasureOptions, measure};
use ndf_mesh::repair::finite_part;
use serde_json::json;

use crate::arguments::EdgeLength;
use crate::context::Context;
use crate::files::{model_mesh, read_faces};
use crate::output::{Failure, Outcome, readable, table};

/// Arguments of `ndf measure`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The reference: a mesh, or a model of which one is made.
    reference: PathBuf,
    /// The mesh to compare with it, or a model.
    mesh: PathBuf,
    #[command(flatten)]
    edge_length: EdgeLength,
    /// Samples on each mesh; vertices are measured too.
    #[arg(long, value_name = "N", default_value_t = 200_000, value_parser = clap::value_parser!(u32).range(1..=1_000_000_000))]
    samples: u32,
}

/// What can be measured of the mesh in a file, or of that of a model, and the share of its faces that cannot.
fn finite(path: &Path, length: EdgeLength, context: &Context) -> Result<(TriangleMesh, f64), Failure> {
    let mesh = match model_mesh(path, length, context)? {
        Some(found) => found.extracted.mesh.into_triangle_mesh(),
        None => read_faces(path, context)?.mesh,
    };
    let (finite, left_out) = finite_part(&mesh);
    if left_out > 0.0 && finite.face_count() > 0 {
        let (name, percent) = (path.display(), 100.0 * left_out);
        context.warn(&format!(
            "{name}: {percent:.1} % of the faces have corners that are not finite, and are left out"
        ));
    }
    Ok((finite, left_out))
}

/// Measures two meshes against each other.
///
/// # Errors
/// If one cannot be read, or has no area.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    context.expect(&["extraction"]);
    let (reference, reference_left_out) = finite(&arguments.reference, arguments.edge_length, context)?;
    let (mesh, mesh_left_out) = finite(&arguments.mesh, arguments.edge_length, context)?;
    let started = Instant::now();
    let options = MeasureOptions { samples: arguments.samples as usize, seed: context.seed() };
    let found = measure(&reference, &mesh, &options).map_err(|error| {
        let path = match error {
            MeasureError::Reference => &arguments.reference,
            MeasureError::Mesh | MeasureError::NoSamples => &arguments.mesh,
        };
        Failure::new(format!("cannot measure {}: {error}", path.display()))
            .try_instead("ndf info lists what is wrong with it")
    })?;
    let normals = found.normal_angle_mean.to_degrees();
    let mut json = serde_json::to_value(found)?;
    json.as_object_mut().and_then(|figures| figures.remove("normal_angle_mean"));
    json["unit"] = "input".into();
    json["normal_deg_mean"] = normals.into();
    json["area_left_out"] = json!({"reference": reference_left_out, "mesh": mesh_left_out});
    json["samples"] = arguments.samples.into();
    json["seconds"] = started.elapsed().as_secs_f64().into();
    let share = |length: f64| {
        format!("{} ({:.4} % of the diagonal)", readable(length), 100.0 * length / found.diagonal)
    };
    let line =
        |d: Distances| format!("mean {}, rms {}, max {}", readable(d.mean), readable(d.rms), readable(d.max));
    let text = table(&[
        ("reference → mesh", line(found.reference_to_mesh)),
        ("mesh → reference", line(found.mesh_to_reference)),
        ("Hausdorff", share(found.hausdorff)),
        ("normals", format!("{normals:.3}° apart on average")),
        ("flipped", format!("{:.4} %", 100.0 * found.flipped_fraction)),
    ]);
    Ok(Outcome::new(json, text))
}
