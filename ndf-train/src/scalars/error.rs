//! Why scalar fields were not learned.

use ndf_core::progress::Cancelled;
use ndf_model::scalars::ScalarsError;

use crate::settings::SettingsError;
use ndf_mesh::Face;

/// Why scalar fields were not learned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ScalarError {
    /// The settings do not make sense.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// A field that has not a value for every vertex.
    #[error("the scalar field {name} has {values} values for {vertices} vertices")]
    Length {
        /// Its name.
        name: String,
        /// How many values it has.
        values: usize,
        /// How many vertices the mesh has.
        vertices: usize,
    },
    /// Values that are NaN or infinite.
    #[error("{count} of the {vertices} values of the scalar field {name} are not finite")]
    NotFinite {
        /// Its name.
        name: String,
        /// How many.
        count: usize,
        /// How many vertices the mesh has.
        vertices: usize,
    },
    /// The mesh of the values has no area.
    #[error("the mesh of the values has no area")]
    NoArea,
    /// The base mesh has no area.
    #[error("the base mesh of the model has no area")]
    NoBaseArea,
    /// The model's field is not finite.
    #[error("the field of the model is not finite on base face {0}")]
    FieldNotFinite(Face),
    /// The mesh of the values is somewhere else.
    #[error(
        "the mesh of the values is not one of the model's surface: it is {distance:.3} away (root mean square)"
    )]
    Far {
        /// Root of the mean squared distance, in the user's units.
        distance: f64,
    },
    /// The loss became NaN or infinite.
    #[error("training diverged in epoch {epoch}; try a smaller learning rate")]
    Diverged {
        /// The epoch.
        epoch: usize,
    },
    /// The observer asked to stop.
    #[error("interrupted before the scalars were learned; nothing of them is kept")]
    Cancelled(#[from] Cancelled),
    /// The fields cannot be stored.
    #[error(transparent)]
    Stored(#[from] ScalarsError),
}
