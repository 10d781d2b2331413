//! What a file holds: counts, topology, defects, sizes of parts.
//!
//! Every description is serialised with the keys of `ndf info --json`.

mod checkpoint;
mod mesh;
mod model;
mod surface;

use ndf_core::BoundingBox;
use serde::Serialize;

pub use checkpoint::CheckpointDescription;
pub use mesh::{Delaunay, MeshDescription};
pub use model::{ModelBytes, ModelDescription};
pub(crate) use surface::in_words;
pub use surface::{CloudDescription, NetworkDescription, SplatsDescription};

use crate::note::Note;

/// What a file holds, and what a user should know of it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Described {
    /// What it holds.
    pub description: Description,
    /// What was left out, changed or is doubtful.
    pub notes: Vec<Note>,
}

/// What a file holds.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Description {
    /// A mesh, or points in a mesh file.
    Mesh(MeshDescription),
    /// Points.
    Cloud(CloudDescription),
    /// A network.
    Network(NetworkDescription),
    /// Gaussian splats.
    Splats(SplatsDescription),
    /// A model.
    Model(ModelDescription),
    /// A run that is not finished.
    Checkpoint(CheckpointDescription),
}

/// The corners of a box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Corners {
    /// Least coordinates.
    pub min: [f64; 3],
    /// Greatest coordinates.
    pub max: [f64; 3],
}

impl From<BoundingBox> for Corners {
    fn from(bounds: BoundingBox) -> Self {
        Self { min: bounds.min.to_array(), max: bounds.max.to_array() }
    }
}
