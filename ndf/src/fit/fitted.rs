//! What a run gives.

use ndf_mesh::ManifoldMesh;
use ndf_meshing::BaseMeshReport;
use ndf_model::Model;
use ndf_train::{Checkpoint, FitReport, MetricReport};

use crate::band::BandFigures;
use crate::{Kind, Level, Note};

/// A model with the figures of its making.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Fitted {
    /// The model.
    pub model: Model,
    /// Figures of the training. Its distances are in the box [-1.5, 1.5]³ that the base mesh fills;
    /// [`distance_rms`](Self::distance_rms) has them in the surface's units.
    pub report: FitReport,
    /// What represents the surface that was learned.
    pub kind: Kind,
    /// The level of its field, where that was chosen.
    pub level: Option<Level>,
    /// The base mesh from which the field was learned, in the surface's units: the one that the model keeps, but for a
    /// field of levels, which keeps control vertices.
    pub base: ManifoldMesh,
    /// How it came about, where it was made.
    pub base_report: Option<BaseMeshReport>,
    /// How far the cached copy of the field was right, where there was one.
    pub band: Option<BandFigures>,
    /// How the metric of the model was measured, where it has one.
    pub metric_report: Option<MetricReport>,
    /// Enough to go on: from the end, or from where the run was interrupted.
    pub checkpoint: Checkpoint,
    /// What was left out, or is doubtful.
    pub notes: Vec<Note>,
}

impl Fitted {
    /// Mean distance of the learned surface from the true one, in its units.
    pub fn distance_mean(&self) -> f64 {
        self.model.similarity.length_to_world(self.report.projection_mean)
    }

    /// Root of the mean squared distance of the learned surface from the true one, in its units.
    pub fn distance_rms(&self) -> f64 {
        self.model.similarity.length_to_world(self.report.projection_rms)
    }

    /// The largest of these distances.
    pub fn distance_max(&self) -> f64 {
        self.model.similarity.length_to_world(self.report.projection_max)
    }
}
