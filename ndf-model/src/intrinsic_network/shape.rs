//! The sizes of a network, and how values come out of it.

use serde::{Deserialize, Serialize};

use super::error::ShapeError;
use ndf_network::encoding::{self, MAX_OCTAVES};
use ndf_network::{Activation, MlpShape};

/// Features of a base vertex; more are not supported.
pub(crate) const MAX_FEATURES: usize = 4096;
/// Neurons of a hidden layer; more are not supported.
const MAX_NEURONS: usize = 4096;
/// Hidden layers; more are not supported.
const MAX_LAYERS: usize = 255;

/// The sizes of an [`IntrinsicNetwork`](super::IntrinsicNetwork).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NetworkShape {
    /// Features per base vertex: d of the method. With 0 the network knows a point by its coordinates alone.
    pub features: usize,
    /// Octaves of positional encoding of x; 0 for none.
    pub octaves: usize,
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// What hidden layers do to their sums.
    #[serde(default)]
    pub activation: Activation,
}

impl Default for NetworkShape {
    /// d = 8 and two hidden layers of 32 with ReLU, without positional encoding.
    fn default() -> Self {
        Self { features: 8, octaves: 0, hidden: vec![32, 32], activation: Activation::Relu }
    }
}

impl NetworkShape {
    /// Width of the encoding of a point: of `[z(x), x, PE(x)]`.
    pub fn encoded(&self) -> usize {
        self.features + 3 + encoding::width(self.octaves)
    }

    /// How so many values at a point come out of the network.
    pub fn passes(&self, channels: usize, index: ChannelIndex) -> Passes {
        match index {
            ChannelIndex::Output => Passes { count: 1, outputs: channels, code_at: None },
            ChannelIndex::Input => Passes { count: channels, outputs: 1, code_at: Some(self.encoded()) },
        }
    }

    /// Shape of the perceptron.
    pub fn mlp(&self, passes: Passes) -> MlpShape {
        MlpShape {
            inputs: self.encoded() + usize::from(passes.code_at.is_some()),
            hidden: self.hidden.clone(),
            outputs: passes.outputs,
            activation: self.activation,
        }
    }

    /// Whether the sizes are supported.
    ///
    /// # Errors
    /// If they are not.
    pub fn validate(&self) -> Result<(), ShapeError> {
        match self {
            s if s.features > MAX_FEATURES => Err(ShapeError::Features),
            s if s.octaves > MAX_OCTAVES => Err(ShapeError::Octaves),
            s if s.hidden.len() > MAX_LAYERS => Err(ShapeError::Layers),
            s if s.hidden.iter().any(|width| !(1..=MAX_NEURONS).contains(width)) => Err(ShapeError::Neurons),
            _ => Ok(()),
        }
    }
}

/// How a network is told which of its values is wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelIndex {
    /// It has an output for every channel: one pass gives all of them.
    #[default]
    Output,
    /// It has one output, and as a further input a code between −1 and 1 for the channel, as the supplement writes
    /// u_ξ(z, k): a pass for every channel.
    Input,
}

/// The passes through a network that give all its values at a block of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Passes {
    /// How many there are.
    pub count: usize,
    /// Values that come out of each.
    pub outputs: usize,
    /// The input that holds the code of the channel, where there is one.
    code_at: Option<usize>,
}

impl Passes {
    /// Values at a point.
    pub fn channels(&self) -> usize {
        self.count * self.outputs
    }

    /// How the network is told which value is wanted.
    pub fn index(&self) -> ChannelIndex {
        if self.code_at.is_some() { ChannelIndex::Input } else { ChannelIndex::Output }
    }

    /// Writes the code of the channel of a pass into rows of input: codes are evenly spaced in −1 … 1.
    #[inline(always)]
    pub fn set_code(&self, pass: usize, rows: &mut [f32], stride: usize) {
        if let Some(at) = self.code_at {
            let code = (2 * pass + 1) as f32 / self.count as f32 - 1.0;
            rows.iter_mut().skip(at).step_by(stride).for_each(|to| *to = code);
        }
    }
}
