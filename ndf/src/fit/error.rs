//! Why nothing was learned.

use ndf_meshing::BaseMeshError;
use ndf_surfaces::narrow_band::BandError;
use ndf_train::TrainError;
use ndf_train::levels::LevelFitError;

use crate::base::NoBaseMesh;

/// Why nothing was learned.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// There is no base mesh.
    #[error(transparent)]
    NoBaseMesh(NoBaseMesh),
    /// The field could not be cached around the base mesh.
    #[error("the field around the base mesh cannot be sampled: {0}")]
    Band(BandError),
    /// The base mesh that was brought is nowhere near the surface.
    #[error(
        "the base mesh is {distance:.3} from the surface on average, farther than one of them is wide; check that both are in \
         the same units and in the same place"
    )]
    BaseFar {
        /// The mean distance of its vertices, in the units of the surface.
        distance: f64,
    },
    /// Training did not end well.
    #[error(transparent)]
    Training(#[from] TrainError),
    /// Levels could not be learned.
    #[error(transparent)]
    Levels(LevelFitError),
    /// Anchors, terms and settings are those of networks.
    #[error("a field of levels has no {0}; learn a network instead")]
    NotOfLevels(&'static str),
    /// The run to go on from learned another surface, or the same one read in another way.
    #[error("the checkpoint is of a run that learned another surface, or this one read with other options")]
    OtherSurface,
    /// The observer asked to stop before training began, so that there is nothing to keep.
    #[error("interrupted before training began")]
    Cancelled,
}

impl From<LevelFitError> for FitError {
    fn from(error: LevelFitError) -> Self {
        match error {
            LevelFitError::Cancelled(_) => Self::Cancelled,
            error => Self::Levels(error),
        }
    }
}

impl From<NoBaseMesh> for FitError {
    fn from(error: NoBaseMesh) -> Self {
        match error {
            NoBaseMesh::Making(BaseMeshError::Cancelled) => Self::Cancelled,
            error => Self::NoBaseMesh(error),
        }
    }
}

impl From<BandError> for FitError {
    fn from(error: BandError) -> Self {
        match error {
            BandError::Cancelled => Self::Cancelled,
            error => Self::Band(error),
        }
    }
}
