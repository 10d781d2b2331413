//! Scalar fields that are stored in a model.

use ndf_core::Progress;
use ndf_mesh::TriangleMesh;
use ndf_mesh::io::VertexScalars;
use ndf_model::{Model, SurfaceScalars};
use ndf_train::scalars::{
    ScalarError, ScalarFit, ScalarLevelOptions, ScalarReport, ScalarSettings, fit, fit_levels,
};
use serde::Serialize;
use serde_json::{Value, json};

use crate::Extracted;

/// Why no scalars were stored.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScalarsError {
    /// They could not be learned.
    #[error(transparent)]
    Learning(#[from] ScalarError),
    /// The observer asked to stop.
    #[error("interrupted after {epochs} of {of} epochs")]
    Cancelled {
        /// Epochs made.
        epochs: usize,
        /// Epochs wanted.
        of: usize,
    },
    /// A scalar of this name is there already, learned together with another that would be lost.
    #[error("it has a scalar {name} already, learned together with {with}; learn both again or neither")]
    Taken {
        /// The name.
        name: String,
        /// The other.
        with: String,
    },
}

/// Figures of scalars, as `ndf scalars fit --json` has them. Errors are shares of the range of the values; distances
/// are in the input's units.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ScalarFigures {
    /// Wall seconds.
    pub seconds: f64,
    /// Of these, spent on drawing samples.
    pub seconds_sampling: f64,
    /// Epochs made; on levels, sweeps.
    pub epochs: usize,
    /// Root of the mean of the scalars' squared errors.
    pub rms_error: f64,
    /// The largest error of all.
    pub max_error: f64,
    /// The scalars.
    pub scalars: Vec<ScalarFigure>,
    /// Features of every base vertex; on levels there are none.
    pub features: usize,
    /// Weights and biases of the network.
    pub network_parameters: usize,
    /// Nodes of the levels.
    pub nodes: usize,
    /// Root of the mean squared distance from the surface to the mesh of the values.
    pub distance_rms: f64,
    /// The largest of these distances.
    pub distance_max: f64,
    /// Bytes in the model file.
    pub bytes: usize,
}

/// Figures of one scalar.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ScalarFigure {
    /// Its name.
    pub name: String,
    /// Its least value.
    pub min: f32,
    /// Its greatest value.
    pub max: f32,
    /// Root of the mean squared error.
    pub rms_error: f64,
    /// The largest error.
    pub max_error: f64,
}

/// Learns scalars at the vertices of a mesh near the model's surface (in the same units) and stores them in the model,
/// in the place of earlier ones of the same names.
///
/// # Errors
/// If they cannot be learned or stored, or the observer asks to stop; then the model is as it was.
pub fn store_scalars(
    model: &mut Model,
    mesh: &TriangleMesh,
    scalars: &[VertexScalars],
    settings: &ScalarSettings,
    progress: &dyn Progress,
) -> Result<ScalarFigures, ScalarsError> {
    let ScalarFit { fields, report } = fit(model, mesh, scalars, settings, progress)?;
    if report.interrupted {
        return Err(ScalarsError::Cancelled { epochs: report.epochs, of: settings.epochs });
    }
    store(model, fields, &report, settings)
}

/// As [`store_scalars`], as integers on levels: the same error in a fraction of the bytes.
///
/// # Errors
/// If they cannot be found or stored, or the observer asks to stop; then the model is as it was.
pub fn store_scalars_on_levels(
    model: &mut Model,
    mesh: &TriangleMesh,
    scalars: &[VertexScalars],
    options: &ScalarLevelOptions,
    progress: &dyn Progress,
) -> Result<ScalarFigures, ScalarsError> {
    let ScalarFit { fields, report } = fit_levels(model, mesh, scalars, options, progress)?;
    store(model, fields, &report, options)
}

fn store(
    model: &mut Model,
    fields: SurfaceScalars,
    report: &ScalarReport,
    settings: &impl Serialize,
) -> Result<ScalarFigures, ScalarsError> {
    let figures = figures(&fields, report);
    put(model, fields)?;
    add_to_provenance(model, settings, &figures);
    Ok(figures)
}

/// The values of all scalars of a model at the vertices of a mesh extracted from it.
pub fn stored_scalars(model: &Model, extracted: &Extracted) -> Vec<VertexScalars> {
    let base = model.field.base();
    model.scalars.iter().flat_map(|fields| fields.columns(base, &extracted.origins)).collect()
}

fn put(model: &mut Model, fields: SurfaceScalars) -> Result<(), ScalarsError> {
    let is_new = |name: &str| fields.channels().iter().any(|c| c.name == name);
    for earlier in &model.scalars {
        let names = || earlier.channels().iter().map(|c| c.name.as_str());
        if let (Some(replaced), Some(lost)) = (names().find(|n| is_new(n)), names().find(|n| !is_new(n))) {
            return Err(ScalarsError::Taken { name: replaced.to_owned(), with: lost.to_owned() });
        }
    }
    model.scalars.retain(|earlier| !earlier.channels().iter().any(|c| is_new(&c.name)));
    model.scalars.push(fields);
    Ok(())
}

/// Notes in the model how its scalars were learned: briefly, since the file is small.
fn add_to_provenance(model: &mut Model, settings: &impl Serialize, figures: &ScalarFigures) {
    let mut provenance: Value = serde_json::from_str(&model.provenance).unwrap_or_else(|_| json!({}));
    let Some(object) = provenance.as_object_mut() else { return };
    let names: Vec<&str> = figures.scalars.iter().map(|s| s.name.as_str()).collect();
    let metrics = json!({"rms_error": figures.rms_error, "max_error": figures.max_error});
    let record = json!({"settings": settings, "scalars": names, "metrics": metrics});
    match object.entry("scalars").or_insert_with(|| json!([])) {
        Value::Array(records) => {
            // Of scalars that were replaced nothing is left to tell.
            records.retain(|earlier| {
                let mut told = earlier["scalars"].as_array().into_iter().flatten().filter_map(Value::as_str);
                !told.any(|name| names.contains(&name))
            });
            records.push(record);
        }
        other => *other = json!([record]),
    }
    model.provenance = provenance.to_string();
}

fn figures(fields: &SurfaceScalars, report: &ScalarReport) -> ScalarFigures {
    let overall = report.overall();
    let channels = fields.channels().iter().zip(&report.channels);
    let scalar = |(channel, error): (&ndf_model::scalars::Channel, &ndf_train::scalars::ChannelError)| {
        let [min, max] = channel.range;
        ScalarFigure { name: channel.name.clone(), min, max, rms_error: error.rms, max_error: error.max }
    };
    ScalarFigures {
        seconds: report.seconds,
        seconds_sampling: report.seconds_sampling,
        epochs: report.epochs,
        rms_error: overall.rms,
        max_error: overall.max,
        scalars: channels.map(scalar).collect(),
        features: fields.network().map_or(0, |network| network.shape().features),
        network_parameters: fields.network().map_or(0, |network| network.mlp().parameters().len()),
        nodes: fields.levels().map_or(0, |levels| levels.mesh().nesting.len()),
        distance_rms: report.distance_rms,
        distance_max: report.distance_max,
        bytes: fields.stored_bytes(),
    }
}
