//! What is to be said of a run.

use ndf_train::{FitReport, Settings};

use super::OnNote;
use crate::Note;
use crate::presets::NOTABLY_FLIPPED;

/// Notes so far, and who is told of each.
pub(super) struct Notes<'a> {
    pub(super) all: Vec<Note>,
    pub(super) noted: Option<OnNote<'a>>,
}

impl Notes<'_> {
    pub(super) fn add_all(&mut self, notes: &[Note]) {
        notes.iter().for_each(|note| self.add(note.clone()));
    }

    pub(super) fn add(&mut self, note: Note) {
        if let Some(noted) = &mut self.noted {
            noted(&note);
        }
        self.all.push(note);
    }

    pub(super) fn add_training(&mut self, report: &FitReport, settings: &Settings, cancelled: bool) {
        if report.interrupted && !cancelled {
            let of = settings.epochs + settings.identity_epochs;
            self.add(Note::TimeUp { rounds: report.epochs, of });
        }
        if report.retreats > 0 {
            self.add(Note::Diverged { times: report.retreats });
        }
        self.add_result(report);
    }

    pub(super) fn add_result(&mut self, report: &FitReport) {
        if report.flipped_fraction > NOTABLY_FLIPPED {
            self.add(Note::Flipped { share: report.flipped_fraction });
        }
        if report.missed_fraction > 0.0 {
            self.add(Note::Missed { share: report.missed_fraction });
        }
    }
}
