//! `ndf measure`: how far a mesh is from a reference.

use std::path::{Path, PathBuf};

use clap::Args;
use ndf::TriangleMesh;
use ndf::figures::MeasureFigures;
use ndf_mesh::metrics::{Distances, MeasureError, MeasureOptions};

use crate::arguments::EdgeLength;
use crate::context::Context;
use crate::files::{model_mesh, read_faces};
use crate::output::{Failure, Outcome, readable, table};
use crate::streams::input_file;

/// Arguments of `ndf measure`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The reference: a mesh, or a model of which one is made.
    #[arg(value_parser = input_file())]
    reference: PathBuf,
    /// The mesh to compare with it, or a model.
    #[arg(value_parser = input_file())]
    mesh: PathBuf,
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

/// Tells of the share of the faces of a mesh that cannot be measured.
fn warn_of_left_out(path: &Path, left_out: f64, context: &Context) {
    if left_out > 0.0 {
        let (name, percent) = (path.display(), 100.0 * left_out);
        context.warn(&format!(
            "{name}: {percent:.1} % of the faces have corners that are not finite, and are left out"
        ));
    }
}

/// Measures two meshes against each other.
///
/// # Errors
/// If one cannot be read, or has no area.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    context.expect(&["extraction", "measuring"]);
    let reference = mesh_of(&arguments.reference, arguments.edge_length, context)?;
    let mesh = mesh_of(&arguments.mesh, arguments.edge_length, context)?;
    let options = MeasureOptions { samples: arguments.samples as usize, seed: context.seed() };
    let found = MeasureFigures::of(&reference, &mesh, &options, &context.progress()).map_err(|error| {
        let path = match error {
            MeasureError::Reference => &arguments.reference,
            MeasureError::Mesh | MeasureError::NoSamples | MeasureError::Cancelled(_) => &arguments.mesh,
        };
        Failure::new(format!("cannot measure {}: {error}", path.display()))
            .try_instead("ndf info lists what is wrong with it")
    })?;
    warn_of_left_out(&arguments.reference, found.area_left_out.reference, context);
    warn_of_left_out(&arguments.mesh, found.area_left_out.mesh, context);
    let share = |length: f64| {
        format!("{} ({:.4} % of the diagonal)", readable(length), 100.0 * length / found.diagonal)
    };
    let line =
        |d: Distances| format!("mean {}, rms {}, max {}", readable(d.mean), readable(d.rms), readable(d.max));
    let text = table(&[
        ("reference → mesh", line(found.reference_to_mesh)),
        ("mesh → reference", line(found.mesh_to_reference)),
        ("Hausdorff", share(found.hausdorff)),
        ("normals", format!("{:.3}° apart on average", found.normal_deg_mean)),
        ("flipped", format!("{:.4} %", 100.0 * found.flipped_fraction)),
    ]);
    Ok(Outcome::new(serde_json::to_value(&found)?, text))
}
