//! Epoch after epoch.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ndf_core::{DVec3, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_model::file::StoredBase;
use ndf_model::{DisplacementField, Model, NetworkError};
use ndf_network::Packed;
use serde::Serialize;

use crate::base::stored_base;
use crate::batch::Batch;
use crate::checkpoint::Keeper;
use crate::clock::Clock;
use crate::engine::optimiser::AdamStep;
use crate::engine::{CHUNKS, Engine, Learned};
use crate::error::TrainError;
use crate::objective::{Anchors, Cycle, Epoch, Images, Projecting, Term};
use crate::plan::{Plan, TermRecord, compare};
use crate::settings::Settings;
use crate::state::{Companion, NetworkCheckpoint, State};
use crate::step::{Active, Chunk, Shared, Step};

/// Stream of random numbers of a stage that has one batch; the batches of others count up from 0.
const STAYING_STREAM: u64 = u64::MAX - 1;

/// Mean squared distance, normalised, beyond which training has diverged: images are farther from the surface
/// than the box is wide.
const ASTRAY: f64 = 9.0;

/// Mean losses of an epoch, unweighted, in units of the normalised box squared where they are distances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct EpochLosses {
    /// Epoch, counted from 0, those of the identity stage first.
    pub epoch: usize,
    /// Learning rate of the networks.
    pub rate: f64,
    /// Mean squared distance to the (tangent plane of the) surface.
    pub projection: f64,
    /// Mean squared distance between g_φ(g_θ(x)) and x; `None` without cycle loss.
    pub cycle: Option<f64>,
}

/// A training run.
pub struct Trainer<'a> {
    pub(crate) plan: Plan<'a>,
    pub(crate) state: State,
    pub(crate) clock: Clock,
    engine: Engine,
    batch: Batch,
    stage: ActiveStage,
    /// The terms of the checkpoint from which the run is resumed, until they are compared.
    resumed: Option<Vec<TermRecord>>,
    pub(crate) keeper: Option<Keeper<'a, NetworkCheckpoint>>,
}

/// The terms of a stage at work, and the memory for them.
#[derive(Default)]
struct ActiveStage {
    number: Option<usize>,
    /// Means over the samples of a batch.
    terms: Vec<Active>,
    chunks: Vec<Chunk>,
    /// Means over points of their own.
    fixed: Vec<(Active, Chunk)>,
    means: Vec<(String, f64)>,
}

impl<'a> Trainer<'a> {
    /// Everything ready for the first epoch on a base mesh in the surface's coordinates.
    ///
    /// # Errors
    /// If the settings or the base mesh are not usable.
    pub fn new(
        surface: &'a dyn Surface,
        base: &ManifoldMesh,
        settings: &Settings,
    ) -> Result<Self, TrainError> {
        Self::with_stored_base(surface, stored_base(surface, base, settings)?, settings)
    }

    /// Everything ready for the first epoch on a base mesh that [was made ready](stored_base) before.
    ///
    /// # Errors
    /// If the settings or the base mesh are not usable.
    pub fn with_stored_base(
        surface: &'a dyn Surface,
        base: StoredBase,
        settings: &Settings,
    ) -> Result<Self, TrainError> {
        settings.validate()?;
        let StoredBase { mesh, similarity, order } = base;
        let start = DisplacementField::untrained(mesh, settings.field.clone(), settings.seed)?;
        let network = start.network().ok_or(NetworkError::NoNetwork)?;
        let learned = Learned::new(network.features().to_vec(), network.mlp().clone());
        let state = State { learned, companions: Vec::new(), epoch: 0, rate_factor: 1.0 };
        let plan = Plan::new(surface, start, similarity, order, settings)?;
        Ok(Self::with_state(plan, state, Duration::ZERO))
    }

    /// The run of a checkpoint, to go on where it ended. Terms of one's own and anchors are to be added again: the
    /// first epoch compares them with those of the checkpoint.
    ///
    /// # Errors
    /// If the base mesh has no area.
    pub fn resumed(surface: &'a dyn Surface, checkpoint: NetworkCheckpoint) -> Result<Self, TrainError> {
        let NetworkCheckpoint { settings, state, hints, model, order, terms, time } = checkpoint;
        let plan = Plan::new(surface, model.field, model.similarity, order, &settings)?;
        let mut trainer = Self::with_state(plan, state, time);
        trainer.batch.hints = hints;
        trainer.resumed = Some(terms);
        Ok(trainer)
    }

    fn with_state(plan: Plan<'a>, state: State, before: Duration) -> Self {
        let engine = Engine::new(plan.start.base(), &plan.settings.field.network, &state.learned.mlp);
        let batch = Batch::new(plan.settings.samples);
        let (clock, stage) = (Clock::resumed_after(before), ActiveStage::default());
        Self { plan, state, clock, engine, batch, stage, resumed: None, keeper: None }
    }

    /// Adds a term of one's own to the objective. The identity stage, where there is one, goes without it.
    #[must_use]
    pub fn with_term(mut self, weight: f32, term: Arc<dyn Term>) -> Self {
        let main = self.plan.stages.last_mut().expect("a run has a stage");
        main.terms.push((weight, term));
        self.stage = ActiveStage::default();
        self
    }

    /// Adds [anchors](Anchors): pairs of a point near the base mesh, which is taken to the closest point of
    /// it, and the point where its image should be, both in the surface's coordinates. The weight is 0.1 λ_P each.
    #[must_use]
    pub fn with_anchors(self, pairs: &[(DVec3, DVec3)]) -> Self {
        let anchors = Anchors::new(&self.plan.stored_base(), pairs);
        let weight = 0.1 * self.plan.settings.lambda_p;
        self.with_term(weight, Arc::new(anchors))
    }

    /// Takes the surface of the trainer for an approximation of `truth` that is cheaper to project onto: the last
    /// `epochs` and the measurement at the end project onto the truth itself.
    #[must_use]
    pub fn finished_on(mut self, truth: &'a dyn Surface, epochs: usize) -> Self {
        self.plan.finish_on(truth, epochs);
        self
    }

    /// Passes a checkpoint to `keep` at the first batch that starts so long after the last one.
    #[must_use]
    pub fn keeping(self, every: Duration, keep: impl FnMut(NetworkCheckpoint) + 'a) -> Self {
        Self { keeper: Some(Keeper::new(every, Instant::now(), keep)), ..self }
    }

    /// Epochs made, those of the identity stage included.
    pub fn epoch(&self) -> usize {
        self.state.epoch
    }

    /// Epochs to be made, those of the identity stage included.
    pub fn epochs(&self) -> usize {
        self.plan.epochs()
    }

    /// Name and unweighted mean of every term in the last epoch.
    pub fn term_means(&self) -> &[(String, f64)] {
        &self.stage.means
    }

    /// Whether the next epoch draws a new batch: the moment for a [`checkpoint`](Self::checkpoint).
    pub fn at_batch_start(&self) -> bool {
        let (stage, epoch) = self.plan.stage_of(self.state.epoch);
        match self.plan.stages[stage].images {
            Images::Stay => true,
            Images::Project => epoch.is_multiple_of(self.plan.settings.resample_every),
        }
    }

    /// Whether the next epoch is the first of its stage.
    pub(crate) fn at_stage_start(&self) -> bool {
        self.plan.stage_of(self.state.epoch).1 == 0
    }

    /// Makes one epoch: samples and feet if they are due, one step of the optimiser.
    ///
    /// # Errors
    /// If a loss is not finite or absurd, hardly a sample finds the surface, or the run is resumed with other terms.
    pub fn run_epoch(&mut self) -> Result<EpochLosses, TrainError> {
        if let Some(expected) = self.resumed.take() {
            compare(&expected, &self.plan.terms())?;
        }
        let (number, within) = self.plan.stage_of(self.state.epoch);
        if self.stage.number != Some(number) {
            self.enter(number, within)?;
        }
        match self.plan.stages[number].images {
            Images::Stay => self.stay(),
            Images::Project => self.draw_and_project(within)?,
        }
        let stage = &self.plan.stages[number];
        let rate = stage.rate.at(within as f32 / stage.epochs.max(1) as f32) * self.state.rate_factor;
        self.accumulate(Epoch { number: within, of: stage.epochs });
        let epoch = self.state.epoch;
        let means = &self.stage.means;
        let projection = means.first().map_or(0.0, |(_, mean)| *mean);
        let cycle = means.iter().find(|(name, _)| name == Cycle::NAME).map(|(_, mean)| *mean);
        let losses = EpochLosses { epoch, rate: f64::from(rate), projection, cycle };
        let finite = means.iter().all(|(_, mean)| mean.is_finite());
        if !finite || projection > ASTRAY || cycle.is_some_and(|cycle| cycle > ASTRAY) {
            return Err(TrainError::Diverged { epoch });
        }
        self.update(AdamStep::new(within + 1, rate));
        self.state.epoch += 1;
        Ok(losses)
    }

    /// Begins a stage, or goes on within it.
    fn enter(&mut self, number: usize, within: usize) -> Result<(), TrainError> {
        if within == 0 && number > 0 {
            self.state.forget_moments();
        }
        let mut stage = ActiveStage { number: Some(number), ..ActiveStage::default() };
        for (weight, term) in &self.plan.stages[number].terms {
            let mut active = Active::new(*weight, term.clone());
            if let Some(mlp) = term.network(self.plan.settings.seed) {
                self.state.join(term.name(), &mlp)?;
                active.network = Some(Packed::new(&mlp));
                active.by_network = vec![0.0; mlp.parameters().len()];
            }
            if term.points().is_some() {
                let chunk = self.chunk(std::slice::from_ref(&active));
                stage.fixed.push((active, chunk));
            } else {
                stage.terms.push(active);
            }
        }
        stage.chunks = (0..CHUNKS).map(|_| self.chunk(&stage.terms)).collect();
        let terms = stage.terms.iter().chain(stage.fixed.iter().map(|(active, _)| active));
        stage.means = terms.map(|active| (active.term.name().to_owned(), 0.0)).collect();
        self.stage = stage;
        Ok(())
    }

    fn chunk(&self, terms: &[Active]) -> Chunk {
        Chunk::new(&self.engine.packed, terms, self.plan.settings.field.network.features)
    }

    /// One batch throughout, whose points are their own targets.
    fn stay(&mut self) {
        if !self.batch.is_drawn() {
            self.resample(STAYING_STREAM);
            let base = self.plan.start.base();
            let places: Vec<DVec3> = self.batch.on_faces().iter().map(|s| s.position(base)).collect();
            self.batch.stay(places.into_iter());
        }
    }

    fn resample(&mut self, stream: u64) {
        let faces = self.plan.start.base().face_count();
        self.batch.resample(&self.plan.sampler, faces, self.plan.settings.seed, stream);
    }

    fn draw_and_project(&mut self, epoch: usize) -> Result<(), TrainError> {
        let (resample_every, project_every) =
            (self.plan.settings.resample_every, self.plan.settings.project_every);
        let is_due = !self.batch.is_drawn() || epoch.is_multiple_of(resample_every);
        if is_due {
            self.resample((epoch / resample_every) as u64);
        }
        if is_due || epoch.is_multiple_of(project_every) { self.project() } else { Ok(()) }
    }

    fn project(&mut self) -> Result<(), TrainError> {
        let before = Instant::now();
        let field = self.field().map_err(|_| TrainError::Diverged { epoch: self.state.epoch })?;
        let samples = self.batch.on_faces();
        // The guide is the normal of the base face, not that of g: where g has folded over, its own normal would
        // send it to the far side of the surface and keep it folded.
        let base = self.plan.start.base();
        let guides = samples.iter().map(|s| base.face_normal(s.face));
        let images = field.map(&samples);
        let projecting = Projecting { field: &field, samples: &samples, images: &images };
        for active in &mut self.stage.terms {
            active.prepared = active.term.prepare(&projecting);
        }
        let surface = self.plan.surface_in(self.state.epoch);
        self.batch.project(surface, &self.plan.similarity, images.into_iter().zip(guides));
        self.clock.projecting += before.elapsed();
        let share = 100.0 * self.batch.hit_share();
        if share < 1.0 { Err(TrainError::OutOfReach { share }) } else { Ok(()) }
    }

    /// Means and gradients of the objective at the current parameters.
    fn accumulate(&mut self, epoch: Epoch) {
        let Self { plan, state, engine, batch, stage, .. } = self;
        let settings = &plan.settings;
        if let Some(precision) = settings.precision
            && state.epoch + settings.rounded_epochs() >= plan.epochs()
        {
            // The first of these epochs decides where numbers are rounded to.
            state.learned.choose_grids(settings.field.network.features, precision);
        }
        engine.load(&state.learned);
        let ActiveStage { terms, chunks, fixed, means, .. } = stage;
        for active in terms.iter_mut().chain(fixed.iter_mut().map(|(active, _)| active)) {
            if let (Some(packed), Some(companion)) =
                (&mut active.network, state.companion(active.term.name()))
            {
                packed.pack(&companion.parameters);
            }
        }
        let (base, residual) = (&plan.base, settings.field.residual);
        let of_batch = Shared { base, residual, epoch, terms, share: 1.0 / settings.samples as f32 };
        let arch = pulp::Arch::new();
        let sum = engine.run(&state.learned, &batch.chunks, chunks, |network, chunk, samples, corners| {
            let (places, targets) = (&batch.places[samples.clone()], &batch.targets[samples.clone()]);
            let first = samples.start;
            arch.dispatch(Step { shared: of_batch, network, chunk, places, targets, first, corners });
        });
        let (of_batch, of_fixed) = means.split_at_mut(terms.len());
        for ((_, mean), sum) in of_batch.iter_mut().zip(&sum.sums) {
            *mean = sum / settings.samples as f64;
        }
        terms.iter_mut().zip(&sum.networks).for_each(|(active, own)| active.collect(own.as_ref()));
        for ((active, chunk), (_, mean)) in fixed.iter_mut().zip(of_fixed) {
            let Some(points) = active.term.points() else { continue };
            let terms = std::slice::from_ref(&*active);
            engine.add(&state.learned, chunk, |network, chunk, corners| {
                let (places, targets) = (&points.places, &points.targets);
                let shared = Shared { base, residual, epoch, terms, share: 1.0 };
                arch.dispatch(Step { shared, network, chunk, places, targets, first: 0, corners });
            });
            *mean = chunk.sums[0] / points.places.len().max(1) as f64;
            active.collect(chunk.networks[0].as_ref());
        }
    }

    /// One step of Adam for all parameters.
    fn update(&mut self, step: AdamStep) {
        self.engine.update(&mut self.state.learned, step, self.plan.settings.feature_rate);
        let fixed = self.stage.fixed.iter().map(|(active, _)| active);
        for active in self.stage.terms.iter().chain(fixed) {
            if let Some(Companion { parameters, moments, .. }) = self.state.companion(active.term.name()) {
                moments.apply(step, parameters, &active.by_network);
            }
        }
    }

    /// The field as learned so far, its numbers rounded where the losses see them so.
    ///
    /// # Errors
    /// If a parameter is not finite.
    pub fn field(&self) -> Result<DisplacementField, NetworkError> {
        let (features, parameters) = self.state.learned.numbers();
        self.plan.start.with_parameters(features, parameters)
    }

    /// The field as it will be stored: as learned so far, and rounded.
    ///
    /// # Errors
    /// If a parameter is not finite.
    pub(crate) fn stored_field(&self) -> Result<DisplacementField, NetworkError> {
        let field = self.field()?;
        Ok(match self.state.learned.to_be_rounded(self.plan.settings.precision) {
            Some(precision) => field.rounded(precision),
            None => field,
        })
    }

    /// Everything needed to go on from here. Exact [at the start of a batch](Self::at_batch_start); elsewhere, the
    /// resumed run draws its batch anew.
    ///
    /// # Errors
    /// If a parameter is not finite.
    pub fn checkpoint(&self) -> Result<NetworkCheckpoint, NetworkError> {
        let (field, similarity) = (self.field()?, self.plan.similarity);
        Ok(NetworkCheckpoint {
            settings: self.plan.settings.clone(),
            state: self.state.clone(),
            hints: self.batch.hints.clone(),
            model: Model { field, similarity, metric: None, scalars: Vec::new(), provenance: String::new() },
            order: self.plan.base.order.clone(),
            terms: self.plan.terms(),
            time: self.clock.elapsed(),
        })
    }

    /// Goes back to an earlier state with half the learning rate.
    pub(crate) fn retreat(&mut self, to: &State) {
        let rate_factor = 0.5 * self.state.rate_factor;
        self.state = State { rate_factor, ..to.clone() };
    }

    /// Share of the batch with a foot whose mapped normal opposes the surface's there.
    pub(crate) fn flipped_fraction(&self) -> Result<f64, NetworkError> {
        let mapped = self.field()?.map_with_tangents(&self.batch.on_faces());
        let (mut hits, mut flipped) = (0_usize, 0_usize);
        for (mapped, target) in mapped.iter().zip(&self.batch.targets) {
            let normal = target.surface_normal.as_dvec3();
            hits += usize::from(normal != DVec3::ZERO);
            flipped += usize::from(mapped.normal().dot(normal) < 0.0);
        }
        Ok(flipped as f64 / hits.max(1) as f64)
    }
}
