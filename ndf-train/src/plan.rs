//! What a run is to do: all that does not change from epoch to epoch.

use std::sync::Arc;

use ndf_core::Surface;
use ndf_mesh::sampling::AreaSampler;
use ndf_model::file::{BaseOrder, StoredBase};
use ndf_model::{DisplacementField, Similarity};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::base::Base;
use crate::error::TrainError;
use crate::objective::{Stage, Term, stages};
use crate::settings::Settings;

/// Settings, surface, base mesh and objective.
pub(crate) struct Plan<'a> {
    pub(crate) settings: Settings,
    surface: &'a dyn Surface,
    /// What `surface` approximates, and for how many epochs at the end it takes its place.
    finish: Option<(&'a dyn Surface, usize)>,
    pub(crate) similarity: Similarity,
    /// The field training started from: base mesh and shapes.
    pub(crate) start: DisplacementField,
    pub(crate) base: Base,
    pub(crate) sampler: AreaSampler,
    /// One after the other. There is one at least.
    pub(crate) stages: Vec<Stage>,
}

impl<'a> Plan<'a> {
    pub(crate) fn new(
        surface: &'a dyn Surface,
        start: DisplacementField,
        similarity: Similarity,
        order: BaseOrder,
        settings: &Settings,
    ) -> Result<Self, TrainError> {
        Ok(Self {
            settings: settings.clone(),
            surface,
            finish: None,
            similarity,
            base: Base::new(start.base(), order),
            sampler: AreaSampler::new(start.base()).ok_or(TrainError::NoArea)?,
            stages: stages(settings),
            start,
        })
    }

    pub(crate) fn finish_on(&mut self, truth: &'a dyn Surface, epochs: usize) {
        self.finish = Some((truth, epochs));
    }

    /// The base mesh.
    pub(crate) fn stored_base(&self) -> StoredBase {
        let (mesh, order) = (self.start.base().clone(), self.base.order.clone());
        StoredBase { mesh, similarity: self.similarity, order }
    }

    /// The surface itself, where training was begun on an approximation.
    pub(crate) fn truth(&self) -> &'a dyn Surface {
        self.finish.map_or(self.surface, |(truth, _)| truth)
    }

    /// The surface of an epoch.
    pub(crate) fn surface_in(&self, epoch: usize) -> &'a dyn Surface {
        match self.finish {
            Some((truth, epochs)) if epoch + epochs >= self.epochs() => truth,
            _ => self.surface,
        }
    }

    /// Epochs of all stages.
    pub(crate) fn epochs(&self) -> usize {
        self.stages.iter().map(|stage| stage.epochs).sum()
    }

    /// The stage of an epoch, and the number of the epoch in it.
    pub(crate) fn stage_of(&self, epoch: usize) -> (usize, usize) {
        let mut within = epoch;
        for (k, stage) in self.stages.iter().enumerate() {
            if within < stage.epochs {
                return (k, within);
            }
            within -= stage.epochs;
        }
        let last = self.stages.len() - 1;
        (last, within + self.stages[last].epochs)
    }

    /// What tells this run's objective from others.
    pub(crate) fn terms(&self) -> Vec<TermRecord> {
        let of_stage = |stage: &Stage| -> Vec<TermRecord> {
            let record = |(weight, term): &(f32, Arc<dyn Term>)| TermRecord {
                stage: stage.name.to_owned(),
                name: term.name().to_owned(),
                weight: *weight,
                state: term.state(),
            };
            stage.terms.iter().map(record).collect()
        };
        self.stages.iter().flat_map(of_stage).collect()
    }
}

/// A term as a checkpoint remembers it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct TermRecord {
    stage: String,
    name: String,
    weight: f32,
    state: Value,
}

/// Whether a run has the terms of the checkpoint from which it is resumed.
///
/// # Errors
/// If it has others.
pub(crate) fn compare(expected: &[TermRecord], found: &[TermRecord]) -> Result<(), TrainError> {
    let names = |terms: &[TermRecord]| -> Vec<String> { terms.iter().map(|t| t.name.clone()).collect() };
    let (had, has) = (names(expected), names(found));
    if had != has {
        return Err(TrainError::OtherTerms { expected: had.join(", "), found: has.join(", ") });
    }
    match expected.iter().zip(found).find(|(expected, found)| expected != found) {
        Some((term, _)) => Err(TrainError::OtherTerm(term.name.clone())),
        None => Ok(()),
    }
}
