//! What geodesics and spectra are computed on: a mesh, the mesh of a model, or that of a model which is fitted first.

use std::path::Path;

use ndf::files::NoMesh;
use ndf::{
    DistanceError, FieldError, Fit, Kind, LengthFactors, NoTriangulation, SurfaceFieldError, Triangulated,
};
use serde_json::{Value, json};

use crate::arguments::TriangulationArguments;
use crate::context::Context;
use crate::files::{LARGEST, no_mesh, no_model, open};
use crate::interrupt;
use crate::learning::{STAGES, learned};
use crate::output::{Failure, grouped, readable};

/// A triangulation, and how it was come by.
pub struct Found {
    /// The triangulation.
    pub surface: Triangulated,
    /// The figures of the model that was fitted first, where that was needed.
    fitted: Option<Value>,
}

/// Reads what geodesics and spectra are computed on: a mesh, repaired to a manifold, or, where that cannot be, its usable
/// triangles; or the mesh of a model. Of any other surface a model is fitted, unless something was asked for that only
/// meshes have.
///
/// # Errors
/// If the input cannot be read, fitting fails, or something of meshes was asked for of another kind of surface.
pub fn read_triangulation(
    arguments: &TriangulationArguments,
    only_of_meshes: Option<&str>,
    context: &Context,
) -> Result<Found, Failure> {
    let path = &arguments.input;
    let name = path.display();
    let length = arguments.edge_length.get();
    let kind = arguments.reading.kind.filter(|&kind| kind != Kind::Mesh);
    let opened = match kind {
        Some(_) => None,
        None => Some(Triangulated::open(path, length, &arguments.repair(), &context.progress())),
    };
    let (mut surface, fitted) = match opened {
        Some(Ok(surface)) => (surface, None),
        Some(Err(NoTriangulation::Mesh(NoMesh::Other { what, .. }))) if what != "a checkpoint" => {
            fitted_first(arguments, what, only_of_meshes, context)?
        }
        None => fitted_first(arguments, "no mesh", only_of_meshes, context)?,
        Some(Err(error)) => {
            return Err(match error {
                NoTriangulation::Mesh(error) => no_mesh(&error),
                NoTriangulation::Model(error) => no_model(&error),
                NoTriangulation::LeftOut { .. } => Failure::new(error.to_string()).try_instead(LARGEST),
                error => error.into(),
            });
        }
    };
    surface.notes.iter().for_each(|note| context.warn_of(&name, note));
    if arguments.no_metric {
        surface.factors = None;
    }
    Ok(Found { surface, fitted })
}

/// The mesh of a model that is fitted, and figures of that.
fn fitted_first(
    arguments: &TriangulationArguments,
    what: &str,
    only_of_meshes: Option<&str>,
    context: &Context,
) -> Result<(Triangulated, Option<Value>), Failure> {
    let path = &arguments.input;
    let name = path.display();
    if let Some(asked) = only_of_meshes {
        return Err(Failure::new(format!("{name} is {what}, and {asked}")));
    }
    context.expect(&STAGES);
    context.tell(&format!("{name} is {what}: a model is fitted first and not kept (`ndf fit` keeps one)"));
    let opened = open(path, &arguments.parts.opening(&arguments.reading)?, context)?;
    let fitted = learned(Fit::new(&opened).seed(context.seed()), path, None, context)?;
    if interrupt::is_requested() {
        return Err(Failure::new("interrupted"));
    }
    let length = arguments.edge_length.get().unwrap_or_default();
    let surface = Triangulated::from_model(&fitted.model, length, &context.progress())
        .map_err(|e| Failure::new(format!("{name}: {e}")))?;
    let figures = json!({
        "kind": fitted.kind,
        "seconds": fitted.report.seconds,
        "distance_rms": fitted.distance_rms(),
        "model_bytes": fitted.model.section_sizes().total,
    });
    Ok((surface, Some(figures)))
}

/// Why there are no distances on an input.
pub fn no_distances(input: &Path, error: DistanceError) -> Failure {
    let name = input.display();
    match error {
        DistanceError::NoVertex { vertex, vertices } => {
            let failure = Failure::new(format!("{name} has no vertex {vertex}"));
            failure.try_instead(&format!("its vertices are 0 to {}", vertices - 1))
        }
        DistanceError::NotManifold(_) => {
            let failure = Failure::new(format!("{name} is {error}, over which no distances are defined"));
            failure.try_instead(MESHED)
        }
        DistanceError::NoPoint(_) => error.into(),
        error => Failure::new(format!("{name}: {error}")),
    }
}

/// Why there is no field on an input.
pub fn no_field(input: &Path, error: SurfaceFieldError) -> Failure {
    let name = input.display();
    match error {
        SurfaceFieldError::Place(error) => no_distances(input, error),
        SurfaceFieldError::NotManifold(_) => Failure::new(format!("{name} is {error}")).try_instead(MESHED),
        SurfaceFieldError::Field(FieldError::Cancelled(cancelled)) => Failure::new(cancelled.to_string()),
        SurfaceFieldError::Field(error) => Failure::new(format!("{name}: {error}")),
        error => Failure::new(format!("{name}: {error}")),
    }
}

/// What helps where a mesh is no manifold.
const MESHED: &str = "`ndf mesh` makes a manifold around what it encloses";

impl Found {
    /// Tells by what lengths were multiplied, where the model has a metric: `factor` is the one of them that counted.
    pub fn tell_metric(
        &self,
        factor: impl Fn(LengthFactors) -> f64,
        json: &mut Value,
        rows: &mut Vec<(&str, String)>,
    ) {
        if let Some(factors) = self.surface.factors {
            json["metric"] = json!(factors);
            rows.push(("metric", format!("lengths times {:.5}", factor(factors))));
        }
    }

    /// Tells of what was made to compute on.
    pub fn tell(&self, arguments: &TriangulationArguments, json: &mut Value, rows: &mut Vec<(&str, String)>) {
        if let Some(fitted) = &self.fitted {
            json["fitted"] = fitted.clone();
            let bytes = fitted["model_bytes"].as_u64().unwrap_or_default();
            let rms = fitted["distance_rms"].as_f64().unwrap_or_default();
            let model = format!("{} bytes, rms {} from the input", grouped(bytes as usize), readable(rms));
            rows.push(("fitted model", model));
        }
        if let Some(length) = self.surface.edge_length {
            json["target_edge_length"] = length.into();
            rows.push(("edge length", arguments.edge_length.in_words(length)));
        }
    }
}
