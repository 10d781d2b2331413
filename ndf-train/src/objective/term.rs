//! What a term of the objective is.

use std::any::Any;

use ndf_core::DVec3;
use ndf_mesh::FacePoint;
use ndf_model::DisplacementField;
use ndf_network::Mlp;
use serde_json::Value;

use super::block::{Block, Gradients};
use super::target::FixedPoints;

/// What has to be computed for a term.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// [`Block::tangents`], and gradients by them.
    pub tangents: bool,
    /// Gradients by the interpolated features: [`Gradients::features`].
    pub feature_gradients: bool,
}

impl Needs {
    /// The tangents.
    pub const TANGENTS: Self = Self { tangents: true, feature_gradients: false };
}

/// What a term knows of the samples of a batch until they are projected again.
pub type Prepared = Box<dyn Any + Send + Sync>;

/// The samples of a batch when they are projected, in the order of the batch.
#[derive(Clone, Copy, Debug)]
pub struct Projecting<'a> {
    /// The field as the losses see it, over the stored base mesh.
    pub field: &'a DisplacementField,
    /// Where the samples are on that mesh.
    pub samples: &'a [FacePoint],
    /// Their images, normalised.
    pub images: &'a [DVec3],
}

/// A term of the objective: a mean over points of the base mesh.
///
/// All but two methods have defaults that do for a function of what a [`Block`] holds. [`Cycle`](super::Cycle) is an example
/// of the others: it learns a network of its own and looks for something at every projection.
pub trait Term: Send + Sync {
    /// Its name in logs and checkpoints. Terms of one name in several stages share a network.
    fn name(&self) -> &str;

    /// What has to be computed for it.
    fn needs(&self) -> Needs {
        Needs::default()
    }

    /// The sum of its values over the block; adds `weight` times their gradients.
    fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64;

    /// The points over which it is a mean, where they are not those of the batch.
    fn points(&self) -> Option<&FixedPoints> {
        None
    }

    /// A network of its own, as it is before the first epoch: it is learned with the rest, kept in checkpoints, and
    /// handed to [`accumulate`](Self::accumulate) as [`Gradients::network`].
    fn network(&self, _seed: u64) -> Option<Mlp> {
        None
    }

    /// Called whenever images are projected; what it returns is handed to [`accumulate`](Self::accumulate) as
    /// [`Block::prepared`].
    fn prepare(&self, _batch: &Projecting<'_>) -> Option<Prepared> {
        None
    }

    /// What tells it from other terms of its name, besides its weight: parameters, or a checksum of what it compares with.
    /// A checkpoint keeps it, and a run with another is not a resumption of that one.
    fn state(&self) -> Value {
        Value::Null
    }
}
