//! What was opened, in figures.

use ndf::{EdgeLength, Model};
use ndf_mesh::io::VertexScalars;
use serde::Serialize;

/// What was opened. Lengths are in the units of the file.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Description {
    /// The file.
    pub name: String,
    /// `model` or `mesh`.
    pub kind: &'static str,
    /// Bytes of the file.
    pub bytes: usize,
    /// The edge length with which a model is extracted if none is given.
    pub default_edge_length: Option<f64>,
    /// The mean length of the edges of a model's base mesh.
    pub base_edge_length: Option<f64>,
    /// About the shortest edges with which a mesh of a model can be extracted, estimated from the mesh that is computed on.
    pub min_edge_length: Option<f64>,
    /// An edge length in the units of the file is this many times the one in the box [-1.5, 1.5]³ of a model.
    pub scale: Option<f64>,
    /// What lengths of geodesics are multiplied by, where a model carries the metric of what it was learned from.
    pub distance_factor: Option<f64>,
    /// The scalars that are stored.
    pub scalars: Vec<Range>,
    /// What was repaired or is doubtful, a sentence each.
    pub notes: Vec<String>,
}

/// A stored scalar.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Range {
    /// Its name.
    pub name: String,
    /// Its least finite value.
    pub min: f32,
    /// Its greatest finite value.
    pub max: f32,
}

impl Range {
    /// Of values. If none is finite, the range is empty: from +∞ to −∞.
    pub(crate) fn of(scalar: &VertexScalars) -> Self {
        let finite = scalar.values.iter().copied().filter(|value| value.is_finite());
        let (min, max) =
            finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        Self { name: scalar.name.clone(), min, max }
    }
}

/// The edge lengths of a model: the default, the base mesh's, and the scale.
pub(crate) fn lengths(model: &Model) -> [f64; 3] {
    let scale = model.similarity.length_to_world(1.0);
    [EdgeLength::default().world(model), EdgeLength::OfBase(1.0).world(model), scale]
}
