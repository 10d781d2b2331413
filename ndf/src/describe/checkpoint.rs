//! Checkpoints.

use ndf_train::levels::Sharpness;
use ndf_train::{Checkpoint, Learning};
use serde::Serialize;

/// A run that is not finished.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct CheckpointDescription {
    /// `checkpoint`.
    pub kind: &'static str,
    /// `network` or `levels`.
    pub field: &'static str,
    /// Epochs or iterations made.
    pub rounds: usize,
    /// Those to be made.
    pub of: usize,
    /// Vertices of the base mesh.
    pub base_vertices: usize,
    /// Its faces.
    pub base_faces: usize,
    /// Of levels: what is still tried side by side.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub runs: Vec<Sharpness>,
    /// Of levels that are searched by distance: the mean distance that is wanted, as a share of the diagonal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wanted: Option<f64>,
    /// And the sizes that were tried before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attempts: Option<usize>,
}

impl CheckpointDescription {
    /// What a checkpoint holds.
    pub fn of(checkpoint: &Checkpoint) -> Self {
        let [rounds, of] = checkpoint.rounds();
        let (field, base, levels) = match &checkpoint.learning {
            Learning::Levels(levels) => ("levels", levels.base(), Some(levels)),
            Learning::Network(network) => ("network", network.model().field.base(), None),
        };
        let search = levels.and_then(|levels| levels.search.as_ref());
        Self {
            kind: "checkpoint",
            field,
            rounds,
            of,
            base_vertices: base.vertex_count(),
            base_faces: base.face_count(),
            runs: levels.map_or_else(Vec::new, |levels| levels.runs()),
            wanted: search.map(|search| search.wanted),
            attempts: search.map(|search| search.attempts.len()),
        }
    }
}
