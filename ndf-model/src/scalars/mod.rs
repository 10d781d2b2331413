//! Scalar fields learned on a model's base mesh: `u_ξ(z(x), k)` of the method (supplement, §2.6).
//!
//! [`SurfaceScalars`] hold K fields that are known together, their *channels*: eigenfunctions, distances, anything with a
//! value at every point of the surface. They have an [`IntrinsicNetwork`] of their own, which is told which channel is
//! wanted in one of [two ways](ChannelIndex). What it gives is a value in units of the channel's deviation from its mean,
//! and is clamped to the range of the values that were learned: a constant field comes back exactly.

mod channel;
mod error;

use serde::{Deserialize, Serialize};

pub use channel::Channel;
pub use error::{MAX_CHANNELS, ScalarsError};

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

/// Scalar fields over a base mesh that a network knows together.
#[derive(Clone, Debug)]
pub struct SurfaceScalars {
    channels: Vec<Channel>,
    network: IntrinsicNetwork,
}

impl SurfaceScalars {
    /// Scalar fields of these parts: features vertex by vertex, parameters in the order of
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
        channels.iter().try_for_each(Channel::validate)?;
        let passes = shape.passes(channels.len());
        let network = IntrinsicNetwork::new(base_vertices, shape.network, passes, features, parameters)?;
        Ok(Self { channels, network })
    }

    /// The fields, in order.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Sizes of the parts.
    pub fn shape(&self) -> ScalarShape {
        ScalarShape { network: self.network.shape().clone(), index: self.network.passes().index() }
    }

    /// The network: features and perceptron.
    pub fn network(&self) -> &IntrinsicNetwork {
        &self.network
    }

    /// The same fields with another network of the same shape.
    pub(crate) fn with_network(&self, network: IntrinsicNetwork) -> Self {
        Self { channels: self.channels.clone(), network }
    }

    /// The same fields with the base vertices in another order: `order[v]` is the old number of vertex v.
    pub(crate) fn reordered(&self, order: &[u32]) -> Self {
        self.with_network(self.network.reordered(order))
    }

    /// The values of all K channels at points of the base mesh, point by point.
    ///
    /// # Panics
    /// If `base` has another number of vertices than these fields were made for, or a face does not exist in it.
    pub fn evaluate(&self, base: &ManifoldMesh, points: &[FacePoint]) -> Vec<f32> {
        let channels = self.channels.as_slice();
        let mut values = vec![0.0; points.len() * channels.len()];
        self.network.evaluate_into(base, points, &[], &mut values, channels.len(), |part, _, row, to| {
            if let Part::Values(first) = part {
                let to = to[first..].iter_mut().zip(&channels[first..]);
                to.zip(row).for_each(|((value, channel), output)| *value = channel.value(*output));
            }
        });
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

#[cfg(test)]
pub(crate) mod tests;
