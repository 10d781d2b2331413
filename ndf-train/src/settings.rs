//! What a user may decide about training.

use std::time::Duration;

use ndf_model::file::Precision;
use ndf_model::intrinsic_network::ShapeError;
use ndf_model::{FieldShape, NetworkShape};
use ndf_network::{MlpShape, encoding};
use serde::{Deserialize, Serialize};

use crate::engine::rounded_epochs;

/// How the learning rate falls from the first epoch to the last.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    /// Rate at the first epoch.
    pub first: f32,
    /// Rate at the last epoch; the rate falls geometrically.
    pub last: f32,
}

impl Schedule {
    /// The same rate throughout.
    pub fn constant(rate: f32) -> Self {
        Self { first: rate, last: rate }
    }

    /// Whether both rates are usable.
    pub(crate) fn is_positive(&self) -> bool {
        is_positive(self.first) && is_positive(self.last)
    }

    /// The rate at `fraction` of the training, in `[0, 1]`.
    pub fn at(&self, fraction: f32) -> f32 {
        self.first * (self.last / self.first).powf(fraction)
    }
}

/// The form of the reverse map g_φ, which training alone uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReverseMap {
    /// A network: `g_φ(y) = MLP([y, PE(y)])`.
    Plain,
    /// A network that is added to the point itself: `g_φ(y) = y + MLP([y, PE(y)])`.
    Residual,
    /// A network that is added to the closest point of the base mesh: `g_φ(y) = p(y) + MLP([y, PE(y)])`.
    ClosestPoint,
    /// The same, given in addition what g is given at the closest point p: `g_φ(y) = p + MLP([z(p), p, PE(p), y, PE(y)])`.
    Encoding,
    /// No network: the point that g itself takes to y, sought from the closest point of the base mesh on. Its cycle loss is
    /// what g folds and stretches, and nothing of what a network fails to learn.
    #[default]
    Inverse,
}

impl ReverseMap {
    /// Whether it begins at points of the base mesh.
    pub(crate) fn needs_origins(self) -> bool {
        match self {
            Self::Plain | Self::Residual => false,
            Self::ClosestPoint | Self::Encoding | Self::Inverse => true,
        }
    }
}

/// All settings of a training run. The result is a function of these, the base mesh and the surface alone: the
/// number of threads does not matter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Sizes of the field.
    pub field: FieldShape,
    /// Form of the reverse map g_φ.
    pub reverse_map: ReverseMap,
    /// Octaves of positional encoding of y in the network of the reverse map g_φ, where its form has one.
    pub reverse_octaves: usize,
    /// Passes over a batch.
    pub epochs: usize,
    /// Samples in a batch: s of the method.
    pub samples: usize,
    /// Epochs a batch is kept.
    pub resample_every: usize,
    /// Epochs a foot is kept; in between, the surface is taken as its tangent plane there.
    pub project_every: usize,
    /// Learning rate of the networks.
    pub rate: Schedule,
    /// The features' rate, as a multiple of the networks'. A feature is touched by the samples of a few faces, a
    /// weight of the network by all: equal rates leave the features far behind.
    pub feature_rate: f32,
    /// Weight of the projection loss.
    pub lambda_p: f32,
    /// Weight of the cycle loss. 0 leaves the reverse map out.
    pub lambda_c: f32,
    /// Weight of the Dirichlet energy.
    pub lambda_d: f32,
    /// Weight of the agreement of normals (Eq. 4).
    pub lambda_n: f32,
    /// Weight of local conformality (Eq. 6).
    pub lambda_f: f32,
    /// Epochs in which the networks first learn the identity (Eq. 1).
    pub identity_epochs: usize,
    /// How finely the numbers of the model are kept; `None` for all of single precision.
    #[serde(default)]
    pub precision: Option<Precision>,
    /// Share of the epochs, the last ones, in which the losses are those of the model as it will be stored, with its
    /// numbers rounded; what is learned goes to the numbers behind them (Bengio, Léonard & Courville 2013).
    #[serde(default)]
    pub rounded_share: f32,
    /// Seed of everything random.
    pub seed: u64,
    /// Wall time after which training ends at the next epoch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_limit: Option<Duration>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            field: FieldShape::default(),
            reverse_map: ReverseMap::default(),
            reverse_octaves: 8,
            epochs: 6_000,
            samples: 8_192,
            resample_every: 10,
            project_every: 10,
            rate: Schedule { first: 1e-3, last: 1e-5 },
            feature_rate: 50.0,
            lambda_p: 1e4,
            lambda_c: 1e3,
            lambda_d: 0.0,
            lambda_n: 0.0,
            lambda_f: 0.0,
            identity_epochs: 0,
            precision: Some(Precision::default()),
            rounded_share: 0.3,
            seed: 0,
            time_limit: None,
        }
    }
}

impl Settings {
    /// The supplement's own training (§1.1, Table 2): no residual, an identity stage of 1,000 epochs, 10,000 epochs of
    /// 32,768 samples at a constant rate of 1e-3 for everything.
    pub fn paper() -> Self {
        Self {
            field: FieldShape { residual: false, ..FieldShape::default() },
            reverse_map: ReverseMap::Plain,
            lambda_c: 1e2,
            epochs: 10_000,
            samples: 32_768,
            rate: Schedule::constant(1e-3),
            feature_rate: 1.0,
            identity_epochs: 1_000,
            precision: None,
            ..Self::default()
        }
    }

    /// Epochs, of the last ones, in which numbers are rounded.
    pub(crate) fn rounded_epochs(&self) -> usize {
        self.precision.map_or(0, |_| rounded_epochs(self.epochs, self.rounded_share))
    }

    /// Shape of the reverse map's network, where there is one.
    pub(crate) fn reverse_network(&self) -> Option<MlpShape> {
        let of_points = 3 + encoding::width(self.reverse_octaves);
        let inputs = match self.reverse_map {
            _ if self.lambda_c == 0.0 => return None,
            ReverseMap::Inverse => return None,
            ReverseMap::Plain | ReverseMap::Residual | ReverseMap::ClosestPoint => of_points,
            ReverseMap::Encoding => self.field.mlp().inputs + of_points,
        };
        Some(MlpShape { inputs, ..self.field.mlp() })
    }

    /// Whether these settings can be used.
    ///
    /// # Errors
    /// If they cannot.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let is_weight = |x: f32| x.is_finite() && x >= 0.0;
        self.field.network.validate()?;
        NetworkShape { octaves: self.reverse_octaves, ..self.field.network.clone() }.validate()?;
        match self {
            s if s.samples == 0 => Err(SettingsError::NoSamples),
            s if s.samples > 1 << 26 => Err(SettingsError::Samples),
            s if s.samples.saturating_mul(s.field.network.features) > 1 << 30 => Err(SettingsError::Products),
            s if s.resample_every == 0 || s.project_every == 0 => Err(SettingsError::NoBatch),
            s if !s.resample_every.is_multiple_of(s.project_every) => Err(SettingsError::Batch),
            s if !s.rate.is_positive() => Err(SettingsError::Rate),
            s if !is_positive(s.feature_rate) => Err(SettingsError::FeatureRate),
            s if ![s.lambda_p, s.lambda_c, s.lambda_d, s.lambda_n, s.lambda_f].into_iter().all(is_weight) => {
                Err(SettingsError::Weight)
            }
            s if !(0.0..=1.0).contains(&s.rounded_share) => Err(SettingsError::RoundedShare),
            s if s.precision.is_some_and(|p| !Precision::BITS.contains(&p.features)) => {
                Err(SettingsError::Bits)
            }
            _ => Ok(()),
        }
    }
}

/// Settings that cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SettingsError {
    /// Sizes of a network.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// A run without epochs, where it needs one.
    #[error("at least one epoch is needed")]
    NoEpochs,
    /// Batches without samples.
    #[error("at least one sample is needed")]
    NoSamples,
    /// Batches that are too large.
    #[error("more than 67 million samples in a batch are not supported")]
    Samples,
    /// Batches that are too large for scalar fields.
    #[error("more than 16 million samples in a batch are not supported")]
    ScalarSamples,
    /// Bytes, errors or prices of scalars on levels.
    #[error("bytes, error and price of scalars must be positive")]
    ScalarBudget,
    /// Samples times features.
    #[error("samples × features must not exceed 2³⁰")]
    Products,
    /// Batches or feet that are kept no epoch.
    #[error("a batch lasts at least one epoch")]
    NoBatch,
    /// Batches that end between projections.
    #[error("the epochs of a batch must be a multiple of the epochs between projections")]
    Batch,
    /// The learning rate.
    #[error("the learning rate must be positive")]
    Rate,
    /// The features' share of it.
    #[error("the rate of the features must be positive")]
    FeatureRate,
    /// The weight of a loss.
    #[error("loss weights must be finite and not negative")]
    Weight,
    /// The share of the epochs in which numbers are rounded.
    #[error("the share of rounded epochs must be between 0 and 1")]
    RoundedShare,
    /// The bits of features.
    #[error("features must have 3 to 14 bits")]
    Bits,
}

/// Whether a rate or a factor is finite and above 0.
pub(crate) fn is_positive(x: f32) -> bool {
    x.is_finite() && x > 0.0
}
