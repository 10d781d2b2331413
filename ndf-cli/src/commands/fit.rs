//! `ndf fit`: learn a surface.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use ndf::band::BandFigures;
use ndf::{Checkpoint, DVec3, Fitted, ManifoldMesh, Record};
use ndf_mesh::ValidationReport;
use ndf_mesh::io::atomic_write;
use ndf_train::{CheckpointError, LogRecord};
use serde_json::json;

use crate::arguments::{PartArguments, Reading, Training, seconds};
use crate::context::Context;
use crate::files::{open, read_faces};
use crate::interrupt;
use crate::learning::{STAGES, learned};
use crate::output::{
    Failure, Outcome, check_model_name, check_output, check_place, grouped, is_same, readable, table,
};
use crate::streams::{input_file, is_output, output_file};

/// Arguments of `ndf fit`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The surface to learn.
    #[arg(value_parser = input_file())]
    input: PathBuf,
    /// The model to write.
    #[arg(short, long, value_name = "MODEL.ndf", value_parser = output_file("ndf"))]
    output: PathBuf,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    parts: PartArguments,
    /// Use this base mesh instead of making one.
    #[arg(long, value_name = "FILE", conflicts_with = "base_faces")]
    base: Option<PathBuf>,
    /// Anchors: a file with six numbers a line, a point of the base mesh and its target, in the input's units.
    #[arg(long, value_name = "FILE")]
    anchors: Option<PathBuf>,
    /// Where an interrupted run leaves its checkpoint, and a running one its last [default: the model's name with
    /// .checkpoint]. If given, a run whose time is up leaves one beside its model, too.
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Write a checkpoint whenever so much time has passed. A run that ends removes it.
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = seconds)]
    checkpoint_every: Duration,
    /// Continue from a checkpoint, with its field, base mesh and settings; a new time limit may be set.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["base", "base_faces", "field", "size", "error", "seed", "Training"])]
    resume: Option<PathBuf>,
    /// Write a line of JSON for every batch of a network (losses, learning rate, share of flipped samples, times), or for
    /// every run and iteration of levels (distances as shares of the diagonal, bytes, price of a bit, time).
    #[arg(long, value_name = "FILE.jsonl")]
    log: Option<PathBuf>,
    /// Faces of the base mesh [default: 4000, or as many as suit --size or --error].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=10_000_000))]
    base_faces: Option<u32>,
    #[command(flatten)]
    training: Training,
}

impl Arguments {
    /// Where checkpoints go.
    fn kept(&self) -> PathBuf {
        self.checkpoint.clone().unwrap_or_else(|| {
            if is_output(&self.output) {
                return elsewhere();
            }
            let mut name = self.output.clone().into_os_string();
            name.push(".checkpoint");
            name.into()
        })
    }
}

/// Learns a surface and writes the model.
///
/// # Errors
/// If the input is no usable surface, training fails or is interrupted, or the model cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    check_places(arguments)?;
    context.expect(&STAGES);
    let anchors = arguments.anchors.as_deref().map(read_anchors).transpose()?.unwrap_or_default();
    let checkpoint = arguments.resume.as_deref().map(read_checkpoint).transpose()?;
    let started = Instant::now();
    let opened = open(&arguments.input, &arguments.parts.opening(&arguments.reading)?, context)?;
    let seconds_reading = started.elapsed().as_secs_f64();
    let base = match &checkpoint {
        None => arguments.base.as_deref().map(|path| read_base(path, context)).transpose()?,
        Some(_) => None,
    };
    let mut log = arguments.log.as_deref().map(|path| Log::new(path, checkpoint.is_some()));
    let mut fit = arguments.training.fit(&opened, context.seed())?.anchors(anchors);
    if let Some(faces) = arguments.base_faces {
        fit = fit.base_faces(faces as usize);
    }
    if let Some(mesh) = &base {
        fit = fit.base(mesh);
    }
    if let Some(checkpoint) = checkpoint {
        fit = fit.resume(checkpoint.with_time_limit(arguments.training.time_limit()));
    }
    if let Some(log) = &mut log {
        fit = fit.log(|record| log.add(record));
    }
    let kept = arguments.kept();
    let mut is_kept = false;
    let fit = fit.on_checkpoint(arguments.checkpoint_every, |checkpoint| match checkpoint.write(&kept) {
        Ok(()) => is_kept = true,
        Err(e) => context.warn(&format!("cannot write {}: {e}", kept.display())),
    });
    let fitted = learned(fit, &arguments.input, arguments.resume.as_deref(), context)?;
    let is_saved = save_checkpoint(arguments, &fitted, context)?;
    let bytes = fitted.model.to_bytes();
    let path = arguments.output.display().to_string();
    if let Err(error) = atomic_write(&arguments.output, |out| out.write_all(&bytes)) {
        return Err(unwritten(&path, &error, &fitted, &kept));
    }
    let is_resumed = arguments.resume.as_ref().is_some_and(|resumed| *resumed == kept);
    if (is_kept || is_resumed) && !is_saved {
        // The model is there now; and if someone else has removed the checkpoint, that is well, too.
        let _ = std::fs::remove_file(&kept);
    }
    if let Some(log) = log {
        log.finish()?;
    }
    outcome(&path, &fitted, seconds_reading)
}

/// Whether all outputs can be expected to appear, each in a place of its own, and none instead of an input.
fn check_places(arguments: &Arguments) -> Result<(), Failure> {
    let outputs = [Some(&arguments.output), arguments.checkpoint.as_ref(), arguments.log.as_ref()];
    let outputs: Vec<&PathBuf> = outputs.into_iter().flatten().collect();
    let inputs = [Some(&arguments.input), arguments.base.as_ref(), arguments.anchors.as_ref()];
    let inputs: Vec<&Path> = inputs.into_iter().flatten().map(PathBuf::as_path).collect();
    outputs.iter().try_for_each(|path| check_output(path, &inputs))?;
    check_model_name(&arguments.output)?;
    if !arguments.output.exists() || arguments.output.is_file() {
        check_place(&arguments.kept())?;
    }
    // The next checkpoint may take the place of the one that is resumed, but nothing else.
    if let Some(resumed) = &arguments.resume {
        let others = [Some(&arguments.output), arguments.log.as_ref()];
        others.into_iter().flatten().try_for_each(|path| check_output(path, &[resumed]))?;
    }
    for (k, path) in outputs.iter().enumerate() {
        if outputs[..k].iter().any(|other| is_same(other, path)) {
            return Err(Failure::new(format!("{} is the name of two outputs", path.display()))
                .try_instead("give each its own"));
        }
    }
    Ok(())
}

/// The failure of writing a model. What was learned is kept as a checkpoint, beside the model if that is possible, else in
/// the folder for temporary files.
fn unwritten(path: &str, error: &std::io::Error, fitted: &Fitted, kept: &Path) -> Failure {
    let failure = Failure::new(format!("cannot write {path}: {error}"));
    match leave(&fitted.checkpoint, kept) {
        Ok(place) => {
            failure.try_instead(&format!("--resume {} writes it again, elsewhere with -o", place.display()))
        }
        Err(_) => failure,
    }
}

/// The place of a checkpoint that can be nowhere else.
fn elsewhere() -> PathBuf {
    std::env::temp_dir().join(format!("ndf-{}.checkpoint", std::process::id()))
}

/// Writes a checkpoint in its place if that is possible, else in the folder for temporary files. Where it is now.
fn leave(checkpoint: &Checkpoint, place: &Path) -> Result<PathBuf, CheckpointError> {
    checkpoint.write(place).map(|()| place.to_owned()).or_else(|error| {
        let elsewhere = elsewhere();
        checkpoint.write(&elsewhere).map(|()| elsewhere).map_err(|_| error)
    })
}

/// Leaves the checkpoint of an interrupted run, which then fails, or of one whose time is up, if its place is given. Whether
/// it did.
fn save_checkpoint(arguments: &Arguments, fitted: &Fitted, context: &Context) -> Result<bool, Failure> {
    let path = arguments.kept();
    let unwritten = |e: CheckpointError| format!("cannot write {}: {e}", path.display());
    if interrupt::is_requested() {
        let place = leave(&fitted.checkpoint, &path).map_err(|e| Failure::new(unwritten(e)))?;
        let [made, all] = fitted.checkpoint.rounds();
        let unit = unit(fitted);
        return Err(Failure::new(format!("interrupted after {made} of {all} {unit}"))
            .try_instead(&format!("--resume {} goes on from there", place.display())));
    }
    if !fitted.report.interrupted || arguments.checkpoint.is_none() {
        return Ok(false);
    }
    // The model is still to be written, and worth more.
    let written = fitted.checkpoint.write(&path);
    let is_left = written.is_ok();
    written.unwrap_or_else(|e| context.warn(&unwritten(e)));
    Ok(is_left)
}

/// Pairs of points: lines of six numbers, of which blank ones and those that begin with `#` are skipped.
fn read_anchors(path: &Path) -> Result<Vec<(DVec3, DVec3)>, Failure> {
    let name = path.display();
    let text = std::fs::read_to_string(path)
        .map_err(|e| Failure::new(format!("cannot read the anchors {name}: {e}")))?;
    let lines =
        text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.trim_start().starts_with('#'));
    let pair = |(number, line): (usize, &str)| {
        let numbers: Option<Vec<f64>> =
            line.split_whitespace().map(|w| w.parse().ok().filter(|x: &f64| x.is_finite())).collect();
        match numbers.as_deref() {
            Some(&[a, b, c, d, e, f]) => Ok((DVec3::new(a, b, c), DVec3::new(d, e, f))),
            _ => Err(Failure::new(format!("{name}: line {} does not hold six numbers", number + 1))),
        }
    };
    lines.map(pair).collect()
}

/// A file of JSON lines, which appears with the first of them or at the end: a run that never trains leaves none. Every
/// line is written at once, and what cannot be written fails when all else is done.
struct Log<'a> {
    path: &'a Path,
    /// Whether lines follow those of the run that is resumed.
    appends: bool,
    file: Option<File>,
    error: Option<std::io::Error>,
}

impl<'a> Log<'a> {
    fn new(path: &'a Path, appends: bool) -> Self {
        Self { path, appends, file: None, error: None }
    }

    fn add(&mut self, record: &Record<'_>) {
        if let Err(error) = self.write(record) {
            self.error.get_or_insert(error);
        }
    }

    fn write(&mut self, record: &Record<'_>) -> std::io::Result<()> {
        let line = match record {
            Record::Network(record) => Self::of_network(record),
            Record::Levels(record) => serde_json::to_value(record)?,
        };
        self.opened()?.write_all(format!("{line}\n").as_bytes())
    }

    fn of_network(record: &LogRecord<'_>) -> serde_json::Value {
        let mut line = json!({
            "epoch": record.losses.epoch,
            "rate": record.losses.rate,
            "cycle": record.losses.cycle,
            "flipped_fraction": record.flipped_fraction,
            "seconds": record.seconds,
            "seconds_projecting": record.seconds_projecting,
        });
        for (term, mean) in record.terms {
            line[term] = (*mean).into();
        }
        line
    }

    fn opened(&mut self) -> std::io::Result<&mut File> {
        let mut options = File::options();
        options.create(true).write(true).append(self.appends).truncate(!self.appends);
        match &mut self.file {
            Some(file) => Ok(file),
            none => Ok(none.insert(options.open(self.path)?)),
        }
    }

    fn finish(mut self) -> Result<(), Failure> {
        let opened = self.opened().map(drop);
        match self.error.or(opened.err()) {
            Some(e) => Err(Failure::new(format!("cannot write {}: {e}", self.path.display()))),
            None => Ok(()),
        }
    }
}

fn read_base(path: &Path, context: &Context) -> Result<ManifoldMesh, Failure> {
    let file = read_faces(path, context)?;
    if let Some(vertex) = file.mesh.beyond_reach() {
        let far = format!("the base mesh {}: vertex {vertex} lies beyond 1e75", path.display());
        return Err(Failure::new(far).try_instead("scale it down"));
    }
    ManifoldMesh::try_from(file.mesh).map_err(|e| {
        let failure = Failure::new(format!("the base mesh {} is {e}", path.display()));
        failure.try_instead("`ndf mesh` makes a manifold of any mesh that encloses a volume")
    })
}

fn read_checkpoint(path: &Path) -> Result<Checkpoint, Failure> {
    let name = path.display();
    Checkpoint::read(path).map_err(|e| match e {
        CheckpointError::Io(e) => Failure::new(format!("cannot read the checkpoint {name}: {e}")),
        e => Failure::new(format!("{name} is {e}"))
            .try_instead("a run of `ndf fit` that is interrupted leaves one"),
    })
}

fn outcome(path: &str, fitted: &Fitted, seconds_reading: f64) -> Result<Outcome, Failure> {
    let report = &fitted.report;
    let figures = fitted.figures();
    let mut json = serde_json::to_value(&figures)?;
    json["output"] = path.into();
    json["seconds_reading"] = seconds_reading.into();
    let counts =
        format!("{} faces, {} vertices", grouped(figures.base_faces), grouped(figures.base_vertices));
    let base = match base_remark(fitted) {
        Some(remark) => format!("{counts}; {remark}"),
        None => counts,
    };
    let mut training = format!("{} in {:.1} s", rounds(fitted), report.seconds);
    if fitted.model.field.network().is_some() {
        training += &format!(", of which projecting {:.1} s", report.seconds_projecting);
    }
    let mut rows = vec![("input", fitted.kind.to_string())];
    if let Some(level) = fitted.level {
        rows.push(("level", format!("{}, {}", readable(level.value), level.rule)));
    }
    rows.push(("base mesh", base));
    rows.extend(fitted.band.as_ref().map(|band| ("cached field", cache_row(band))));
    rows.extend([
        (
            "distance to the input",
            format!(
                "mean {}, rms {}, at most {}",
                readable(fitted.distance_mean()),
                readable(fitted.distance_rms()),
                readable(fitted.distance_max())
            ),
        ),
        ("turned against it", format!("{:.3} %", 100.0 * report.flipped_fraction)),
        ("training", training),
    ]);
    if let Some(metric) = &fitted.metric_report {
        let ratio = metric.area_ratio;
        rows.push((
            "metric",
            format!("area of the input {ratio:.5} times the model's, measured in {:.2} s", metric.seconds),
        ));
    } else if fitted.model.field.levels().is_some() {
        rows.push((
            "metric",
            "none: too much of the model has no true area over it (folds, walls)".to_owned(),
        ));
    }
    Ok(Outcome::new(json, format!("{path}: {} bytes\n{}", grouped(figures.model_bytes), table(&rows))))
}

/// How many epochs a network was trained, or how many iterations levels took.
pub fn rounds(fitted: &Fitted) -> String {
    format!("{} {}", grouped(fitted.report.epochs), unit(fitted))
}

fn unit(fitted: &Fitted) -> &'static str {
    if fitted.model.field.network().is_some() { "epochs" } else { "iterations" }
}

/// How a base mesh that was made from an isosurface came about.
fn base_remark(fitted: &Fitted) -> Option<String> {
    let report = fitted.base_report.as_ref().filter(|report| report.grid.is_some())?;
    let rim = match report.boundary_edges {
        0 => "closed".to_owned(),
        edges => format!("open, with {edges} boundary edges"),
    };
    let euler = report.euler_characteristic;
    let components = match ValidationReport::of(&fitted.base).components {
        1 => "1 component".to_owned(),
        components => format!("{} components", grouped(components)),
    };
    Some(format!("{components} of the isosurface, Euler characteristic {euler}, {rim}"))
}

fn cache_row(BandFigures { report, agreement, diagonal }: &BandFigures) -> String {
    let relative = |length: f64| format!("{:.1e}", length / diagonal);
    format!(
        "{} cubes in {:.1} s; feet off by {} of the diagonal in the median, {} rms, {} at most",
        grouped(report.cubes),
        report.seconds,
        relative(agreement.median),
        relative(agreement.rms),
        relative(agreement.max)
    )
}
