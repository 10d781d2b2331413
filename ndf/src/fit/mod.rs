//! Learning a surface: everything between an opened surface and a model.

mod levels;

use std::sync::Arc;
use std::time::Duration;

use ndf_core::{DVec3, NoProgress, Progress, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_meshing::{BaseMeshError, BaseMeshOptions, BaseMeshReport};
use ndf_model::Model;
use ndf_model::file::StoredBase;
use ndf_surfaces::narrow_band::BandError;
use ndf_train::levels::{LevelFitError, LevelOptions};
use ndf_train::objective::Term;
use ndf_train::{
    Checkpoint, FitReport, LogRecord, MetricReport, Settings, TrainError, Trainer, provenance, stored_base,
    train,
};

use crate::band::BandFigures;
use crate::base::NoBaseMesh;
use crate::model::{ModelExt, to_world};
use crate::presets::{BASE_FACES, NOTABLY_FLIPPED, Preset, TRUE_EPOCHS};
use crate::{Kind, Level, Note, Opened};

/// Called at the end of every batch.
type OnBatch<'a> = Box<dyn FnMut(&LogRecord<'_>) + 'a>;

/// Called with every note.
type OnNote<'a> = Box<dyn FnMut(&Note) + 'a>;

/// A training run to be: a surface, a base mesh and settings, each with the defaults of the program `ndf`.
///
/// The result is a function of these alone; the number of threads does not matter.
#[must_use = "nothing is learned before `run`"]
pub struct Fit<'a> {
    opened: &'a Opened,
    settings: Settings,
    levels: Option<LevelOptions>,
    error: Option<f64>,
    base: Base<'a>,
    anchors: Vec<(DVec3, DVec3)>,
    terms: Vec<(f32, Arc<dyn Term>)>,
    progress: &'a dyn Progress,
    log: Option<OnBatch<'a>>,
    noted: Option<OnNote<'a>>,
}

/// What training starts from.
enum Base<'a> {
    /// A base mesh that is made, of as many faces as suit what is learned.
    Suited,
    /// A base mesh that is made.
    Made(BaseMeshOptions),
    /// A base mesh that is brought.
    Brought(&'a ManifoldMesh),
    /// A run that was not finished.
    Resumed(Box<Checkpoint>),
}

/// Why nothing was learned.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// There is no base mesh.
    #[error(transparent)]
    NoBaseMesh(NoBaseMesh),
    /// The field could not be cached around the base mesh.
    #[error("the field around the base mesh cannot be sampled: {0}")]
    Band(BandError),
    /// Training did not end well.
    #[error(transparent)]
    Training(#[from] TrainError),
    /// Levels could not be learned.
    #[error(transparent)]
    Levels(#[from] LevelFitError),
    /// Anchors, terms, logs, checkpoints and settings are those of networks.
    #[error("a field of levels has no {0}; learn a network instead")]
    NotOfLevels(&'static str),
    /// The observer asked to stop before training began, so that there is nothing to keep.
    #[error("interrupted before training began")]
    Cancelled,
}

impl FitError {
    fn is_cancelled(&self) -> bool {
        matches!(self, Self::Cancelled | Self::Levels(LevelFitError::Cancelled(_)))
    }
}

impl From<NoBaseMesh> for FitError {
    fn from(error: NoBaseMesh) -> Self {
        match error {
            NoBaseMesh::Making(BaseMeshError::Cancelled) => Self::Cancelled,
            error => Self::NoBaseMesh(error),
        }
    }
}

impl From<BandError> for FitError {
    fn from(error: BandError) -> Self {
        match error {
            BandError::Cancelled => Self::Cancelled,
            error => Self::Band(error),
        }
    }
}

/// A model with the figures of its making.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Fitted {
    /// The model.
    pub model: Model,
    /// Figures of the training. Its distances are in the box [-1.5, 1.5]³ that the base mesh fills;
    /// [`distance_rms`](Self::distance_rms) has them in the surface's units.
    pub report: FitReport,
    /// What represents the surface that was learned.
    pub kind: Kind,
    /// The level of its field, where that was chosen.
    pub level: Option<Level>,
    /// The base mesh from which the field was learned, in the surface's units: the one that the model keeps, but for a
    /// field of levels, which keeps control vertices.
    pub base: ManifoldMesh,
    /// How it came about, where it was made.
    pub base_report: Option<BaseMeshReport>,
    /// How far the cached copy of the field was right, where there was one.
    pub band: Option<BandFigures>,
    /// How the metric of the model was measured, where it has one.
    pub metric_report: Option<MetricReport>,
    /// Enough to go on: from the end, or from where the run was stopped. A field of levels has none.
    pub checkpoint: Option<Checkpoint>,
    /// What was left out, or is doubtful.
    pub notes: Vec<Note>,
}

impl<'a> Fit<'a> {
    /// A run with the default settings for this kind of surface, on a base mesh of 4000 faces, or of as many as suit the
    /// budget of levels.
    pub fn new(opened: &'a Opened) -> Self {
        Self {
            opened,
            settings: Preset::Default.settings(opened.kind),
            levels: None,
            error: None,
            base: Base::Suited,
            anchors: Vec::new(),
            terms: Vec::new(),
            progress: &NoProgress,
            log: None,
            noted: None,
        }
    }

    /// All settings of a preset for this kind of surface, the seed aside. Takes the place of settings made before.
    pub fn preset(self, preset: Preset) -> Self {
        let seed = self.settings.seed;
        Self { settings: Settings { seed, ..preset.settings(self.opened.kind) }, ..self }
    }

    /// All settings. [`Preset::settings`] has those of a kind of surface to start from.
    pub fn settings(self, settings: Settings) -> Self {
        Self { settings, ..self }
    }

    /// Changes some settings.
    ///
    /// ```no_run
    /// # let opened = ndf::open("a.obj", &ndf::OpenOptions::default())?;
    /// let fit = ndf::Fit::new(&opened).with(|settings| settings.lambda_n = 1.0);
    /// # Ok::<(), ndf::OpenError>(())
    /// ```
    pub fn with(mut self, change: impl FnOnce(&mut Settings)) -> Self {
        change(&mut self.settings);
        self
    }

    /// Learns levels of displacements instead of a network, in fewer bytes at the same distance. Settings of networks
    /// and their training are refused then, and of the seeds [`LevelOptions::seed`] alone counts.
    pub fn levels(self, options: LevelOptions) -> Self {
        Self { levels: Some(options), ..self }
    }

    /// Learns levels in as few bytes as this mean distance from the surface allows, a share of its diagonal: a handful of
    /// sizes are tried, each with the base mesh that suits it unless there is one, and the best is kept. The budget of
    /// [`levels`](Self::levels) does not count. An observer that stops the search ends the run.
    pub fn error(self, share: f64) -> Self {
        Self { error: Some(share), levels: self.levels.or_else(|| Some(LevelOptions::default())), ..self }
    }

    /// Epochs of training.
    pub fn epochs(self, epochs: usize) -> Self {
        self.with(|settings| settings.epochs = epochs)
    }

    /// Samples in a batch.
    pub fn samples(self, samples: usize) -> Self {
        self.with(|settings| settings.samples = samples)
    }

    /// Features of every base vertex.
    pub fn features(self, features: usize) -> Self {
        self.with(|settings| settings.field.network.features = features)
    }

    /// Seed of everything random.
    pub fn seed(self, seed: u64) -> Self {
        self.with(|settings| settings.seed = seed)
    }

    /// Ends training after this long, with what is learned by then.
    pub fn time_limit(self, limit: Duration) -> Self {
        self.with(|settings| settings.time_limit = Some(limit))
    }

    /// Makes a base mesh of this many faces.
    pub fn base_faces(self, faces: usize) -> Self {
        Self { base: Base::Made(BaseMeshOptions { faces, ..BaseMeshOptions::default() }), ..self }
    }

    /// Uses this base mesh, in the surface's units, instead of making one.
    pub fn base(self, mesh: &'a ManifoldMesh) -> Self {
        Self { base: Base::Brought(mesh), ..self }
    }

    /// Goes on from a checkpoint, with its base mesh and settings; those made here do not count. Anchors and
    /// terms must be those of the run before.
    pub fn resume(self, checkpoint: Checkpoint) -> Self {
        Self { base: Base::Resumed(Box::new(checkpoint)), ..self }
    }

    /// Points of the base mesh and where their images should be (supplement, Eq. 3), in the surface's units.
    pub fn anchors(self, pairs: impl IntoIterator<Item = (DVec3, DVec3)>) -> Self {
        Self { anchors: pairs.into_iter().collect(), ..self }
    }

    /// Adds a term of one's own to the objective.
    pub fn term(mut self, weight: f32, term: Arc<dyn Term>) -> Self {
        self.terms.push((weight, term));
        self
    }

    /// Reports to this observer, which may stop the run: before training with [`FitError::Cancelled`], then with what
    /// is learned so far and a checkpoint to go on from.
    pub fn progress(self, progress: &'a dyn Progress) -> Self {
        Self { progress, ..self }
    }

    /// Calls this at the end of every batch. Costs a tenth of an epoch.
    pub fn log(self, log: impl FnMut(&LogRecord<'_>) + 'a) -> Self {
        Self { log: Some(Box::new(log)), ..self }
    }

    /// Calls this with every note as soon as it is known; [`Fitted::notes`] has all of them at the end.
    pub fn on_note(self, noted: impl FnMut(&Note) + 'a) -> Self {
        Self { noted: Some(Box::new(noted)), ..self }
    }

    /// Makes the base mesh, caches the field where that is costly, and trains. A run that is stopped gives what it has
    /// learned, which [`FitReport::interrupted`] says; its checkpoint lets it go on.
    ///
    /// # Errors
    /// If there is no base mesh, the settings are not usable, training diverges, or the run is stopped before training.
    pub fn run(self) -> Result<Fitted, FitError> {
        match self.levels {
            Some(options) => self.run_levels(&options),
            None => self.run_network(),
        }
    }

    fn run_network(self) -> Result<Fitted, FitError> {
        let Self { opened, settings, base, anchors, terms, progress, mut log, noted, .. } = self;
        let mut notes = Notes { all: Vec::new(), noted };
        let ready = |base: &ManifoldMesh| stored_base(&*opened.surface, base, &settings);
        let mut base_report = None;
        let mut made = |options: &BaseMeshOptions| {
            let (made, told) = opened.base_mesh(options, progress)?;
            told.into_iter().for_each(|note| notes.add(note));
            base_report = Some(made.report);
            Ok::<_, FitError>(Start::Fresh(Box::new(ready(&made.mesh)?)))
        };
        let start = match base {
            Base::Resumed(checkpoint) => Start::Resumed(checkpoint),
            Base::Brought(mesh) => Start::Fresh(Box::new(ready(mesh)?)),
            Base::Made(options) => made(&options)?,
            Base::Suited => made(&faces(BASE_FACES))?,
        };
        let base = start.base();
        let band = opened.band(&base, progress)?;
        let surface: &dyn Surface = band.as_ref().map_or(&*opened.surface, |band| &band.surface);
        let mut trainer = match start {
            Start::Resumed(checkpoint) => Trainer::resumed(surface, *checkpoint)?,
            Start::Fresh(base) => Trainer::with_stored_base(surface, *base, &settings)?,
        };
        if band.is_some() {
            trainer = trainer.finished_on(&*opened.surface, TRUE_EPOCHS);
        }
        if !anchors.is_empty() {
            trainer = trainer.with_anchors(&anchors);
        }
        for (weight, term) in terms {
            trainer = trainer.with_term(weight, term);
        }
        let log = log.as_mut().map(|log| log as ndf_train::Log<'_>);
        let (fit, checkpoint) = train(&mut trainer, log, progress)?;
        drop(trainer);
        notes.add_training(&fit.report, checkpoint.settings(), progress.cancelled());
        let file_name = file_name(opened);
        let provenance = provenance(PROGRAM, file_name.as_deref(), checkpoint.settings(), &fit.report);
        let (similarity, metric, scalars) = (fit.similarity, None, Vec::new());
        Ok(Fitted {
            model: Model { field: fit.field, similarity, metric, scalars, provenance },
            report: fit.report,
            kind: opened.kind,
            level: opened.level,
            base,
            base_report,
            band: band.as_ref().map(|band| band.figures),
            metric_report: None,
            checkpoint: Some(checkpoint),
            notes: notes.all,
        })
    }
}

/// What provenance calls this program.
const PROGRAM: &str = concat!("ndf ", env!("CARGO_PKG_VERSION"));

fn faces(faces: usize) -> BaseMeshOptions {
    BaseMeshOptions { faces, ..BaseMeshOptions::default() }
}

fn file_name(opened: &Opened) -> Option<String> {
    let name = opened.path.as_deref().and_then(std::path::Path::file_name);
    name.map(|name| name.to_string_lossy().into_owned())
}

impl Fitted {
    /// Root of the mean squared distance of the learned surface from the true one, in its units.
    pub fn distance_rms(&self) -> f64 {
        self.model.similarity.length_to_world(self.report.projection_rms)
    }

    /// The largest of these distances.
    pub fn distance_max(&self) -> f64 {
        self.model.similarity.length_to_world(self.report.projection_max)
    }
}

/// What training starts from, ready.
enum Start {
    Fresh(Box<StoredBase>),
    Resumed(Box<Checkpoint>),
}

impl Start {
    /// The base mesh as the model keeps it, in the units of the input: a run that is resumed finds the same.
    fn base(&self) -> ManifoldMesh {
        match self {
            Self::Fresh(base) => to_world(&base.mesh, &base.similarity),
            Self::Resumed(checkpoint) => checkpoint.model().base_in_world(),
        }
    }
}

/// Notes so far, and who is told of each.
struct Notes<'a> {
    all: Vec<Note>,
    noted: Option<OnNote<'a>>,
}

impl Notes<'_> {
    fn add_all(&mut self, notes: &[Note]) {
        notes.iter().for_each(|note| self.add(note.clone()));
    }

    fn add(&mut self, note: Note) {
        if let Some(noted) = &mut self.noted {
            noted(&note);
        }
        self.all.push(note);
    }

    fn add_training(&mut self, report: &FitReport, settings: &Settings, cancelled: bool) {
        if report.interrupted && !cancelled {
            let of = settings.epochs + settings.identity_epochs;
            self.add(Note::TimeUp { epochs: report.epochs, of });
        }
        if report.retreats > 0 {
            self.add(Note::Diverged { times: report.retreats });
        }
        self.add_result(report);
    }

    fn add_result(&mut self, report: &FitReport) {
        if report.flipped_fraction > NOTABLY_FLIPPED {
            self.add(Note::Flipped { share: report.flipped_fraction });
        }
        if report.missed_fraction > 0.0 {
            self.add(Note::Missed { share: report.missed_fraction });
        }
    }
}
