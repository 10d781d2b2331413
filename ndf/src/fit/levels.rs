//! Learning levels: one base mesh and size, or several until a distance is reached.

use std::rc::Rc;

use ndf_core::Surface;
use ndf_mesh::ManifoldMesh;
use ndf_meshing::BaseMeshReport;
use ndf_model::Model;
use ndf_model::file::StoredBase;
use ndf_train::levels::{Budget, LevelFit, LevelFitError, LevelOptions, fit_levels};
use ndf_train::{Settings, level_provenance, measure_metric, stored_base};

use super::{Base, Fit, FitError, Fitted, Notes, PROGRAM, faces, file_name};
use crate::Note;
use crate::band::Band;
use crate::model::to_world;
use crate::presets::{BASE_FACES, Preset};
use crate::size_search::SizeSearch;

/// A base mesh, ready for levels.
struct LevelBase<'a> {
    /// In the surface's units.
    mesh: ManifoldMesh,
    /// In the box, as a file keeps it.
    stored: StoredBase,
    report: Option<BaseMeshReport>,
    /// What is to be said of it.
    notes: Vec<Note>,
    band: Option<Band<'a>>,
}

impl Fit<'_> {
    pub(super) fn run_levels(mut self, options: &LevelOptions) -> Result<Fitted, FitError> {
        self.refuse_what_is_of_networks()?;
        let mut notes = Notes { all: Vec::new(), noted: self.noted.take() };
        let Some(wanted) = self.error else {
            let base = self.level_base(options)?;
            notes.add_all(&base.notes);
            let fit = self.levels_on(&base, options)?;
            return Ok(self.finish(&base, fit, notes, options));
        };
        let mut search = SizeSearch::new(wanted);
        let (mut base, mut best) = (None, None);
        while let Some(bytes) = search.next() {
            let options = LevelOptions { budget: Budget::Bytes(bytes), ..*options };
            let mut attempt = || {
                // A base mesh that does not depend on the size is made once.
                let kept = base.take().filter(|_| !matches!(self.base, Base::Suited));
                let base = kept.map_or_else(|| self.level_base(&options).map(Rc::new), Ok)?;
                let fit = self.levels_on(&base, &options)?;
                Ok::<_, FitError>((base, fit))
            };
            match attempt() {
                Ok((on, fit)) => {
                    if search.learn(bytes, fit.bytes, fit.mean) {
                        best = Some((Rc::clone(&on), fit, options));
                    }
                    base = Some(on);
                }
                Err(error) if best.is_none() || error.is_cancelled() => return Err(error),
                Err(error) => {
                    notes.add(Note::SearchStopped { reason: error.to_string() });
                    break;
                }
            }
        }
        let (base, fit, options) = best.expect("the first attempt is the best of one");
        notes.add_all(&base.notes);
        if fit.mean > wanted {
            notes.add(Note::ErrorMissed { wanted, reached: fit.mean });
        }
        Ok(self.finish(&base, fit, notes, &options))
    }

    /// Makes a base mesh, where none was brought, and caches the field where that is costly.
    fn level_base(&self, options: &LevelOptions) -> Result<LevelBase<'_>, FitError> {
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
                let (made, notes) = self.opened.base_mesh(&options, self.progress)?;
                (stored(&made.mesh)?, Some(made.report), notes)
            }
            (None, Base::Brought(mesh)) => (stored(mesh)?, None, Vec::new()),
            (None, _) => return Err(FitError::NotOfLevels("checkpoint")),
        };
        let mesh = to_world(&stored.mesh, &stored.similarity);
        let band = self.opened.band(&mesh, self.progress)?;
        Ok(LevelBase { mesh, stored, report, notes, band })
    }

    /// Refuses what has no meaning for levels, and distances that are no shares.
    fn refuse_what_is_of_networks(&self) -> Result<(), FitError> {
        let preset = Settings { seed: self.settings.seed, ..Preset::Default.settings(self.opened.kind) };
        if self.error.is_some_and(|share| !(share > 0.0 && share < 1.0)) {
            return Err(FitError::Levels(LevelFitError::Option(
                "the mean distance must be a share of the diagonal",
            )));
        }
        let of_networks = [
            ("anchors", !self.anchors.is_empty()),
            ("terms", !self.terms.is_empty()),
            ("log", self.log.is_some()),
            ("checkpoint", matches!(self.base, Base::Resumed(_))),
            ("time limit", self.settings.time_limit.is_some()),
            ("settings of a network and its training", self.settings != preset),
        ];
        match of_networks.into_iter().find(|(_, given)| *given) {
            Some((what, _)) => Err(FitError::NotOfLevels(what)),
            None => Ok(()),
        }
    }

    fn levels_on(&self, base: &LevelBase<'_>, options: &LevelOptions) -> Result<LevelFit, FitError> {
        let truth = &*self.opened.surface;
        let surface: &dyn Surface = base.band.as_ref().map_or(truth, |band| &band.surface);
        let StoredBase { mesh, similarity, .. } = &base.stored;
        Ok(fit_levels(surface, truth, *similarity, mesh, options, self.progress)?)
    }

    fn finish(
        &self,
        base: &LevelBase<'_>,
        fit: LevelFit,
        mut notes: Notes<'_>,
        options: &LevelOptions,
    ) -> Fitted {
        let LevelFit { field, report, .. } = fit;
        notes.add_result(&report);
        let provenance = level_provenance(PROGRAM, file_name(self.opened).as_deref(), options, &report);
        let similarity = base.stored.similarity;
        let measured = field.level_surface().and_then(|finest| {
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
            checkpoint: None,
            notes: notes.all,
        }
    }
}
