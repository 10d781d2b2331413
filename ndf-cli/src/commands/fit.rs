//! `ndf fit`: learn a surface.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use ndf_core::{DVec3, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::io::atomic_write;
use ndf_meshing::BaseMeshOptions;
use ndf_model::Model;
use ndf_model::file::StoredBase;
use ndf_train::{
    Checkpoint, CheckpointError, Fit, FitReport, LogRecord, Trainer, provenance, stored_base, train,
};
use serde_json::{Value, json};

use super::extract::to_world;
use super::read_faces;
use super::training::Training;
use crate::context::Context;
use crate::input::{self, BandFigures, Base, Input, Reading};
use crate::interrupt;
use crate::output::{Failure, Outcome, check_place, grouped, readable, table};

/// Epochs at the end that project onto the true surface where training has a cached copy of it.
const TRUE_EPOCHS: usize = 100;

/// The share of the learned surface from which being turned against the input is worth a warning.
const NOTABLY_FLIPPED: f64 = 0.01;

/// Arguments of `ndf fit`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The surface to learn.
    input: PathBuf,
    /// The model to write.
    #[arg(short, long, value_name = "MODEL.ndf")]
    output: PathBuf,
    #[command(flatten)]
    reading: Reading,
    /// A base mesh to use instead of one that is made.
    #[arg(long, value_name = "FILE", conflicts_with = "base_faces")]
    base: Option<PathBuf>,
    /// Points of the base mesh and where their images should be; lines of six numbers, in the input's units.
    #[arg(long, value_name = "FILE")]
    anchors: Option<PathBuf>,
    /// Where an interrupted run leaves its checkpoint [default: the model's name with .checkpoint]. If given, a run whose
    /// time is up leaves one beside its model, too.
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Go on from a checkpoint, with its base mesh and settings; a time limit may be set anew.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["base", "base_faces", "Training"])]
    resume: Option<PathBuf>,
    /// Write a line of JSON for every batch: losses, rate, share of flipped samples, times.
    #[arg(long, value_name = "FILE.jsonl")]
    log: Option<PathBuf>,
    /// Faces of the base mesh.
    #[arg(long, value_name = "N", default_value_t = 4000, value_parser = clap::value_parser!(u32).range(4..=10_000_000))]
    base_faces: u32,
    #[command(flatten)]
    training: Training,
}

/// Learns a surface and writes the model.
///
/// # Errors
/// If the input is no usable surface, training fails or is interrupted, or the model cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    check_place(&arguments.output)?;
    arguments.checkpoint.as_deref().map(check_place).transpose()?;
    let job = Job {
        input: &arguments.input,
        reading: &arguments.reading,
        base: arguments.base.as_deref(),
        base_faces: arguments.base_faces,
        training: arguments.training,
        anchors: arguments.anchors.as_deref().map(read_anchors).transpose()?.unwrap_or_default(),
        resume: arguments.resume.as_deref(),
        log: arguments.log.as_deref(),
    };
    let (fitted, checkpoint) = fit_file(&job, context)?;
    let write_checkpoint = |path: &Path| {
        checkpoint.write(path).map_err(|e| Failure::new(format!("cannot write {}: {e}", path.display())))
    };
    if interrupt::is_requested() {
        let default = || {
            let mut name = arguments.output.clone().into_os_string();
            name.push(".checkpoint");
            PathBuf::from(name)
        };
        let path = arguments.checkpoint.clone().unwrap_or_else(default);
        write_checkpoint(&path)?;
        let (done, all) =
            (checkpoint.epoch(), checkpoint.settings().epochs + checkpoint.settings().identity_epochs);
        return Err(Failure::new(format!("interrupted after {done} of {all} epochs"))
            .try_instead(&format!("--resume {} goes on from there", path.display())));
    }
    if let (true, Some(path)) = (fitted.report.interrupted, &arguments.checkpoint) {
        write_checkpoint(path)?;
    }
    let bytes = fitted.model.to_bytes();
    let path = arguments.output.display().to_string();
    atomic_write(&arguments.output, |out| out.write_all(&bytes))
        .map_err(|e| Failure::new(format!("cannot write {path}: {e}")))?;
    Ok(outcome(&path, &fitted, bytes.len()))
}

/// What to learn, and how.
pub struct Job<'a> {
    /// The file with the surface.
    pub input: &'a Path,
    /// How the file is to be understood.
    pub reading: &'a Reading,
    /// A base mesh, if one is brought.
    pub base: Option<&'a Path>,
    /// Faces of the base mesh, if one is made.
    pub base_faces: u32,
    /// How to train.
    pub training: Training,
    /// Points of the base mesh and where their images should be.
    pub anchors: Vec<(DVec3, DVec3)>,
    /// A checkpoint to go on from; then base mesh and settings are those of the checkpoint.
    pub resume: Option<&'a Path>,
    /// Where a line for every batch goes.
    pub log: Option<&'a Path>,
}

impl<'a> Job<'a> {
    /// The job of learning `input` with these settings.
    pub fn new(input: &'a Path, reading: &'a Reading, base_faces: u32, training: Training) -> Self {
        Self {
            input,
            reading,
            base: None,
            base_faces,
            training,
            anchors: Vec::new(),
            resume: None,
            log: None,
        }
    }
}

/// A learned model with the figures of its making.
pub struct Fitted {
    /// The model.
    pub model: Model,
    /// The base mesh in the input's units.
    pub base: ManifoldMesh,
    /// How that came about.
    pub base_report: Value,
    /// The same in words.
    pub base_remark: Option<String>,
    /// Seconds in which the input was read and prepared.
    pub seconds_reading: f64,
    /// What was learned from.
    pub input: Input,
    /// How far the cached copy of the input's field was right, where there was one.
    pub band: Option<BandFigures>,
    /// Figures of the training.
    pub report: FitReport,
}

/// Learns the surface in a file. A run that is interrupted gives what it has learned; the checkpoint lets it go on.
///
/// # Errors
/// If the input is no usable surface, or training fails.
pub fn fit_file(job: &Job<'_>, context: &Context) -> Result<(Fitted, Checkpoint), Failure> {
    let name = job.input.display();
    let progress = context.progress().cancelled_by(interrupt::flag());
    // Before training begins there is nothing to keep.
    let unless_interrupted = |failure: Failure| {
        if interrupt::is_requested() {
            Failure::new(format!("{name}: interrupted before training began"))
                .try_instead("nothing was learned, so there is no checkpoint to go on from")
        } else {
            failure
        }
    };
    let checkpoint = job.resume.map(read_checkpoint).transpose()?;
    let started = Instant::now();
    let source = input::open(job.input, job.reading, context)?;
    let seconds_reading = started.elapsed().as_secs_f64();
    let (mut base_report, mut base_remark) = (Value::Null, None);
    let say = |e: &dyn std::fmt::Display| Failure::new(format!("{name}: {e}"));
    let settings = job.training.settings(source.kind, context.seed());
    let ready = |base: &ManifoldMesh| {
        stored_base(&*source.surface, base, &settings)
            .map(|base| Start::Fresh(Box::new(base)))
            .map_err(|e| say(&e))
    };
    let start = match (checkpoint, job.base) {
        (Some(checkpoint), _) => {
            Start::Resumed(Box::new(checkpoint.with_time_limit(job.training.time_limit())))
        }
        (None, Some(path)) => ready(&read_base(path, context)?)?,
        (None, None) => {
            let options = BaseMeshOptions { faces: job.base_faces as usize, ..BaseMeshOptions::default() };
            let made = source.base_mesh(&name.to_string(), &options, context, &progress);
            let Base { mesh, report, remark } = made.map_err(unless_interrupted)?;
            (base_report, base_remark) = (report, remark);
            ready(&mesh)?
        }
    };
    let band = source.band(&name.to_string(), &start.base(), &progress).map_err(unless_interrupted)?;
    let surface: &dyn Surface = band.as_ref().map_or(&*source.surface, |band| &band.surface);
    let mut trainer = match start {
        Start::Resumed(checkpoint) => Trainer::resumed(surface, *checkpoint),
        Start::Fresh(base) => Trainer::on(surface, *base, &settings),
    }
    .map_err(|e| say(&e))?;
    if band.is_some() {
        trainer = trainer.finished_on(&*source.surface, TRUE_EPOCHS);
    }
    if !job.anchors.is_empty() {
        trainer = trainer.with_anchors(&job.anchors);
    }
    let mut log = job.log.map(Log::create).transpose()?;
    let mut write_line = |record: &LogRecord<'_>| {
        if let Some(log) = &mut log {
            log.write(record);
        }
    };
    let lines = job.log.is_some().then_some(&mut write_line as ndf_train::Log<'_>);
    let (Fit { field, similarity, report }, checkpoint) =
        train(&mut trainer, lines, &progress).map_err(|e| say(&e))?;
    drop((trainer, progress));
    let band = band.map(|band| band.figures);
    if let Some(log) = log {
        log.finish()?;
    }
    let settings = checkpoint.settings();
    if report.interrupted && !interrupt::is_requested() {
        let (done, all) = (report.epochs, settings.epochs + settings.identity_epochs);
        context.warn(&format!("the time was up after {done} of {all} epochs"));
    }
    if report.retreats > 0 {
        let times = report.retreats;
        context.warn(&format!(
            "training diverged {times} times and went on at a smaller rate; try a smaller --lr"
        ));
    }
    if report.flipped_fraction > NOTABLY_FLIPPED {
        let share = 100.0 * report.flipped_fraction;
        context.warn(&format!("{share:.1} % of the learned surface is turned against the input"));
    }
    if report.missed_fraction > 0.0 {
        let share = 100.0 * report.missed_fraction;
        context.warn(&format!("{share:.1} % of the learned surface finds no foot on the input"));
    }
    let program = concat!("ndf ", env!("CARGO_PKG_VERSION"));
    let input = job.input.file_name().map(|name| name.to_string_lossy());
    let provenance = provenance(program, input.as_deref(), settings, &report);
    let model = Model { field, similarity, scalars: Vec::new(), provenance };
    let base = base_in_world(&model);
    let fitted =
        Fitted { model, base, base_report, base_remark, input: source, band, seconds_reading, report };
    Ok((fitted, checkpoint))
}

/// What training starts from.
enum Start {
    /// A base mesh.
    Fresh(Box<StoredBase>),
    /// A run that was not finished.
    Resumed(Box<Checkpoint>),
}

impl Start {
    /// The base mesh as the model keeps it, in the units of the input: a run that is resumed finds the same.
    fn base(&self) -> ManifoldMesh {
        match self {
            Self::Fresh(base) => to_world(&base.mesh, &base.similarity),
            Self::Resumed(checkpoint) => base_in_world(checkpoint.model()),
        }
    }
}

/// The base mesh of a model in the units of its input.
fn base_in_world(model: &Model) -> ManifoldMesh {
    to_world(model.field.base(), &model.similarity)
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

/// A file of JSON lines.
struct Log {
    path: PathBuf,
    file: BufWriter<File>,
    error: Option<std::io::Error>,
}

impl Log {
    fn create(path: &Path) -> Result<Self, Failure> {
        let file =
            File::create(path).map_err(|e| Failure::new(format!("cannot write {}: {e}", path.display())))?;
        Ok(Self { path: path.to_owned(), file: BufWriter::new(file), error: None })
    }

    fn write(&mut self, record: &LogRecord<'_>) {
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
        if let Err(e) = writeln!(self.file, "{line}") {
            self.error.get_or_insert(e);
        }
    }

    fn finish(mut self) -> Result<(), Failure> {
        let flushed = self.file.flush();
        match self.error.or(flushed.err()) {
            Some(e) => Err(Failure::new(format!("cannot write {}: {e}", self.path.display()))),
            None => Ok(()),
        }
    }
}

fn read_base(path: &Path, context: &Context) -> Result<ManifoldMesh, Failure> {
    let file = read_faces(path, context)?;
    ManifoldMesh::try_from(file.mesh).map_err(|e| {
        let failure = Failure::new(format!("the base mesh {} is {e}", path.display()));
        failure.try_instead("`ndf mesh` makes a manifold of any mesh that encloses a volume")
    })
}

fn read_checkpoint(path: &Path) -> Result<Checkpoint, Failure> {
    let name = path.display();
    Checkpoint::read(path).map_err(|e| match e {
        CheckpointError::Io(e) => Failure::new(format!("cannot read the checkpoint {name}: {e}")),
        CheckpointError::Content(_) => Failure::new(format!("{name} is {e}"))
            .try_instead("a run of `ndf fit` that is interrupted leaves one"),
    })
}

fn outcome(path: &str, fitted: &Fitted, bytes: usize) -> Outcome {
    let report = &fitted.report;
    let json = json!({
        "output": path,
        "kind": fitted.input.kind.name(),
        "base": fitted.base_report,
        "level": fitted.input.level.map(|level| level.value),
        "level_rule": fitted.input.level.map(|level| level.rule),
        "cache": fitted.band.as_ref().map(|band| band.json(&fitted.model.similarity)),
        "seconds_reading": fitted.seconds_reading,
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
    let counts = format!(
        "{} faces, {} vertices",
        grouped(fitted.base.face_count()),
        grouped(fitted.base.vertex_count())
    );
    let base = match &fitted.base_remark {
        Some(remark) => format!("{counts}; {remark}"),
        None => counts,
    };
    let mut rows = vec![("input", fitted.input.kind.to_string())];
    if let Some(level) = fitted.input.level {
        rows.push(("level", format!("{}, {}", readable(level.value), level.rule)));
    }
    rows.push(("base mesh", base));
    rows.extend(fitted.band.as_ref().map(|band| ("cached field", band.sentence())));
    rows.extend([
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
    ]);
    Outcome::new(json, format!("{path}: {} bytes\n{}", grouped(bytes), table(&rows)))
}
