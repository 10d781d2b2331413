//! `ndf scalars`: scalar fields that are stored in a model.

use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, Subcommand, ValueEnum};
use ndf::scalars::{ScalarFigures, ScalarsError};
use ndf::{Model, ModelExt, Preset, begins_as_model, store_scalars, store_scalars_on_levels, stored_scalars};
use ndf_mesh::io::{MeshFile, VertexScalars, atomic_write, format_to_write};
use ndf_train::scalars::{ScalarBudget, ScalarError, ScalarLevelOptions, ScalarSettings};
use serde_json::{Value, json};

use crate::arguments::{EdgeLength, PresetName, bits, share};
use crate::context::Context;
use crate::files::{read_faces, read_model};
use crate::output::{Failure, Outcome, check_model_name, check_output, grouped, readable, table};
use crate::streams::{input_file, output_file};

/// Where values come from, for those who have none.
const VALUES: &str = "`ndf geodesic` and `ndf spectrum` write PLY files that have some";

/// What `ndf scalars` can be asked to do.
#[derive(Debug, Subcommand)]
pub enum Arguments {
    /// Learn the scalars of a mesh near the model's surface and store them in the model
    Fit(FitArguments),
    /// Evaluate the scalars of a model on a mesh extracted from it
    Eval(EvalArguments),
}

/// Arguments of `ndf scalars fit`.
#[derive(Args, Debug)]
pub struct FitArguments {
    /// The model.
    #[arg(value_parser = input_file())]
    model: PathBuf,
    /// A mesh near the model's surface, in the same units, with scalars at its vertices.
    #[arg(value_parser = input_file())]
    values: PathBuf,
    /// The model to write, with the scalars in it.
    #[arg(short, long, value_name = "OUT.ndf", value_parser = output_file("ndf"))]
    output: PathBuf,
    /// Learn this scalar only; may be given several times.
    #[arg(long, value_name = "NAME")]
    scalar: Vec<String>,
    /// How to store them [default: levels; with settings of networks: network].
    #[arg(long, value_enum)]
    field: Option<FormName>,
    /// At most how many bytes they may take on levels; names and ranges count.
    #[arg(long, value_name = "BYTES", value_parser = clap::value_parser!(u32).range(100..=10_000_000))]
    size: Option<u32>,
    /// The root mean square error they may have on levels, a share of their ranges such as 0.1%.
    #[arg(long, value_name = "X", conflicts_with = "size", value_parser = share)]
    error: Option<f64>,
    #[command(flatten)]
    network: Network,
}

/// How scalars are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FormName {
    /// A network with features at the base vertices, as in the paper.
    Network,
    /// Integers on levels of nodes: the same error in a fraction of the bytes.
    Levels,
}

/// How to train a network.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq)]
#[group(skip)]
struct Network {
    /// Settings to start from.
    #[arg(long, value_enum, default_value_t)]
    preset: PresetName,
    /// Features of every base vertex [default: 4].
    #[arg(long, value_name = "D", value_parser = clap::value_parser!(u32).range(0..=4096))]
    features: Option<u32>,
    /// Epochs [default: 12000; paper: 40000].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    epochs: Option<u32>,
    /// Bits of the features in the model file, without the sign; weights have four more [default: 9; paper: as --lossless].
    /// Training ends with rounded numbers.
    #[arg(long, value_name = "N", conflicts_with = "lossless", value_parser = bits)]
    bits: Option<u32>,
    /// Keep all numbers in single precision.
    #[arg(long)]
    lossless: bool,
}

/// Arguments of `ndf scalars eval`.
#[derive(Args, Debug)]
pub struct EvalArguments {
    /// The model.
    #[arg(value_parser = input_file())]
    model: PathBuf,
    /// The mesh to write (.ply, .glb; other formats hold no scalars).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    output: PathBuf,
    #[command(flatten)]
    edge_length: EdgeLength,
}

/// Learns or evaluates scalars.
///
/// # Errors
/// If an input cannot be read or is not usable, training fails, or the output cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    match arguments {
        Arguments::Fit(arguments) => run_fit(arguments, context),
        Arguments::Eval(arguments) => run_eval(arguments, context),
    }
}

impl Network {
    fn settings(&self, seed: u64) -> ScalarSettings {
        let mut settings = ScalarSettings { seed, ..Preset::from(self.preset).scalar_settings() };
        if let Some(features) = self.features {
            settings.shape.network.features = features as usize;
        }
        if let Some(epochs) = self.epochs {
            settings.epochs = epochs as usize;
        }
        if self.lossless {
            settings.bits = None;
        }
        settings.bits = self.bits.or(settings.bits);
        settings
    }
}

impl FitArguments {
    /// What to find on levels, if they are to be on levels.
    fn levels(&self, seed: u64) -> Result<Option<ScalarLevelOptions>, Failure> {
        let budget = match (self.size, self.error) {
            (Some(bytes), _) => ScalarBudget::Bytes(bytes as usize),
            (None, Some(error)) => ScalarBudget::Error(error),
            (None, None) => ScalarLevelOptions::default().budget,
        };
        let is_budgeted = self.size.is_some() || self.error.is_some();
        match (self.field, self.network != Network::default()) {
            (Some(FormName::Network), _) | (None, true) if is_budgeted => {
                let failure = Failure::new("--size and --error are for scalars on levels");
                Err(failure.try_instead("--features and --bits for a network"))
            }
            (Some(FormName::Network), _) | (None, true) => Ok(None),
            (Some(FormName::Levels), true) => {
                let failure =
                    Failure::new("scalars on levels have no --epochs and other settings of networks");
                Err(failure.try_instead("leave them out, or --field network"))
            }
            _ => Ok(Some(ScalarLevelOptions { budget, seed, ..ScalarLevelOptions::default() })),
        }
    }

    /// Tells when scalars on levels could not be as small or as close as was asked for.
    fn warn_of_missed(&self, figures: &ScalarFigures, context: &Context) {
        if let Some(size) = self.size.filter(|&size| figures.bytes > size as usize) {
            let (bytes, size) = (grouped(figures.bytes), grouped(size as usize));
            context.warn(&format!("the scalars take {bytes} bytes, not {size}: so much do their parts need"));
        }
        if let Some(error) = self.error.filter(|&error| figures.rms_error > error) {
            let (found, error) = (100.0 * figures.rms_error, 100.0 * error);
            context.warn(&format!("the scalars are off by {found:.3} % of their ranges rms, not {error:.3} %: finer levels would not fit"));
        }
    }

    /// The scalars to be learned.
    fn wanted(&self, file: MeshFile) -> Result<Vec<VertexScalars>, Failure> {
        let name = self.values.display();
        if file.scalars.is_empty() {
            let failure = Failure::new(format!("{name} has no scalars at its vertices"));
            return Err(failure.try_instead(VALUES));
        }
        if let Some(missing) = self.scalar.iter().find(|n| file.scalars.iter().all(|s| s.name != **n)) {
            let there: Vec<&str> = file.scalars.iter().map(|s| s.name.as_str()).collect();
            let failure = Failure::new(format!("{name} has no scalar named {missing}"));
            return Err(failure.try_instead(&format!("it has {}", there.join(", "))));
        }
        let is_wanted = |s: &VertexScalars| self.scalar.is_empty() || self.scalar.contains(&s.name);
        Ok(file.scalars.into_iter().filter(is_wanted).collect())
    }
}

fn run_fit(arguments: &FitArguments, context: &Context) -> Result<Outcome, Failure> {
    check_model_name(&arguments.output)?;
    check_output(&arguments.output, &[&arguments.values])?;
    context.expect(&["scalars"]);
    let mut model = read_model(&arguments.model)?;
    if begins_as_model(&arguments.values) {
        let name = arguments.values.display();
        let failure = Failure::new(format!("{name} is a model, and no mesh with scalars at its vertices"));
        return Err(failure.try_instead(VALUES));
    }
    let mut file = read_faces(&arguments.values, context)?;
    let mesh = std::mem::take(&mut file.mesh);
    let scalars = arguments.wanted(file)?;
    let levels = arguments.levels(context.seed())?;
    let progress = context.progress();
    let stored = match levels {
        Some(options) => store_scalars_on_levels(&mut model, &mesh, &scalars, &options, &progress),
        None => {
            let settings = arguments.network.settings(context.seed());
            store_scalars(&mut model, &mesh, &scalars, &settings, &progress)
        }
    };
    drop(progress);
    let figures = stored.map_err(|error| {
        let (values, model) = (arguments.values.display(), arguments.model.display());
        match error {
            ScalarsError::Learning(error @ ScalarError::Cancelled(_)) => Failure::new(error.to_string()),
            ScalarsError::Learning(error) => {
                Failure::new(format!("cannot learn the scalars of {values} on {model}: {error}"))
            }
            ScalarsError::Cancelled { .. } => Failure::new(format!("{error}; nothing is written")),
            error => Failure::new(format!("{model}: {error}")),
        }
    })?;
    arguments.warn_of_missed(&figures, context);
    let text = summary(&figures, &model);
    let bytes = model.to_bytes();
    let path = arguments.output.display().to_string();
    atomic_write(&arguments.output, |out| out.write_all(&bytes))
        .map_err(|e| Failure::new(format!("cannot write {path}: {e}")))?;
    let json = serde_json::to_value(&figures)?;
    let mut outcome = Outcome::new(json, format!("{path}: {} bytes\n{text}", grouped(bytes.len())));
    outcome.json.insert("output".into(), path.into());
    outcome.json.insert("model_bytes".into(), bytes.len().into());
    Ok(outcome)
}

fn summary(figures: &ScalarFigures, model: &Model) -> String {
    /// Scalars that are listed one by one.
    const LISTED: usize = 20;
    let percent = |share: f64| format!("{:.3} %", 100.0 * share);
    let errors = |rms: f64, max: f64| format!("{} rms, {} at most", percent(rms), percent(max));
    let of = if figures.nodes == 0 { "epochs" } else { "sweeps" };
    let mut rows = vec![
        ("scalars", figures.scalars.len().to_string()),
        (
            "error",
            format!(
                "{} of the range rms, {} at most",
                percent(figures.rms_error),
                percent(figures.max_error)
            ),
        ),
        (
            "stored as",
            match figures.nodes {
                0 => format!(
                    "{} bytes: {} features a base vertex, {} parameters",
                    grouped(figures.bytes),
                    figures.features,
                    grouped(figures.network_parameters)
                ),
                nodes => format!("{} bytes: levels of {} nodes", grouped(figures.bytes), grouped(nodes)),
            },
        ),
        (
            "their mesh",
            format!(
                "{} rms from the surface, {} at most; the box has side {}",
                readable(figures.distance_rms),
                readable(figures.distance_max),
                readable(model.similarity.length_to_world(3.0))
            ),
        ),
        ("training", format!("{} {of} in {:.1} s", grouped(figures.epochs), figures.seconds)),
    ];
    for scalar in figures.scalars.iter().take(LISTED) {
        let [min, max] = [scalar.min, scalar.max].map(|x| readable(f64::from(x)));
        let error = errors(scalar.rms_error, scalar.max_error);
        rows.push((&scalar.name, format!("{min} to {max}, error {error}")));
    }
    table(&rows)
}

fn run_eval(arguments: &EvalArguments, context: &Context) -> Result<Outcome, Failure> {
    format_to_write(&arguments.output)?;
    check_output(&arguments.output, &[&arguments.model])?;
    let model = read_model(&arguments.model)?;
    let name = arguments.model.display();
    if model.scalars.is_empty() {
        let failure = Failure::new(format!("{name} has no scalars"));
        return Err(failure.try_instead("`ndf scalars fit` stores some in it"));
    }
    context.expect(&["extraction"]);
    let started = Instant::now();
    let length = arguments.edge_length.get().unwrap_or_default();
    let found = model.extract_with(length, &context.progress());
    let found = found.map_err(|e| Failure::new(format!("{name}: {e}")))?;
    let columns = stored_scalars(&model, &found);
    let mesh = found.mesh;
    let seconds = started.elapsed().as_secs_f64();
    context.write_mesh(&arguments.output, &mesh, &columns)?;
    let ranges: Vec<Value> = columns
        .iter()
        .map(|column| {
            let least = column.values.iter().fold(f32::INFINITY, |m, x| m.min(*x));
            let most = column.values.iter().fold(f32::NEG_INFINITY, |m, x| m.max(*x));
            json!({"name": column.name, "min": least, "max": most})
        })
        .collect();
    let names: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
    let json = json!({
        "seconds": seconds,
        "vertices": mesh.vertex_count(),
        "faces": mesh.face_count(),
        "scalars": ranges,
        "target_edge_length": length.world(&model),
    });
    let rows = [
        ("vertices", grouped(mesh.vertex_count())),
        ("edge length", arguments.edge_length.in_words(length.world(&model))),
        ("scalars", names.join(", ")),
        ("time", format!("{seconds:.3} s")),
    ];
    let path = arguments.output.display();
    Ok(Outcome::new(json, format!("{path}: {} faces\n{}", grouped(mesh.face_count()), table(&rows))))
}
