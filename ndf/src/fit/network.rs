//! Learning a network.

use ndf_core::Surface;
use ndf_mesh::ManifoldMesh;
use ndf_meshing::BaseMeshOptions;
use ndf_model::Model;
use ndf_model::file::StoredBase;
use ndf_train::{
    Checkpoint, Learning, Likeness, LogRecord, NetworkCheckpoint, Trainer, provenance, stored_base, train,
};

use super::notes::Notes;
use super::{Base, Fit, FitError, Fitted, PROGRAM, Record, faces, file_name};
use crate::Note;
use crate::model::{ModelExt, to_world};
use crate::presets::{BASE_FACES, TRUE_EPOCHS};

impl Fit<'_> {
    pub(super) fn run_network(self, surface: &Likeness, chosen: Option<Note>) -> Result<Fitted, FitError> {
        let Self { opened, settings, base, anchors, terms, progress, mut log, keep, noted, .. } = self;
        let mut notes = Notes { all: Vec::new(), noted };
        notes.add_all(chosen.as_slice());
        let ready = |base: &ManifoldMesh| stored_base(&*opened.surface, base, &settings);
        let mut base_report = None;
        let mut made = |options: &BaseMeshOptions| {
            let (made, told) = opened.base_mesh(options, progress)?;
            told.into_iter().for_each(|note| notes.add(note));
            base_report = Some(made.report);
            Ok::<_, FitError>(Start::Fresh(Box::new(ready(&made.mesh)?)))
        };
        let start = match base {
            Base::Resumed(Checkpoint { learning: Learning::Network(checkpoint), .. }) => {
                Start::Resumed(checkpoint)
            }
            Base::Brought(mesh) => Start::Fresh(Box::new(ready(mesh)?)),
            Base::Made(options) => made(&options)?,
            Base::Suited | Base::Resumed(_) => made(&faces(BASE_FACES))?,
        };
        let base = start.base();
        let band = opened.band(&base, progress)?;
        let projected: &dyn Surface = band.as_ref().map_or(&*opened.surface, |band| &band.surface);
        let mut trainer = match start {
            Start::Resumed(checkpoint) => Trainer::resumed(projected, *checkpoint)?,
            Start::Fresh(base) => Trainer::with_stored_base(projected, *base, &settings)?,
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
        if let Some((every, mut keep)) = keep {
            trainer =
                trainer.keeping(every, move |checkpoint| keep(&Checkpoint::from(checkpoint).of(surface)));
        }
        let mut log = log.as_mut().map(|log| |record: &LogRecord<'_>| log(&Record::Network(record)));
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
            checkpoint: Checkpoint::from(checkpoint).of(surface),
            notes: notes.all,
        })
    }
}

/// What training starts from, ready.
enum Start {
    Fresh(Box<StoredBase>),
    Resumed(Box<NetworkCheckpoint>),
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
