//! What a user may decide about learning scalar fields.

use ndf_model::file::Precision;
use ndf_model::scalars::ScalarShape;
use ndf_model::{ChannelIndex, NetworkShape};
use ndf_network::Activation;
use serde::{Deserialize, Serialize};

use crate::engine::rounded_epochs;
use crate::settings::{Schedule, SettingsError, is_positive};

/// All settings of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScalarSettings {
    /// Sizes of the features and the network.
    pub shape: ScalarShape,
    /// Steps of the optimiser, each with a batch of samples.
    pub epochs: usize,
    /// Samples in a batch: s of the method. Every sample is one of all channels.
    pub samples: usize,
    /// Learning rate of the network.
    pub rate: Schedule,
    /// The features' rate, as a multiple of the network's: see [`Settings`](crate::Settings::feature_rate).
    pub feature_rate: f32,
    /// Bits of the features as they are stored; weights have four more. `None` for all of single precision.
    #[serde(default)]
    pub bits: Option<u32>,
    /// Share of the epochs, the last ones, in which numbers are rounded: see
    /// [`Settings`](crate::Settings::rounded_share).
    #[serde(default)]
    pub rounded_share: f32,
    /// Seed of everything random.
    pub seed: u64,
}

impl Default for ScalarSettings {
    /// Many steps of few samples at a high rate: the values have no noise, and a batch of 512 tells a step's direction as
    /// well as one of 8,192.
    fn default() -> Self {
        Self {
            shape: ScalarShape::default(),
            epochs: 12_000,
            samples: 512,
            rate: Schedule { first: 4e-2, last: 4e-4 },
            feature_rate: 10.0,
            bits: Some(9),
            rounded_share: 0.3,
            seed: 0,
        }
    }
}

impl ScalarSettings {
    /// The supplement's own training (§2.6): u_ξ(z(x), k) with ReLU, 40,000 epochs of 3,276 samples at a constant rate of
    /// 1e-3 for everything.
    pub fn paper() -> Self {
        Self {
            shape: ScalarShape {
                network: NetworkShape {
                    octaves: 0,
                    activation: Activation::Relu,
                    ..ScalarShape::default().network
                },
                index: ChannelIndex::Input,
            },
            epochs: 40_000,
            samples: 3_276,
            rate: Schedule::constant(1e-3),
            feature_rate: 1.0,
            bits: None,
            rounded_share: 0.3,
            seed: 0,
        }
    }

    /// The first epoch in which numbers are rounded, if there is one.
    pub(super) fn first_rounded(&self) -> Option<usize> {
        self.bits.map(|_| self.epochs - rounded_epochs(self.epochs, self.rounded_share))
    }

    /// Whether these settings can be used.
    ///
    /// # Errors
    /// If they cannot.
    pub fn validate(&self) -> Result<(), SettingsError> {
        match self {
            s if s.epochs == 0 => Err(SettingsError::NoEpochs),
            s if s.samples == 0 => Err(SettingsError::NoSamples),
            s if s.samples > 1 << 24 => Err(SettingsError::ScalarSamples),
            s if !s.rate.is_positive() => Err(SettingsError::Rate),
            s if !is_positive(s.feature_rate) => Err(SettingsError::FeatureRate),
            s if !(0.0..=1.0).contains(&s.rounded_share) => Err(SettingsError::RoundedShare),
            s if s.bits.is_some_and(|bits| !Precision::BITS.contains(&bits)) => Err(SettingsError::Bits),
            s => Ok(s.shape.network.validate()?),
        }
    }
}
