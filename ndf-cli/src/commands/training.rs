//! How to train, as arguments of the program.

use std::time::Duration;

use clap::{Args, ValueEnum};
use ndf_model::file::Precision;
use ndf_train::{Schedule, Settings};

use crate::input::Kind;

/// How to train, and for how long.
#[derive(Args, Clone, Copy, Debug, Default)]
#[group(skip)]
pub struct Training {
    #[command(flatten)]
    chosen: Chosen,
    /// End training after this time and keep what is learned by then; a resumed run starts a new count.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = seconds)]
    time_limit: Option<Duration>,
}

/// How to train; what is not given is as in the preset. A run that is resumed has all this from its checkpoint.
#[derive(Args, Clone, Copy, Debug, Default)]
#[group(id = "Training", multiple = true)]
struct Chosen {
    /// Settings to start from.
    #[arg(long, value_enum, default_value_t)]
    preset: Preset,
    /// Features of every base vertex [default: 8].
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
    /// Bits of the features in the model file, the sign aside; what else is in it follows [default: 8; paper: as
    /// --lossless]. Training ends with the numbers rounded so.
    #[arg(long, value_name = "N", conflicts_with = "lossless", value_parser = bits)]
    bits: Option<u32>,
    /// Keep all numbers in single precision.
    #[arg(long)]
    lossless: bool,
}

/// Sets of settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// What reaches a given error soonest.
    #[default]
    Default,
    /// The training of the paper's supplement.
    Paper,
}

impl Training {
    /// The same training with all numbers kept in single precision.
    #[must_use]
    pub fn lossless(self) -> Self {
        Self { chosen: Chosen { lossless: true, bits: None, ..self.chosen }, ..self }
    }

    /// How long to train at most, where that was given.
    pub fn time_limit(&self) -> Option<Duration> {
        self.time_limit
    }

    /// Settings for a kind of input, with what was given.
    pub fn settings(&self, kind: Kind, seed: u64) -> Settings {
        let chosen = &self.chosen;
        let preset = match chosen.preset {
            Preset::Default => Settings::default(),
            Preset::Paper => Settings::paper(),
        };
        let mut settings = Settings { seed, time_limit: self.time_limit, ..kind.settings(preset) };
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
            settings.precision = Some(Precision::of_bits(bits));
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

fn positive(text: &str) -> Result<f32, String> {
    let x: f32 = text.parse().map_err(|_| "a number is expected".to_owned())?;
    if x.is_finite() && x > 0.0 { Ok(x) } else { Err("a positive number is expected".to_owned()) }
}

/// A number of bits of features.
pub fn bits(text: &str) -> Result<u32, String> {
    let allowed = Precision::BITS;
    match text.parse() {
        Ok(bits) if allowed.contains(&bits) => Ok(bits),
        _ => Err(format!("expected a number from {} to {}", allowed.start(), allowed.end())),
    }
}

fn weight(text: &str) -> Result<f32, String> {
    let x: f32 = text.parse().map_err(|_| "a number is expected".to_owned())?;
    if x.is_finite() && x >= 0.0 { Ok(x) } else { Err("expected a number that is not negative".to_owned()) }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let x: f64 = text.parse().map_err(|_| "expected a number of seconds".to_owned())?;
    Duration::try_from_secs_f64(x).map_err(|_| "expected a number of seconds that is not negative".to_owned())
}
