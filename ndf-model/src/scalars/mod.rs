//! Scalar fields on a model's base mesh: `u_ξ` of the method (supplement, §2.6), and a smaller form.
//!
//! [`SurfaceScalars`] hold K fields that are known together, their *channels*: eigenfunctions, distances, anything with a
//! value at every point of the surface. They are one of two things:
//!
//! - an [`IntrinsicNetwork`] of their own, `u_ξ(z(x), k)`, which is told which channel is wanted in one of [two
//!   ways](ChannelIndex),
//! - [integers on levels](ScalarLevels) of nodes of the base mesh.
//!
//! Either gives a value in units of the channel's deviation from its mean, which is clamped to the range of the values
//! that were learned: a constant field comes back exactly.

mod channel;
mod error;
mod levels;
mod nesting;
mod prediction;

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use channel::Channel;
pub use error::{MAX_CHANNELS, ScalarsError};
pub use levels::{ACTIVITIES, MAX_SPLITS, NodeMesh, OWN_LEVELS, RISES, ScalarLevels, ScalarNumbers};
pub use nesting::Nesting;
pub use prediction::{Extension, Extensions};

use crate::intrinsic_network::{ChannelIndex, IntrinsicNetwork, NetworkShape, Part, Passes};
use ndf_mesh::FacePoint;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::io::VertexScalars;
use ndf_network::{Activation, MlpShape};

/// The sizes of the parts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScalarShape {
    /// Sizes of the features and the network.
    #[serde(flatten)]
    pub network: NetworkShape,
    /// How the network is told which channel is wanted.
    pub index: ChannelIndex,
}

impl Default for ScalarShape {
    /// d = 4, two octaves and two hidden layers of 32 with SiLU, an output for every channel.
    fn default() -> Self {
        let (hidden, activation) = (vec![32, 32], Activation::Silu);
        let network = NetworkShape { features: 4, octaves: 2, hidden, activation };
        Self { network, index: ChannelIndex::Output }
    }
}

impl ScalarShape {
    /// How this many channels come out of the network.
    pub fn passes(&self, channels: usize) -> Passes {
        self.network.passes(channels, self.index)
    }

    /// Shape of the perceptron for this many channels.
    pub fn mlp(&self, channels: usize) -> MlpShape {
        self.network.mlp(self.passes(channels))
    }
}

/// Scalar fields over a base mesh that are known together.
#[derive(Clone, Debug)]
pub struct SurfaceScalars {
    channels: Vec<Channel>,
    form: Form,
}

/// What gives the values.
#[derive(Clone, Debug)]
pub(crate) enum Form {
    Network(IntrinsicNetwork),
    Levels(ScalarLevels),
}

impl SurfaceScalars {
    /// Scalar fields of a network of these parts: features vertex by vertex, parameters in the order of
    /// [`Mlp::parameters`](ndf_network::Mlp::parameters).
    ///
    /// # Errors
    /// If names are not usable or repeated, or numbers do not fit together or are not finite.
    pub fn new(
        channels: Vec<Channel>,
        shape: ScalarShape,
        base_vertices: usize,
        features: Vec<f32>,
        parameters: Vec<f32>,
    ) -> Result<Self, ScalarsError> {
        validate(&channels)?;
        let passes = shape.passes(channels.len());
        let network = IntrinsicNetwork::new(base_vertices, shape.network, passes, features, parameters)?;
        Ok(Self { channels, form: Form::Network(network) })
    }

    /// Scalar fields of these numbers on levels of nodes, with the extensions that came with these.
    ///
    /// # Errors
    /// If names are not usable or repeated, or numbers do not fit the nodes or are not finite.
    pub fn levelled(
        channels: Vec<Channel>,
        mesh: Arc<NodeMesh>,
        extensions: &Extensions,
        numbers: ScalarNumbers,
    ) -> Result<Self, ScalarsError> {
        validate(&channels)?;
        let levels = ScalarLevels::new(mesh, extensions, numbers, channels.len())?;
        Ok(Self { channels, form: Form::Levels(levels) })
    }

    /// The fields, in order.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// What gives their values.
    pub(crate) fn form(&self) -> &Form {
        &self.form
    }

    /// Sizes of the parts of their network, if they have one.
    pub fn shape(&self) -> Option<ScalarShape> {
        self.network().map(|n| ScalarShape { network: n.shape().clone(), index: n.passes().index() })
    }

    /// Their network, features and perceptron, if they have one.
    pub fn network(&self) -> Option<&IntrinsicNetwork> {
        match &self.form {
            Form::Network(network) => Some(network),
            Form::Levels(_) => None,
        }
    }

    /// Their numbers on levels, if they have some.
    pub fn levels(&self) -> Option<&ScalarLevels> {
        match &self.form {
            Form::Network(_) => None,
            Form::Levels(levels) => Some(levels),
        }
    }

    /// The same fields with another network of the same shape.
    pub(crate) fn with_network(&self, network: IntrinsicNetwork) -> Self {
        Self { channels: self.channels.clone(), form: Form::Network(network) }
    }

    /// The same fields as they are in the file, with the base vertices in another order: `order[v]` is the old number of
    /// vertex v. What is on levels is in the order of the file already.
    pub(crate) fn reordered(&self, order: &[u32]) -> Self {
        self.network().map_or_else(|| self.clone(), |network| self.with_network(network.reordered(order)))
    }

    /// The values of all K channels at points of the base mesh, point by point.
    ///
    /// # Panics
    /// If `base` has another number of vertices than these fields were made for, or a face does not exist in it.
    pub fn evaluate(&self, base: &ManifoldMesh, points: &[FacePoint]) -> Vec<f32> {
        let channels = self.channels.as_slice();
        let mut values = vec![0.0; points.len() * channels.len()];
        match &self.form {
            Form::Network(network) => {
                network.evaluate_into(base, points, &[], &mut values, channels.len(), |part, _, row, to| {
                    if let Part::Values(first) = part {
                        let to = to[first..].iter_mut().zip(&channels[first..]);
                        to.zip(row).for_each(|((value, channel), output)| *value = channel.value(*output));
                    }
                });
            }
            Form::Levels(levels) => {
                let rows = values.par_chunks_exact_mut(channels.len()).zip(points).with_min_len(256);
                rows.for_each(|(to, point)| {
                    levels.at(point, to);
                    to.iter_mut().zip(channels).for_each(|(x, channel)| *x = channel.value(*x));
                });
            }
        }
        values
    }

    /// [`evaluate`](Self::evaluate), channel by channel under their names.
    ///
    /// # Panics
    /// As `evaluate`.
    pub fn columns(&self, base: &ManifoldMesh, points: &[FacePoint]) -> Vec<VertexScalars> {
        let values = self.evaluate(base, points);
        let column = |k: usize| values.iter().skip(k).step_by(self.channels.len()).copied().collect();
        let named = self.channels.iter().enumerate();
        named.map(|(k, channel)| VertexScalars { name: channel.name.clone(), values: column(k) }).collect()
    }
}

/// Whether these channels can stand in a file together.
fn validate(channels: &[Channel]) -> Result<(), ScalarsError> {
    if channels.is_empty() {
        return Err(ScalarsError::Empty);
    }
    if channels.len() > MAX_CHANNELS {
        return Err(ScalarsError::TooMany(channels.len()));
    }
    let mut names: Vec<&str> = channels.iter().map(|c| c.name.as_str()).collect();
    names.sort_unstable();
    if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(ScalarsError::Repeated(pair[0].to_owned()));
    }
    channels.iter().try_for_each(Channel::validate)
}

#[cfg(test)]
pub(crate) mod level_tests;
#[cfg(test)]
pub(crate) mod tests;
