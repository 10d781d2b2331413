//! How to train, as arguments of the program.

use std::time::Duration;

use clap::{Args, ValueEnum};
use ndf::presets::levels_of_size;
use ndf::{Field, Fit, Kind, Opened, Preset};
use ndf_model::file::Precision;
use ndf_train::levels::LevelOptions;
use ndf_train::{Schedule, Settings};

use super::numbers::{bits, positive, seconds, share, weight};
use crate::output::Failure;

/// How to train, and for how long.
#[derive(Args, Clone, Copy, Debug, Default)]
#[group(skip)]
pub struct Training {
    #[command(flatten)]
    chosen: Chosen,
    /// What displaces the base mesh.
    #[arg(long, value_enum, default_value_t)]
    field: FieldName,
    /// About how many bytes the model may have; the number of base faces follows, unless it is given.
    #[arg(long, value_name = "BYTES", value_parser = clap::value_parser!(u32).range(1000..=2_000_000))]
    size: Option<u32>,
    /// The mean distance from the input that the model may have, a share of the diagonal such as 0.02%; bytes and base
    /// faces follow.
    #[arg(long, value_name = "X", conflicts_with = "size", value_parser = share)]
    error: Option<f64>,
    /// End training after this time and keep what is learned by then; a resumed run starts a new count.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = seconds)]
    time_limit: Option<Duration>,
}

/// How to train a network; what is not given is as in the preset. A run that is resumed has all this from its checkpoint.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq)]
#[group(id = "Training", multiple = true)]
struct Chosen {
    /// Settings to start from.
    #[arg(long, value_enum, default_value_t)]
    preset: PresetName,
    /// Features of every base vertex [default: 8]. This and the following are settings of networks.
    #[arg(long, value_name = "D", value_parser = clap::value_parser!(u32).range(0..=4096))]
    features: Option<u32>,
    /// Epochs [default: 6000; paper: 10000].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    epochs: Option<u32>,
    /// Samples in a batch [default: 8192; paper: 32768].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    samples: Option<u32>,
    /// Learning rate of the first epoch [default: 1e-3].
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = positive)]
    lr: Option<f32>,
    /// Weight of the projection loss [default: 1e4].
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = weight)]
    lambda_p: Option<f32>,
    /// Weight of the cycle loss [default: 1e3 to 1e5, as the kind of input needs; paper: 1e2 to 1e5].
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = weight)]
    lambda_c: Option<f32>,
    /// Weight of the Dirichlet energy [default: 0].
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = weight)]
    lambda_d: Option<f32>,
    /// Weight of the agreement of normals [default: 0].
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = weight)]
    lambda_n: Option<f32>,
    /// Weight of local conformality [default: 0].
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = weight)]
    lambda_f: Option<f32>,
    /// Bits of the features in the model file, without the sign; other numbers follow [default: 8; paper: as
    /// --lossless]. Training ends with rounded numbers.
    #[arg(long, value_name = "N", conflicts_with = "lossless", value_parser = bits)]
    bits: Option<u32>,
    /// Keep all numbers in single precision.
    #[arg(long)]
    lossless: bool,
}

/// What displaces a base mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum FieldName {
    /// Levels, unless settings of networks are given.
    #[default]
    Auto,
    /// Displacements along the normal on the levels of the subdivided base mesh: fewer bytes at the same distance.
    Levels,
    /// The paper's network, with features at the base vertices.
    Network,
}

/// Sets of settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum PresetName {
    /// What reaches a given error soonest.
    #[default]
    Default,
    /// The training of the paper's supplement.
    Paper,
}

impl From<PresetName> for Preset {
    fn from(name: PresetName) -> Self {
        match name {
            PresetName::Default => Self::Default,
            PresetName::Paper => Self::Paper,
        }
    }
}

impl Training {
    /// How long to train at most, where that was given.
    pub fn time_limit(&self) -> Option<Duration> {
        self.time_limit
    }

    /// A run of learning a surface as was asked for.
    ///
    /// # Errors
    /// If something was asked for that the field does not have.
    pub fn fit<'a>(&self, opened: &'a Opened, seed: u64) -> Result<Fit<'a>, Failure> {
        let is_sized = self.size.is_some() || self.error.is_some();
        let is_of_networks = self.chosen != Chosen::default();
        let mut fit = Fit::new(opened).seed(seed);
        if let Some(limit) = self.time_limit {
            fit = fit.time_limit(limit);
        }
        match self.field {
            FieldName::Network if is_sized => {
                let failure = Failure::new("--size and --error are for levels");
                return Err(failure.try_instead("--field levels, or --base-faces and --bits for a network"));
            }
            FieldName::Auto if !is_sized && is_of_networks => {
                return Ok(fit.settings(self.settings(opened.kind, seed)));
            }
            FieldName::Auto | FieldName::Levels if is_of_networks => {
                let failure = Failure::new(
                    "levels are learned without --preset, --epochs, --bits and other settings of networks",
                );
                return Err(
                    failure.try_instead("leave them out, or --field network, without --size and --error")
                );
            }
            FieldName::Network => {
                return Ok(fit.settings(self.settings(opened.kind, seed)).field(Field::Network));
            }
            FieldName::Levels => fit = fit.field(Field::Levels),
            FieldName::Auto => {}
        }
        let time_limit = self.time_limit;
        if let Some(size) = self.size {
            fit = fit.levels(LevelOptions { seed, time_limit, ..levels_of_size(size as usize) });
        }
        Ok(match self.error {
            Some(share) => fit.error(share),
            None => fit,
        })
    }

    /// Settings for a kind of input, with what was given.
    fn settings(&self, kind: Kind, seed: u64) -> Settings {
        let chosen = &self.chosen;
        let preset = Preset::from(chosen.preset).settings(kind);
        let mut settings = Settings { seed, time_limit: self.time_limit, ..preset };
        if let Some(features) = chosen.features {
            settings.field.network.features = features as usize;
        }
        if let Some(epochs) = chosen.epochs {
            settings.epochs = epochs as usize;
        }
        if let Some(samples) = chosen.samples {
            settings.samples = samples as usize;
        }
        if let Some(lr) = chosen.lr {
            let Schedule { first, last } = settings.rate;
            settings.rate = Schedule { first: lr, last: lr * last / first };
        }
        if let Some(bits) = chosen.bits {
            settings.precision = Some(Precision::from_bits(bits));
        }
        if chosen.lossless {
            settings.precision = None;
        }
        settings.lambda_p = chosen.lambda_p.unwrap_or(settings.lambda_p);
        settings.lambda_c = chosen.lambda_c.unwrap_or(settings.lambda_c);
        settings.lambda_d = chosen.lambda_d.unwrap_or(settings.lambda_d);
        settings.lambda_n = chosen.lambda_n.unwrap_or(settings.lambda_n);
        settings.lambda_f = chosen.lambda_f.unwrap_or(settings.lambda_f);
        settings
    }
}
