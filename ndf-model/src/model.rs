//! Everything that a model file holds.

use crate::displacement_field::DisplacementField;
use crate::metric::Metric;
use crate::scalars::SurfaceScalars;
use crate::similarity::Similarity;

/// A displacement field, the similarity to the user's units, the metric of the true surface, scalars on the surface, and
/// where they came from.
#[derive(Clone, Debug)]
pub struct Model {
    /// The field, in the normalised box.
    pub field: DisplacementField,
    /// From the user's units to the box.
    pub similarity: Similarity,
    /// How much longer lengths on the true surface are, where that was measured.
    pub metric: Option<Metric>,
    /// Scalar fields over the base mesh, in the order in which they were learned.
    pub scalars: Vec<SurfaceScalars>,
    /// How the model was made, as a JSON object: settings, seed, version, metrics. Opaque here.
    pub provenance: String,
}
