//! `ndf fit`: learn a surface.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, ValueEnum};
use ndf_core::io::atomic_write;
use ndf_core::{ManifoldMesh, Model};
use ndf_meshing::BaseMeshOptions;
use ndf_train::{Fit, Schedule, Settings, fit};
use serde_json::{Value, json};

use super::read_faces;
use crate::context::Context;
use crate::input::MeshInput;
use crate::output::{Failure, Outcome, grouped, readable, table};

/// Arguments of `ndf fit`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The surface to learn.
    input: PathBuf,
    /// The model to write.
    #[arg(short, long, value_name = "MODEL.ndf")]
    output: PathBuf,
    /// What the input is, where its content should not decide.
    #[arg(long = "as", value_name = "KIND")]
    kind: Option<Kind>,
    /// A base mesh to use instead of one that is made.
    #[arg(long, value_name = "FILE", conflicts_with = "base_faces")]
    base: Option<PathBuf>,
    /// Faces of the base mesh.
    #[arg(long, value_name = "N", default_value_t = 4000, value_parser = clap::value_parser!(u32).range(4..=10_000_000))]
    base_faces: u32,
    #[command(flatten)]
    training: Training,
}

/// How to train; what is not given is the default of the preset.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct Training {
    /// Features of every base vertex [default: 8].
    #[arg(long, value_name = "D", value_parser = clap::value_parser!(u32).range(0..=4096))]
    features: Option<u32>,
    /// Passes over a batch [default: 6000].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    epochs: Option<u32>,
    /// Samples in a batch [default: 8192].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    samples: Option<u32>,
    /// Learning rate of the first epoch [default: 1e-3].
    #[arg(long, value_name = "X", value_parser = positive)]
    lr: Option<f32>,
    /// Weight of the projection loss [default: 1e4].
    #[arg(long, value_name = "X", value_parser = weight)]
    lambda_p: Option<f32>,
    /// Weight of the cycle loss [default: 1e2].
    #[arg(long, value_name = "X", value_parser = weight)]
    lambda_c: Option<f32>,
    /// End training after this long, with what is learned by then.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    time_limit: Option<Duration>,
}

/// Kinds of input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// A triangle mesh of any quality, treated as a signed distance field.
    Mesh,
}

impl Training {
    /// Settings with what was given.
    pub fn settings(&self, seed: u64) -> Settings {
        let mut settings = Settings { seed, time_limit: self.time_limit, ..Settings::default() };
        if let Some(features) = self.features {
            settings.field.features = features as usize;
        }
        if let Some(epochs) = self.epochs {
            settings.epochs = epochs as usize;
        }
        if let Some(samples) = self.samples {
            settings.samples = samples as usize;
        }
        if let Some(lr) = self.lr {
            let Schedule { first, last } = settings.rate;
            settings.rate = Schedule { first: lr, last: lr * last / first };
        }
        settings.lambda_p = self.lambda_p.unwrap_or(settings.lambda_p);
        settings.lambda_c = self.lambda_c.unwrap_or(settings.lambda_c);
        settings
    }
}

/// Learns a surface and writes the model.
///
/// # Errors
/// If the input is no usable surface, training fails, or the model cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let settings = arguments.training.settings(context.seed());
    let fitted =
        fit_file(&arguments.input, arguments.base.as_deref(), arguments.base_faces, &settings, context)?;
    let bytes = fitted.model.to_bytes();
    let path = arguments.output.display().to_string();
    atomic_write(&arguments.output, |out| out.write_all(&bytes))
        .map_err(|e| Failure::new(format!("cannot write {path}: {e}")))?;
    Ok(outcome(&path, &fitted, bytes.len()))
}

/// A learned model with the figures of its making.
pub struct Fitted {
    /// The model.
    pub model: Model,
    /// The base mesh in the input's units.
    pub base: ManifoldMesh,
    /// What was learned from.
    pub input: MeshInput,
    /// Figures of the training.
    pub report: ndf_train::FitReport,
}

/// Learns the surface in a file.
///
/// # Errors
/// If the input is no usable surface, or training fails.
pub fn fit_file(
    input: &Path,
    base: Option<&Path>,
    base_faces: u32,
    settings: &Settings,
    context: &Context,
) -> Result<Fitted, Failure> {
    let progress = context.progress();
    let source = MeshInput::read(input, context)?;
    let base = match base {
        Some(path) => read_base(path, context)?,
        None => {
            let options = BaseMeshOptions { faces: base_faces as usize, ..BaseMeshOptions::default() };
            source.base_mesh(input, &options, context, &progress)?.mesh
        }
    };
    let Fit { field, similarity, report } = fit(source.surface(), &base, settings, &progress)
        .map_err(|e| Failure::new(format!("{}: {e}", input.display())))?;
    drop(progress);
    if report.interrupted {
        context.warn(&format!("training ended early, after {} of {} epochs", report.epochs, settings.epochs));
    }
    if report.missed_fraction > 0.0 {
        let share = 100.0 * report.missed_fraction;
        context.warn(&format!("{share:.1} % of the learned surface finds no foot on the input"));
    }
    let provenance = provenance(input, settings, &report).to_string();
    Ok(Fitted { model: Model { field, similarity, provenance }, base, input: source, report })
}

fn read_base(path: &Path, context: &Context) -> Result<ManifoldMesh, Failure> {
    let file = read_faces(path, context)?;
    ManifoldMesh::try_from(file.mesh).map_err(|e| {
        let failure = Failure::new(format!("the base mesh {} is {e}", path.display()));
        failure.try_instead("`ndf mesh` makes a manifold of any mesh that encloses a volume")
    })
}

fn provenance(input: &Path, settings: &Settings, report: &ndf_train::FitReport) -> Value {
    json!({
        "program": concat!("ndf ", env!("CARGO_PKG_VERSION")),
        "input": input.file_name().map(|name| name.to_string_lossy()),
        "settings": {
            "features": settings.field.features,
            "octaves": settings.field.octaves,
            "hidden": settings.field.hidden,
            "epochs": settings.epochs,
            "samples": settings.samples,
            "learning_rate": [settings.rate.first, settings.rate.last],
            "feature_rate": settings.feature_rate,
            "lambda_p": settings.lambda_p,
            "lambda_c": settings.lambda_c,
            "seed": settings.seed,
        },
        "metrics": {
            "epochs": report.epochs,
            "projection_rms": report.projection_rms,
            "projection_max": report.projection_max,
            "cycle_loss": report.cycle_loss,
            "flipped_fraction": report.flipped_fraction,
        },
    })
}

fn outcome(path: &str, fitted: &Fitted, bytes: usize) -> Outcome {
    let report = &fitted.report;
    let json = json!({
        "output": path,
        "seconds": report.seconds,
        "seconds_projecting": report.seconds_projecting,
        "epochs": report.epochs,
        "interrupted": report.interrupted,
        "projection_rms": report.projection_rms,
        "projection_max": report.projection_max,
        "cycle_loss": report.cycle_loss,
        "flipped_fraction": report.flipped_fraction,
        "missed_fraction": report.missed_fraction,
        "base_vertices": fitted.base.vertex_count(),
        "base_faces": fitted.base.face_count(),
        "model_bytes": bytes,
    });
    let world = |x: f64| readable(fitted.model.similarity.length_to_world(x));
    let rows = [
        (
            "base mesh",
            format!(
                "{} faces, {} vertices",
                grouped(fitted.base.face_count()),
                grouped(fitted.base.vertex_count())
            ),
        ),
        (
            "distance to the input",
            format!("{} rms, {} at most", world(report.projection_rms), world(report.projection_max)),
        ),
        ("turned against it", format!("{:.3} %", 100.0 * report.flipped_fraction)),
        (
            "training",
            format!(
                "{} epochs in {:.1} s, of which projecting {:.1} s",
                grouped(report.epochs),
                report.seconds,
                report.seconds_projecting
            ),
        ),
    ];
    Outcome::new(json, format!("{path}: {} bytes\n{}", grouped(bytes), table(&rows)))
}

fn positive(text: &str) -> Result<f32, String> {
    let x: f32 = text.parse().map_err(|_| "a number is expected".to_owned())?;
    if x.is_finite() && x > 0.0 { Ok(x) } else { Err("a positive number is expected".to_owned()) }
}

fn weight(text: &str) -> Result<f32, String> {
    let x: f32 = text.parse().map_err(|_| "a number is expected".to_owned())?;
    if x.is_finite() && x >= 0.0 {
        Ok(x)
    } else {
        Err("a number that is not negative is expected".to_owned())
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let x: f64 = text.parse().map_err(|_| "a number of seconds is expected".to_owned())?;
    Duration::try_from_secs_f64(x)
        .map_err(|_| "a number of seconds that is not negative is expected".to_owned())
}
