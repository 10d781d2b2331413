//! What models weigh and what that costs.

use clap::ValueEnum;
use ndf::presets::levels_of_size;
use ndf::{EdgeLength, Field, Fit, LengthFactors, NoProgress, Opened, Triangulated};
use ndf_model::file::SectionSizes;
use serde::{Deserialize, Serialize};

use super::reference::{Errors, Reference};
use crate::performance::process::timed;
use crate::rows::Row;

/// What displaces the base mesh, and how its numbers are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Kind {
    /// A network in single precision
    Single,
    /// A network as in the default preset
    Rounded,
    /// Levels
    Levels,
}

/// A model: bytes of its parts, and errors as shares of 1. Models that were measured before there were some figures do not
/// have them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct ModelRow {
    pub(super) mesh: String,
    pub(super) model: Kind,
    pub(super) base_faces: usize,
    /// The bytes that were asked for.
    pub(super) size: Option<usize>,
    pub(super) base: usize,
    pub(super) features: usize,
    pub(super) network: usize,
    pub(super) levels: usize,
    pub(super) bytes: usize,
    pub(super) mean: f64,
    pub(super) max: f64,
    pub(super) normal_degrees: Option<f64>,
    pub(super) area: Option<f64>,
    pub(super) flipped: Option<f64>,
    pub(super) geodesic: f64,
    pub(super) eigenvalues: f64,
    /// With lengths corrected by the metric of the model.
    pub(super) geodesic_corrected: Option<f64>,
    pub(super) eigenvalues_corrected: Option<f64>,
    pub(super) seconds: Option<f64>,
}

impl Row for ModelRow {
    fn key(&self) -> String {
        key(&self.mesh, self.model, self.size.unwrap_or(self.base_faces))
    }
}

/// What tells a model from others: for a network `asked` is the faces of its base mesh, for levels the bytes.
pub(super) fn key(mesh: &str, model: Kind, asked: usize) -> String {
    format!("{mesh} {model:?} {asked}")
}

/// Fits a model and measures its mesh.
pub(super) fn measured(
    name: &str,
    opened: &Opened,
    reference: &Reference,
    (kind, asked): (Kind, usize),
    edge_length: f64,
) -> Result<ModelRow, String> {
    let fit = Fit::new(opened).field(Field::Network);
    let (fit, size) = match kind {
        Kind::Single => (fit.with(|settings| settings.precision = None).base_faces(asked), None),
        Kind::Rounded => (fit.base_faces(asked), None),
        Kind::Levels => (fit.levels(levels_of_size(asked)), Some(asked)),
    };
    let (seconds, fitted) = timed(|| fit.run());
    let model = fitted.map_err(|e| e.to_string())?.model;
    let base_faces = size.map_or(asked, |_| model.field.base().face_count());
    let surface = Triangulated::from_model(&model, EdgeLength::Relative(edge_length), &NoProgress);
    let surface = surface.map_err(|e| e.to_string())?;
    let factors = surface.factors.unwrap_or(LengthFactors::ONE);
    let mesh = surface.manifold().map_err(ToString::to_string)?;
    let Errors { mean, max, normal_degrees, area, flipped, geodesic, eigenvalues } =
        reference.errors(mesh, factors)?;
    let corrected = |error: f64| model.metric.map(|_| error);
    let SectionSizes { base, features, network, levels, total: bytes, .. } = model.section_sizes();
    Ok(ModelRow {
        mesh: name.to_owned(),
        model: kind,
        base_faces,
        size,
        base,
        features,
        network,
        levels,
        bytes,
        mean,
        max,
        normal_degrees: Some(normal_degrees),
        area: Some(area),
        flipped: Some(flipped),
        geodesic: geodesic[0],
        eigenvalues: eigenvalues[0],
        geodesic_corrected: corrected(geodesic[1]),
        eigenvalues_corrected: corrected(eigenvalues[1]),
        seconds: Some(seconds),
    })
}
