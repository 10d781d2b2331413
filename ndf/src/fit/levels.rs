//! Learning levels: one base mesh and size, or several until a distance is reached.

use std::rc::Rc;
use std::time::{Duration, Instant};

use ndf_core::{Progress, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_meshing::BaseMeshReport;
use ndf_model::file::StoredBase;
use ndf_model::{Model, Similarity};
use ndf_train::levels::{
    Attempt, Budget, LevelCheckpoint, LevelFit, LevelFitError, LevelOptions, LevelTrainer, Search,
};
use ndf_train::{Checkpoint, Learning, Likeness, Settings, level_provenance, measure_metric, stored_base};

use super::notes::Notes;
use super::{Base, Fit, FitError, Fitted, OnCheckpoint, OnRecord, PROGRAM, Record, faces, file_name};
use crate::Note;
use crate::band::Band;
use crate::model::to_world;
use crate::presets::{BASE_FACES, project_every};
use crate::size_search::{MAX_ATTEMPTS, SizeSearch};

/// A base mesh, ready for levels.
struct LevelBase<'a> {
    /// In the surface's units.
    mesh: ManifoldMesh,
    /// In the box, as a file keeps it.
    boxed: ManifoldMesh,
    similarity: Similarity,
    report: Option<BaseMeshReport>,
    /// What is to be said of it.
    notes: Vec<Note>,
    band: Option<Band<'a>>,
}

/// What was learned on a base mesh.
struct Learned<'a> {
    base: Rc<LevelBase<'a>>,
    options: LevelOptions,
    fit: LevelFit,
    checkpoint: LevelCheckpoint,
}

/// Learns on one base mesh after the other.
struct Learner<'f, 'a> {
    fit: &'f Fit<'a>,
    surface: &'f Likeness,
    log: Option<OnRecord<'a>>,
    keep: Option<(Duration, OnCheckpoint<'a>)>,
    /// When the last checkpoint was passed on, or else the run began: attempts may be shorter than the time between two.
    kept_at: Instant,
    /// What of the time limit is over when.
    deadline: Option<Instant>,
    /// What is to be resumed.
    resumed: Option<LevelCheckpoint>,
    /// The last base mesh.
    base: Option<Rc<LevelBase<'f>>>,
}

impl Fit<'_> {
    pub(super) fn run_levels(mut self, surface: &Likeness) -> Result<Fitted, FitError> {
        let started = Instant::now();
        self.refuse_what_is_of_networks()?;
        let mut notes = Notes { all: Vec::new(), noted: self.noted.take() };
        let (log, keep) = (self.log.take(), self.keep.take());
        let resumed = match std::mem::replace(&mut self.base, Base::Suited) {
            Base::Resumed(Checkpoint { learning: Learning::Levels(checkpoint), .. }) => Some(*checkpoint),
            base => {
                self.base = base;
                None
            }
        };
        let (options, search, limit) = match &resumed {
            Some(checkpoint) => (*checkpoint.options(), checkpoint.search.clone(), checkpoint.time_left()),
            None => {
                let suits_base = matches!(self.base, Base::Suited);
                let search = self.error.map(|wanted| Search { wanted, suits_base, attempts: Vec::new() });
                (self.levels, search, self.levels.time_limit)
            }
        };
        let deadline = limit.and_then(|limit| started.checked_add(limit));
        let mut learner =
            Learner { fit: &self, surface, log, keep, kept_at: started, deadline, resumed, base: None };
        let learned = match search {
            None => learner.learn(&options, None, self.progress)?,
            Some(search) => learner.search(&options, search, &mut notes)?,
        };
        drop(learner);
        notes.add_all(&learned.base.notes);
        Ok(self.finish(learned, surface, notes))
    }

    /// Makes a base mesh, where none was brought, and caches the field where that is costly.
    fn level_base(&self, options: &LevelOptions, progress: &dyn Progress) -> Result<LevelBase<'_>, FitError> {
        let made = match &self.base {
            Base::Suited => Some(faces(options.budget.base_faces().unwrap_or(BASE_FACES))),
            Base::Made(options) => Some(*options),
            Base::Brought(_) | Base::Resumed(_) => None,
        };
        // Control vertices have a grid of their own.
        let settings = Settings { precision: None, ..self.settings.clone() };
        let stored = |mesh: &ManifoldMesh| stored_base(&*self.opened.surface, mesh, &settings);
        let (stored, report, notes) = match (made, &self.base) {
            (Some(options), _) => {
                let (made, notes) = self.opened.base_mesh(&options, progress)?;
                (stored(&made.mesh)?, Some(made.report), notes)
            }
            (None, Base::Brought(mesh)) => (stored(mesh)?, None, Vec::new()),
            (None, _) => return Err(FitError::NotOfLevels("checkpoint of a network")),
        };
        let StoredBase { mesh, similarity, .. } = stored;
        self.around(mesh, similarity, report, notes, progress)
    }

    fn around(
        &self,
        boxed: ManifoldMesh,
        similarity: Similarity,
        report: Option<BaseMeshReport>,
        notes: Vec<Note>,
        progress: &dyn Progress,
    ) -> Result<LevelBase<'_>, FitError> {
        let mesh = to_world(&boxed, &similarity);
        let band = self.opened.band(&mesh, progress)?;
        Ok(LevelBase { mesh, boxed, similarity, report, notes, band })
    }

    /// Refuses what has no meaning for levels, and distances that are no shares.
    fn refuse_what_is_of_networks(&self) -> Result<(), FitError> {
        if self.error.is_some_and(|share| !(share > 0.0 && share < 1.0)) {
            return Err(FitError::Levels(LevelFitError::Option(
                "the mean distance must be a share of the diagonal",
            )));
        }
        match self.only_of_networks() {
            Some(what) => Err(FitError::NotOfLevels(what)),
            None => Ok(()),
        }
    }

    fn finish(&self, learned: Learned<'_>, surface: &Likeness, mut notes: Notes<'_>) -> Fitted {
        let Learned { base, options, fit, checkpoint } = learned;
        let LevelFit { field, report, .. } = fit;
        let is_cancelled = self.progress.cancelled();
        if report.interrupted && !is_cancelled {
            let [rounds, of] = checkpoint.iterations();
            notes.add(Note::TimeUp { rounds, of });
        }
        notes.add_result(&report);
        let provenance = level_provenance(PROGRAM, file_name(self.opened).as_deref(), &options, &report);
        let similarity = base.similarity;
        let measured = field.level_surface().filter(|_| !is_cancelled).and_then(|finest| {
            measure_metric(&*self.opened.surface, &similarity, finest.points(), finest.faces())
        });
        let (metric, metric_report) = measured.unzip();
        Fitted {
            model: Model { field, similarity, metric, scalars: Vec::new(), provenance },
            report,
            kind: self.opened.kind,
            level: self.opened.level,
            base: base.mesh.clone(),
            base_report: base.report.clone(),
            band: base.band.as_ref().map(|band| band.figures),
            metric_report,
            checkpoint: Checkpoint::from(checkpoint).of(surface),
            notes: notes.all,
        }
    }
}

impl<'f> Learner<'f, '_> {
    /// Learns on the base mesh that goes with these options, or goes on from what is to be resumed.
    fn learn(
        &mut self,
        options: &LevelOptions,
        search: Option<&Search>,
        progress: &dyn Progress,
    ) -> Result<Learned<'f>, FitError> {
        let resumed = self.resumed.take();
        let base = match &resumed {
            Some(checkpoint) => {
                let (boxed, similarity) = (checkpoint.base().clone(), checkpoint.similarity());
                Rc::new(self.fit.around(boxed, similarity, None, Vec::new(), progress)?)
            }
            None => {
                // A base mesh that does not depend on the size is made once.
                let kept = self.base.take().filter(|_| search.is_some_and(|search| !search.suits_base));
                kept.map_or_else(|| self.fit.level_base(options, progress).map(Rc::new), Ok)?
            }
        };
        self.base = Some(Rc::clone(&base));
        let truth = &*self.fit.opened.surface;
        let surface: &dyn Surface = base.band.as_ref().map_or(truth, |band| &band.surface);
        let time_limit = self.deadline.map(|at| at.saturating_duration_since(Instant::now()));
        let options = LevelOptions { time_limit, ..*options };
        let mut trainer = match resumed {
            Some(checkpoint) => LevelTrainer::resumed(surface, checkpoint, progress)?,
            None => LevelTrainer::new(surface, base.similarity, &base.boxed, &options, progress)?,
        };
        trainer = trainer.projecting_every(project_every(self.fit.opened.kind));
        if base.band.is_some() {
            trainer = trainer.finished_on(truth);
        }
        if let Some(log) = &mut self.log {
            trainer = trainer.logging(|record| log(&Record::Levels(record)));
        }
        if let Some((every, keep)) = &mut self.keep {
            let (surface, last, kept_at) = (self.surface, self.kept_at, &mut self.kept_at);
            trainer = trainer.keeping(*every, last, |mut checkpoint| {
                checkpoint.search = search.cloned();
                keep(&Checkpoint::from(checkpoint).of(surface));
                *kept_at = Instant::now();
            });
        }
        let (fit, mut checkpoint) = trainer.train()?;
        checkpoint.search = search.cloned();
        Ok(Learned { base, options, fit, checkpoint })
    }

    /// Learns models of several sizes; gives the smallest that is close enough, or else the closest.
    fn search(
        &mut self,
        options: &LevelOptions,
        mut search: Search,
        notes: &mut Notes<'_>,
    ) -> Result<Learned<'f>, FitError> {
        let sized = |bytes| LevelOptions { budget: Budget::Bytes(bytes), ..*options };
        let mut sizes = SizeSearch::new(search.wanted);
        let (mut best, mut best_size, mut last) = (None, None, None);
        for &Attempt { asked, bytes, mean } in &search.attempts {
            if sizes.learn(asked, bytes, mean) {
                best_size = Some(asked);
            }
        }
        let mut interrupted = false;
        while let Some(asked) = sizes.next() {
            let turn = Turn { progress: self.fit.progress, number: search.attempts.len() };
            match self.learn(&sized(asked), Some(&search), &turn) {
                Ok(learned) if learned.fit.report.interrupted => {
                    interrupted = true;
                    last = Some(learned.checkpoint.clone());
                    best.get_or_insert(learned);
                    break;
                }
                Ok(learned) => {
                    let (bytes, mean) = (learned.fit.bytes, learned.fit.mean);
                    last = Some(learned.checkpoint.clone());
                    if sizes.learn(asked, bytes, mean) {
                        (best, best_size) = (Some(learned), Some(asked));
                    }
                    search.attempts.push(Attempt { asked, bytes, mean });
                }
                // The end of the last attempt is where to go on.
                Err(FitError::Cancelled) if best.is_some() => {
                    interrupted = true;
                    break;
                }
                Err(error) if best_size.is_none() || matches!(error, FitError::Cancelled) => {
                    return Err(error);
                }
                Err(error) => {
                    notes.add(Note::SearchStopped { reason: error.to_string() });
                    break;
                }
            }
        }
        let mut learned = match (best, best_size) {
            (Some(best), _) => best,
            // The best was tried before the run was resumed.
            (None, size) => {
                let turn = Turn { progress: self.fit.progress, number: MAX_ATTEMPTS - 1 };
                let size = size.expect("a search tries at least one size");
                self.learn(&sized(size), Some(&search), &turn)?
            }
        };
        self.fit.progress.report("levels", 1.0);
        if interrupted {
            learned.fit.report.interrupted = true;
            learned.checkpoint = last.unwrap_or(learned.checkpoint);
        }
        if learned.fit.mean > search.wanted && !self.fit.progress.cancelled() {
            notes.add(Note::ErrorMissed { wanted: search.wanted, reached: learned.fit.mean });
        }
        Ok(learned)
    }
}

/// One attempt of a search, as its observer sees it: a share of the whole, of which only the first tells how its base mesh is
/// made.
struct Turn<'a> {
    progress: &'a dyn Progress,
    number: usize,
}

impl Progress for Turn<'_> {
    fn report(&self, stage: &str, fraction: f64) {
        if stage == "levels" {
            self.progress.report(stage, (self.number as f64 + fraction) / MAX_ATTEMPTS as f64);
        } else if self.number == 0 {
            self.progress.report(stage, fraction);
        }
    }

    fn detail(&self, text: &str) {
        self.progress.detail(text);
    }

    fn cancelled(&self) -> bool {
        self.progress.cancelled()
    }
}
