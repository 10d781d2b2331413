//! What is to be said of a model.

use ndf_mesh::ValidationReport;
use ndf_model::{Model, SurfaceScalars};
use serde::Serialize;

/// The parts of a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ModelDescription {
    /// `model`.
    pub kind: &'static str,
    /// Vertices of the base mesh.
    pub vertices: usize,
    /// Faces of the base mesh.
    pub faces: usize,
    /// Pieces of the base mesh.
    pub components: usize,
    /// V − E + F of the base mesh.
    pub euler_characteristic: i64,
    /// Edges of the base mesh with one face.
    pub boundary_edges: usize,
    /// Levels of displacements above the base mesh, where the field has no network.
    pub levels: Option<usize>,
    /// Features of every base vertex.
    pub features: usize,
    /// Weights and biases of the network.
    pub network_parameters: usize,
    /// Of the metric of the true surface, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metric: Option<MetricDescription>,
    /// Names of the scalars that are stored.
    pub scalars: Vec<String>,
    /// The point of the input that is the origin of the box.
    pub center: [f64; 3],
    /// Length in the box of a unit of the input.
    pub scale: f64,
    /// Bytes of the parts of the file.
    pub bytes: ModelBytes,
    /// How the model was made, where that can be read.
    pub provenance: Option<serde_json::Value>,
    /// All counts of the base mesh.
    #[serde(skip)]
    pub base: ValidationReport,
}

/// The metric that a model carries.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct MetricDescription {
    /// Area of the true surface, in squared units of the input.
    pub area: f64,
    /// The power of the mean stretch of lengths that distances take.
    pub exponent: f32,
}

/// Bytes of the parts of a model file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct ModelBytes {
    /// Base mesh.
    pub base: usize,
    /// Features.
    pub features: usize,
    /// Network.
    pub network: usize,
    /// Levels.
    pub levels: usize,
    /// Metric.
    pub metric: usize,
    /// Scalar fields.
    pub scalars: usize,
    /// The whole file.
    pub total: usize,
}

impl ModelBytes {
    /// Encodes a model to tell its sizes.
    pub(crate) fn of(model: &Model) -> Self {
        let sizes = model.section_sizes();
        Self {
            base: sizes.base,
            features: sizes.features,
            network: sizes.network,
            levels: sizes.levels,
            metric: sizes.metric,
            scalars: sizes.scalars,
            total: sizes.total,
        }
    }
}

impl ModelDescription {
    /// Examines a model.
    pub fn of(model: &Model) -> Self {
        let field = &model.field;
        let base = ValidationReport::of(field.base());
        let names = model.scalars.iter().flat_map(SurfaceScalars::channels).map(|c| c.name.clone());
        Self {
            kind: "model",
            vertices: base.vertices,
            faces: base.faces,
            components: base.components,
            euler_characteristic: base.euler_characteristic,
            boundary_edges: base.boundary_edges,
            levels: field.levels().map(|levels| levels.levels.len()),
            features: field.network().map_or(0, |network| network.shape().features),
            network_parameters: field.network().map_or(0, |network| network.mlp().parameters().len()),
            metric: model.metric.map(|metric| MetricDescription {
                area: f64::from(metric.area()) / model.similarity.scale().powi(2),
                exponent: metric.exponent(),
            }),
            scalars: names.collect(),
            center: model.similarity.center().to_array(),
            scale: model.similarity.scale(),
            bytes: ModelBytes::of(model),
            provenance: serde_json::from_str(&model.provenance).ok(),
            base,
        }
    }
}
