//! What can go wrong in training.

use ndf_model::NetworkError;

use crate::settings::SettingsError;

/// Why training did not end well.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// The settings do not make sense.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The base mesh has no area.
    #[error("the base mesh has no area")]
    NoArea,
    /// The base mesh does not make a field.
    #[error(transparent)]
    Field(#[from] NetworkError),
    /// A run is resumed with another objective.
    #[error("the checkpoint is of a run with the terms {expected}; this run has {found}")]
    OtherTerms {
        /// Names of the terms of the checkpoint.
        expected: String,
        /// Names of the terms of the run.
        found: String,
    },
    /// A run is resumed with another term of the same name, or at another weight.
    #[error("the term {0} is not the one with which the run of the checkpoint was begun")]
    OtherTerm(String),
    /// A loss became NaN, infinite or absurd.
    #[error(
        "training diverged in epoch {epoch}; try a base mesh that is closer to the surface, or a smaller learning rate"
    )]
    Diverged {
        /// The epoch.
        epoch: usize,
    },
    /// Too few samples have a foot.
    #[error(
        "only {share:.1} % of the base mesh projects onto the surface; check that both are in the same units"
    )]
    OutOfReach {
        /// Share of the samples with a foot, in percent.
        share: f64,
    },
}
