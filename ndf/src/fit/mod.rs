//! Learning a surface: everything between an opened surface and a model.

mod brought;
mod error;
mod fitted;
mod levels;
mod network;
mod notes;

use std::sync::Arc;
use std::time::Duration;

use ndf_core::{DVec3, NoProgress, Progress};
use ndf_mesh::ManifoldMesh;
use ndf_meshing::BaseMeshOptions;
use ndf_train::levels::{LevelOptions, LevelRecord};
use ndf_train::objective::Term;
use ndf_train::{Checkpoint, Learning, Likeness, LogRecord, Settings};

use crate::presets::Preset;
use crate::{Note, Opened};

pub use error::FitError;
pub use fitted::Fitted;

/// What displaces a base mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Field {
    /// Levels, unless something is asked for that only networks have.
    #[default]
    Auto,
    /// Displacements along the normal on the levels of the subdivided base mesh.
    Levels,
    /// The paper's network, with features at the base vertices.
    Network,
}

/// A line of the log.
#[derive(Clone, Copy, Debug)]
pub enum Record<'a> {
    /// Of a network, at the end of every batch. Costs a tenth of an epoch.
    Network(&'a LogRecord<'a>),
    /// Of levels, of every run at the end of every iteration.
    Levels(&'a LevelRecord),
}

/// Called with every line of the log.
type OnRecord<'a> = Box<dyn FnMut(&Record<'_>) + 'a>;

/// Called with checkpoints.
type OnCheckpoint<'a> = Box<dyn FnMut(&Checkpoint) + 'a>;

/// Called with every note.
type OnNote<'a> = Box<dyn FnMut(&Note) + 'a>;

/// A training run to be: a surface, a base mesh and settings, each with the defaults of the program `ndf`.
///
/// The result is a function of these alone; the number of threads does not matter.
#[must_use = "nothing is learned before `run`"]
pub struct Fit<'a> {
    opened: &'a Opened,
    field: Field,
    settings: Settings,
    levels: LevelOptions,
    /// What was asked for first of all that only networks have.
    of_networks: Option<&'static str>,
    error: Option<f64>,
    base: Base<'a>,
    anchors: Vec<(DVec3, DVec3)>,
    terms: Vec<(f32, Arc<dyn Term>)>,
    progress: &'a dyn Progress,
    log: Option<OnRecord<'a>>,
    keep: Option<(Duration, OnCheckpoint<'a>)>,
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
    Resumed(Checkpoint),
}

impl<'a> Fit<'a> {
    /// A run with the default settings: levels on a base mesh of 4000 faces, or of as many as suit their budget.
    pub fn new(opened: &'a Opened) -> Self {
        Self {
            opened,
            field: Field::Auto,
            settings: Preset::Default.settings(opened.kind),
            levels: LevelOptions::default(),
            of_networks: None,
            error: None,
            base: Base::Suited,
            anchors: Vec::new(),
            terms: Vec::new(),
            progress: &NoProgress,
            log: None,
            keep: None,
            noted: None,
        }
    }

    /// What is learned. With [`Field::Auto`], settings of networks make a network of it, and a note says so.
    pub fn field(self, field: Field) -> Self {
        Self { field, ..self }
    }

    /// All settings of a network by a preset for this kind of surface, but for seed and time limit. Takes the place of settings
    /// made before.
    pub fn preset(self, preset: Preset) -> Self {
        let Settings { seed, time_limit, .. } = self.settings;
        let settings = Settings { seed, time_limit, ..preset.settings(self.opened.kind) };
        match preset {
            Preset::Default => Self { settings, ..self },
            Preset::Paper => Self { settings, ..self.of_networks("preset of the paper") },
        }
    }

    /// All settings of a network. [`Preset::settings`] has those of a kind of surface to start from.
    pub fn settings(self, settings: Settings) -> Self {
        Self { settings, ..self.of_networks("settings of a network and its training") }
    }

    /// Changes some settings of a network.
    ///
    /// ```no_run
    /// # let opened = ndf::open("a.obj", &ndf::OpenOptions::default())?;
    /// let fit = ndf::Fit::new(&opened).with(|settings| settings.lambda_n = 1.0);
    /// # Ok::<(), ndf::OpenError>(())
    /// ```
    pub fn with(self, change: impl FnOnce(&mut Settings)) -> Self {
        self.of_networks("settings of a network and its training").changed(change)
    }

    fn changed(mut self, change: impl FnOnce(&mut Settings)) -> Self {
        change(&mut self.settings);
        self
    }

    fn of_networks(self, what: &'static str) -> Self {
        Self { of_networks: self.of_networks.or(Some(what)), ..self }
    }

    /// Learns levels with these options. Settings of networks and their training are refused then.
    pub fn levels(self, levels: LevelOptions) -> Self {
        Self { field: Field::Levels, levels, ..self }
    }

    /// Learns levels in as few bytes as this mean distance from the surface allows, a share of its diagonal: a handful of
    /// sizes are tried, each with the base mesh that suits it unless there is one, and the best is kept. The budget of
    /// [`levels`](Self::levels) does not count. An observer that stops the search ends the run.
    pub fn error(self, share: f64) -> Self {
        Self { error: Some(share), field: Field::Levels, ..self }
    }

    /// Epochs of training a network.
    pub fn epochs(self, epochs: usize) -> Self {
        self.of_networks("epochs").changed(|settings| settings.epochs = epochs)
    }

    /// Samples in a batch of a network's training.
    pub fn samples(self, samples: usize) -> Self {
        self.of_networks("samples").changed(|settings| settings.samples = samples)
    }

    /// Features of every base vertex, for a network.
    pub fn features(self, features: usize) -> Self {
        self.of_networks("features").changed(|settings| settings.field.network.features = features)
    }

    /// Seed of everything random.
    pub fn seed(self, seed: u64) -> Self {
        let levels = LevelOptions { seed, ..self.levels };
        Self { levels, ..self.changed(|settings| settings.seed = seed) }
    }

    /// Ends training after this long, with what is learned by then. A search ends with the best model so far.
    pub fn time_limit(self, limit: Duration) -> Self {
        let levels = LevelOptions { time_limit: Some(limit), ..self.levels };
        Self { levels, ..self.changed(|settings| settings.time_limit = Some(limit)) }
    }

    /// Makes a base mesh of this many faces.
    pub fn base_faces(self, faces: usize) -> Self {
        Self { base: Base::Made(BaseMeshOptions { faces, ..BaseMeshOptions::default() }), ..self }
    }

    /// Uses this base mesh, in the surface's units, instead of making one.
    pub fn base(self, mesh: &'a ManifoldMesh) -> Self {
        Self { base: Base::Brought(mesh), ..self }
    }

    /// Goes on from a checkpoint, with its field, base mesh and settings; those made here do not count. Anchors and
    /// terms must be those of the run before.
    pub fn resume(self, checkpoint: Checkpoint) -> Self {
        Self { base: Base::Resumed(checkpoint), ..self }
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

    /// Calls this with every line of the log.
    pub fn log(self, log: impl FnMut(&Record<'_>) + 'a) -> Self {
        Self { log: Some(Box::new(log)), ..self }
    }

    /// Calls this with a checkpoint of the run whenever so much time has passed.
    pub fn on_checkpoint(self, every: Duration, keep: impl FnMut(&Checkpoint) + 'a) -> Self {
        Self { keep: Some((every, Box::new(keep))), ..self }
    }

    /// Calls this with every note as soon as it is known; [`Fitted::notes`] has all of them at the end.
    pub fn on_note(self, noted: impl FnMut(&Note) + 'a) -> Self {
        Self { noted: Some(Box::new(noted)), ..self }
    }

    /// Makes the base mesh, caches the field where that is costly, and trains. A run that is stopped gives what it has
    /// learned, which [`FitReport::interrupted`](ndf_train::FitReport::interrupted) says; its checkpoint lets it go on.
    ///
    /// # Errors
    /// If there is no base mesh or it is nowhere near the surface, the settings are not usable, what is resumed learned another surface, training diverges, or
    /// the run is stopped before training.
    pub fn run(self) -> Result<Fitted, FitError> {
        let mut chosen = None;
        let surface = self.likeness()?;
        if let Base::Brought(mesh) = &self.base {
            brought::check(mesh, &*self.opened.surface)?;
        }
        let field = match (&self.base, self.field) {
            (Base::Resumed(Checkpoint { learning: Learning::Network(_), .. }), _) => Field::Network,
            (Base::Resumed(_), _) => Field::Levels,
            (_, Field::Auto) => {
                chosen = self.only_of_networks();
                chosen.map_or(Field::Levels, |_| Field::Network)
            }
            (_, field) => field,
        };
        match field {
            Field::Network => self.run_network(&surface, chosen.map(|what| Note::NetworkNeeded { what })),
            Field::Levels | Field::Auto => self.run_levels(&surface),
        }
    }

    /// How to know the surface again. What is resumed must know it.
    fn likeness(&self) -> Result<Likeness, FitError> {
        let surface = &*self.opened.surface;
        match &self.base {
            Base::Resumed(Checkpoint { surface: Some(likeness), .. }) => {
                if likeness.is_of(surface) {
                    Ok(likeness.clone())
                } else {
                    Err(FitError::OtherSurface)
                }
            }
            _ => Ok(Likeness::of(surface)),
        }
    }

    /// What was asked for that only networks have. What is resumed has settings of its own.
    fn only_of_networks(&self) -> Option<&'static str> {
        let given = [("anchors", self.anchors.is_empty()), ("terms", self.terms.is_empty())];
        let given = given.into_iter().find(|(_, is_empty)| !is_empty).map(|(what, _)| what);
        self.of_networks.filter(|_| !matches!(self.base, Base::Resumed(_))).or(given)
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
