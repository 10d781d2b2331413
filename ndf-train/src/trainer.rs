//! Epoch after epoch.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ndf_core::{DVec3, Surface};
use ndf_mesh::FacePoint;
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::{ManifoldMesh, TriangleTree};
use ndf_model::file::{Grids, Precision, StoredBase};
use ndf_model::intrinsic_network::{IntrinsicEncoding, NetworkError, single};
use ndf_model::{DisplacementField, Model as ModelFile, Similarity};
use ndf_network::{Mlp, Packed};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::anchors::Anchors;
use crate::base::{frame, stored_base};
use crate::batch::{Batch, CHUNKS, Sample};
use crate::epoch::Epoch;
use crate::error::TrainError;
use crate::objective::Objective;
use crate::optimiser::{AdamStep, FeatureUpdate, Moments};
use crate::origin::{closest_origins, inverse_origins};
use crate::rounding::Rounded;
use crate::settings::{ReverseMap, Settings};
use crate::state::{Checkpoint, State};
use crate::step::{Chunk, Model};
use crate::terms::LossTerm;

/// Stream of random numbers of the identity stage; batches count up from 0.
const IDENTITY_STREAM: u64 = u64::MAX - 1;

/// Mean squared distance, normalised, beyond which training has gone astray: images are farther from the surface
/// than the box is wide.
const ASTRAY: f64 = 9.0;

/// Mean losses of an epoch, unweighted, in units of the normalised box squared where they are distances.
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// The state of a training run.
pub struct Trainer<'a> {
    pub(crate) surface: &'a dyn Surface,
    /// What `surface` approximates, and for how many epochs at the end it takes its place.
    finish: Option<(&'a dyn Surface, usize)>,
    pub(crate) settings: Settings,
    pub(crate) similarity: Similarity,
    pub(crate) sampler: AreaSampler,
    pub(crate) state: State,
    /// The field training started from: base mesh and shapes.
    start: DisplacementField,
    positions: Vec<[f32; 3]>,
    frames: Vec<[[f32; 3]; 2]>,
    /// Half-edges out of every vertex: `3 f + c` for its corner c of face f.
    incident: Vec<Vec<u32>>,
    objective: Objective,
    /// The objective after the identity stage, while that lasts.
    waiting: Option<Objective>,
    anchors: Option<Anchors>,
    /// Features and parameters of θ as the losses see them, where they are rounded.
    rounded: Rounded,
    packed: (Packed, Option<Packed>),
    gradients: (Vec<f32>, Vec<f32>),
    batch: Batch,
    /// Derivatives by the features, 3 d floats a base face: d for each of its corners.
    corner_gradients: Vec<f32>,
    chunks: Vec<Chunk>,
    /// Of the base mesh, where the reverse map asks for its closest points.
    base_tree: Option<TriangleTree>,
    term_means: Vec<(&'static str, f64)>,
    started: Instant,
    /// What the run had taken before it was resumed.
    before: Duration,
    pub(crate) projecting: Duration,
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
        Self::on(surface, stored_base(surface, base, settings)?, settings)
    }

    /// Everything ready for the first epoch on a base mesh that [was made ready](stored_base) before.
    ///
    /// # Errors
    /// If the settings or the base mesh are not usable.
    pub fn on(surface: &'a dyn Surface, base: StoredBase, settings: &Settings) -> Result<Self, TrainError> {
        settings.validate()?;
        let StoredBase { mesh: base, similarity } = base;
        let start = DisplacementField::untrained(base, settings.field.clone(), settings.seed)?;
        let mut rng = ChaCha8Rng::seed_from_u64(settings.seed ^ 0x9e37_79b9_7f4a_7c15);
        let phi = settings.reverse_network().map(|shape| match settings.reverse_map {
            ReverseMap::Plain => Mlp::kaiming(shape, &mut rng),
            _ => Mlp::zero_at_birth(shape, &mut rng),
        });
        let (features, theta) = (start.network().features().to_vec(), start.network().mlp().clone());
        let groups = [features.len(), theta.parameters().len(), parameters(&phi).len()];
        let moments = groups.map(Moments::new);
        let state = State { features, theta, phi, moments, epoch: 0, rate_factor: 1.0, grids: None };
        Self::with_state(surface, start, similarity, settings, state)
    }

    /// The run of a checkpoint, to go on where it ended. Terms of one's own and anchors are to be added again.
    ///
    /// # Errors
    /// If the base mesh has no area.
    pub fn resumed(surface: &'a dyn Surface, checkpoint: Checkpoint) -> Result<Self, TrainError> {
        let Checkpoint { settings, state, hints, model, time } = checkpoint;
        let mut trainer = Self::with_state(surface, model.field, model.similarity, &settings, state)?;
        trainer.batch.hints = hints;
        trainer.before = time;
        Ok(trainer)
    }

    fn with_state(
        surface: &'a dyn Surface,
        start: DisplacementField,
        similarity: Similarity,
        settings: &Settings,
        state: State,
    ) -> Result<Self, TrainError> {
        let base = start.base();
        let sampler = AreaSampler::new(base).ok_or(TrainError::NoArea)?;
        let packed = (Packed::new(&state.theta), state.phi.as_ref().map(Packed::new));
        let gradients = (vec![0.0; state.theta.parameters().len()], vec![0.0; parameters(&state.phi).len()]);
        let (objective, waiting) = if state.epoch < settings.identity_epochs {
            (Objective::identity(settings), Some(Objective::of(settings)))
        } else {
            (Objective::of(settings), None)
        };
        let mut trainer = Self {
            surface,
            finish: None,
            similarity,
            positions: single(base.positions()),
            frames: (0..base.face_count() as u32).map(|f| frame(base.corner_positions(f))).collect(),
            incident: (0..base.vertex_count() as u32).map(|v| base.outgoing(v).collect()).collect(),
            sampler,
            objective,
            waiting,
            anchors: None,
            rounded: Rounded::default(),
            packed,
            gradients,
            batch: Batch::new(settings.samples, base.face_count()),
            corner_gradients: vec![0.0; base.face_count() * 3 * settings.field.network.features],
            chunks: Vec::new(),
            base_tree: (settings.lambda_c > 0.0 && settings.reverse_map.needs_origins())
                .then(|| TriangleTree::new(base)),
            term_means: Vec::new(),
            start,
            settings: settings.clone(),
            state,
            started: Instant::now(),
            before: Duration::ZERO,
            projecting: Duration::ZERO,
        };
        trainer.make_room();
        Ok(trainer)
    }

    /// Adds a term of one's own to the objective.
    #[must_use]
    pub fn with_term(mut self, weight: f32, term: Arc<dyn LossTerm>) -> Self {
        self.waiting.as_mut().unwrap_or(&mut self.objective).terms.push((weight, term));
        self.make_room();
        self
    }

    /// Adds anchors (supplement, Eq. 3): pairs of a point near the base mesh, which is taken to the closest point of
    /// it, and the point where its image should be, both in the surface's coordinates. The weight is 0.1 λ_P each.
    #[must_use]
    pub fn with_anchors(mut self, pairs: &[(DVec3, DVec3)]) -> Self {
        let normalised: Vec<_> = pairs
            .iter()
            .map(|&(p, q)| (self.similarity.to_normalised(p), self.similarity.to_normalised(q)))
            .collect();
        let weight = 0.1 * self.settings.lambda_p;
        self.anchors = Some(Anchors::new(&self.start, &normalised, weight, &self.packed.0));
        self
    }

    /// Takes the surface of the trainer for an approximation of `truth` that is cheaper to project onto: the last
    /// `epochs` and the measurement at the end project onto the truth itself.
    #[must_use]
    pub fn finished_on(self, truth: &'a dyn Surface, epochs: usize) -> Self {
        Self { finish: Some((truth, epochs)), ..self }
    }

    /// The surface itself, where training was begun on an approximation.
    pub(crate) fn truth(&self) -> &'a dyn Surface {
        self.finish.map_or(self.surface, |(truth, _)| truth)
    }

    /// The surface of this epoch.
    fn surface_now(&self) -> &'a dyn Surface {
        match self.finish {
            Some((truth, epochs)) if self.state.epoch + epochs >= self.epochs() => truth,
            _ => self.surface,
        }
    }

    /// Room for gradients, as the objective asks for it.
    fn make_room(&mut self) {
        let (theta, phi) = &self.packed;
        self.chunks = (0..CHUNKS).map(|_| Chunk::new(theta, phi.as_ref(), &self.objective)).collect();
        self.term_means = self.objective.terms.iter().map(|(_, term)| (term.name(), 0.0)).collect();
    }

    /// Epochs made, those of the identity stage included.
    pub fn epoch(&self) -> usize {
        self.state.epoch
    }

    /// Epochs to be made, those of the identity stage included.
    pub fn epochs(&self) -> usize {
        self.settings.identity_epochs + self.settings.epochs
    }

    /// Wall time of training, that before a resumed checkpoint included.
    pub(crate) fn elapsed(&self) -> Duration {
        self.before.saturating_add(self.started.elapsed())
    }

    /// Name and unweighted mean of every term in the last epoch; the cycle loss is not among them.
    pub fn term_means(&self) -> &[(&'static str, f64)] {
        &self.term_means
    }

    /// Whether the next epoch draws a new batch: the moment for a [`checkpoint`](Self::checkpoint).
    pub fn at_batch_start(&self) -> bool {
        let after_identity = self.state.epoch.checked_sub(self.settings.identity_epochs);
        after_identity.is_none_or(|epoch| epoch.is_multiple_of(self.settings.resample_every))
    }

    /// Makes one epoch: samples and feet if they are due, one step of the optimiser.
    ///
    /// # Errors
    /// If a loss is not finite or absurd, or hardly a sample finds the surface.
    pub fn run_epoch(&mut self) -> Result<EpochLosses, TrainError> {
        let epoch = self.state.epoch;
        let rate = match epoch.checked_sub(self.settings.identity_epochs) {
            None => {
                self.begin_identity();
                self.settings.rate.first
            }
            Some(after) => {
                self.begin_epoch(after)?;
                self.settings.rate.at(after as f32 / self.settings.epochs.max(1) as f32)
            }
        } * self.state.rate_factor;
        let cycle = self.accumulate();
        let projection = self.term_means.first().map_or(0.0, |(_, mean)| *mean);
        let has_cycle = self.objective.lambda_c > 0.0;
        let losses =
            EpochLosses { epoch, rate: f64::from(rate), projection, cycle: has_cycle.then_some(cycle) };
        let finite = cycle.is_finite() && self.term_means.iter().all(|(_, mean)| mean.is_finite());
        if !finite || projection > ASTRAY || cycle > ASTRAY {
            return Err(TrainError::Diverged { epoch });
        }
        self.update(rate);
        self.state.epoch += 1;
        Ok(losses)
    }

    /// An epoch of the identity stage: one batch throughout, whose points are their own targets.
    fn begin_identity(&mut self) {
        if !self.batch.is_drawn() {
            self.batch.resample(&self.sampler, self.settings.seed, IDENTITY_STREAM);
            let base = self.start.base();
            let places: Vec<DVec3> = self.batch.samples.iter().map(|s| s.on_face().position(base)).collect();
            self.batch.stay(places.into_iter());
        }
    }

    fn begin_epoch(&mut self, epoch: usize) -> Result<(), TrainError> {
        if let Some(objective) = self.waiting.take() {
            // A new stage begins with fresh moments.
            self.objective = objective;
            self.state.moments = self.state.moments.each_ref().map(|m| Moments::new(m.parts()[0].len()));
            self.make_room();
        }
        if epoch.is_multiple_of(self.settings.resample_every) {
            let stream = (epoch / self.settings.resample_every) as u64;
            self.batch.resample(&self.sampler, self.settings.seed, stream);
        }
        if epoch.is_multiple_of(self.settings.project_every) {
            self.project()?;
        }
        Ok(())
    }

    fn project(&mut self) -> Result<(), TrainError> {
        let before = Instant::now();
        let field = self.field().map_err(|_| TrainError::Diverged { epoch: self.state.epoch })?;
        let samples: Vec<FacePoint> = self.batch.samples.iter().map(Sample::on_face).collect();
        // The guide is the normal of the base face, not that of g: where g has folded over, its own normal would
        // send it to the far side of the surface and keep it folded.
        let base = self.start.base();
        let guides = samples.iter().map(|s| base.face_normal(s.face));
        let images = field.map(&samples);
        if let Some(tree) = &self.base_tree {
            self.batch.origins = match self.settings.reverse_map {
                ReverseMap::Inverse => inverse_origins(&field, tree, &images, &samples),
                _ => closest_origins(base, tree, &images, &samples),
            };
        }
        self.batch.project(self.surface_now(), &self.similarity, images.into_iter().zip(guides));
        self.projecting += before.elapsed();
        let share = 100.0 * self.batch.hit_share();
        if share < 1.0 { Err(TrainError::OutOfReach { share }) } else { Ok(()) }
    }

    /// Values and gradients of the objective at the current parameters; returns the mean of the cycle loss.
    fn accumulate(&mut self) -> f64 {
        self.round();
        let (features, theta) = self.rounded.seen(&self.state.features, &self.state.theta);
        self.packed.0.pack(theta.parameters());
        if let (Some(packed), Some(phi)) = (&mut self.packed.1, &self.state.phi) {
            packed.pack(phi.parameters());
        }
        let settings = &self.settings;
        let model = Model {
            encoding: IntrinsicEncoding::new(
                self.start.base().faces(),
                &self.positions,
                features,
                &settings.field.network,
            ),
            frames: &self.frames,
            theta: &self.packed.0,
            phi: self.packed.1.as_ref(),
            reverse_map: settings.reverse_map,
            reverse_octaves: settings.reverse_octaves,
            residual: settings.field.residual,
        };
        let epoch = Epoch {
            model,
            objective: &self.objective,
            share: 1.0 / settings.samples as f32,
            batch: &self.batch,
            arch: pulp::Arch::new(),
        };
        epoch.run(0, &mut self.chunks, &mut self.corner_gradients);
        let (sum, others) = self.chunks.split_first_mut().expect("there are chunks");
        for chunk in others {
            sum.add(chunk);
        }
        let (to_theta, to_phi) = (&mut self.gradients.0, &mut self.gradients.1);
        to_theta.fill(0.0);
        to_phi.fill(0.0);
        sum.theta_gradients.add_to(to_theta);
        if let Some(phi) = &sum.phi {
            phi.gradients.add_to(to_phi);
        }
        for ((_, mean), sum) in self.term_means.iter_mut().zip(&sum.terms) {
            *mean = sum / settings.samples as f64;
        }
        let cycle = sum.cycle / settings.samples as f64;
        if let (Some(anchors), None) = (&mut self.anchors, &self.waiting) {
            anchors.accumulate(model, to_theta, &mut self.corner_gradients);
        }
        cycle
    }

    /// Rounds what the losses see, in the last epochs; where to, the first of these decides.
    fn round(&mut self) {
        let (settings, state) = (&self.settings, &mut self.state);
        let State { features, theta, grids, epoch, .. } = state;
        if let Some(precision) = settings.precision
            && *epoch + settings.rounded_epochs() >= settings.identity_epochs + settings.epochs
        {
            grids.get_or_insert_with(|| {
                Grids::new(settings.field.network.features, features, theta, precision)
            });
        }
        self.rounded.update(grids.as_ref(), features, theta);
    }

    /// One step of Adam for all parameters.
    fn update(&mut self, rate: f32) {
        let settings = &self.settings;
        // Bias corrections count the steps since the moments were fresh.
        let steps = self.state.epoch.checked_sub(settings.identity_epochs).unwrap_or(self.state.epoch);
        let step = AdamStep::new(steps + 1, rate);
        let [of_features, of_theta, of_phi] = &mut self.state.moments;
        of_theta.apply(step, self.state.theta.parameters_mut(), &self.gradients.0);
        if let Some(phi) = &mut self.state.phi {
            of_phi.apply(step, phi.parameters_mut(), &self.gradients.1);
        }
        let d = settings.field.network.features;
        if d == 0 {
            return;
        }
        let (first, second) = of_features.parts_mut();
        FeatureUpdate {
            step: step.scaled(settings.feature_rate),
            dimension: d,
            incident: &self.incident,
            corner_gradients: &self.corner_gradients,
        }
        .apply(&mut self.state.features, first, second);
    }

    /// The field as learned so far, its numbers rounded where the losses see them so.
    ///
    /// # Errors
    /// If a parameter is not finite.
    pub fn field(&self) -> Result<DisplacementField, NetworkError> {
        let (mut features, mut theta) = (self.state.features.clone(), self.state.theta.clone());
        if let Some(grids) = &self.state.grids {
            grids.round(&mut features, &mut theta);
        }
        self.start.with_parameters(features, theta.parameters().to_vec())
    }

    /// The field as it will be stored: as learned so far, and rounded. Where nothing was yet learned of the rounding, it is
    /// finer than asked for, so that it costs next to no accuracy.
    ///
    /// # Errors
    /// If a parameter is not finite.
    pub(crate) fn stored_field(&self) -> Result<DisplacementField, NetworkError> {
        let field = self.field()?;
        let (Some(precision), None) = (self.settings.precision, &self.state.grids) else { return Ok(field) };
        let finer =
            Precision { features: precision.features + 3, weights: precision.weights + 3, ..precision };
        Ok(field.rounded(finer))
    }

    /// Everything needed to go on from here. Exact [at the start of a batch](Self::at_batch_start); elsewhere, the
    /// resumed run draws its batch anew.
    ///
    /// # Errors
    /// If a parameter is not finite.
    pub fn checkpoint(&self) -> Result<Checkpoint, NetworkError> {
        let model = ModelFile {
            field: self.field()?,
            similarity: self.similarity,
            scalars: Vec::new(),
            provenance: String::new(),
        };
        Ok(Checkpoint {
            settings: self.settings.clone(),
            state: self.state.clone(),
            hints: self.batch.hints.clone(),
            model,
            time: self.elapsed(),
        })
    }

    /// Goes back to an earlier state with half the learning rate.
    pub(crate) fn retreat(&mut self, to: &State) {
        let rate_factor = 0.5 * self.state.rate_factor;
        self.state = State { rate_factor, ..to.clone() };
    }

    /// Share of the batch with a foot whose mapped normal opposes the surface's there.
    pub(crate) fn flipped_fraction(&self) -> Result<f64, NetworkError> {
        let samples: Vec<FacePoint> = self.batch.samples.iter().map(Sample::on_face).collect();
        let mapped = self.field()?.map_with_tangents(&samples);
        let (mut hits, mut flipped) = (0_usize, 0_usize);
        for (mapped, target) in mapped.iter().zip(&self.batch.targets) {
            let normal = DVec3::from(target.surface_normal.map(f64::from));
            hits += usize::from(normal != DVec3::ZERO);
            flipped += usize::from(mapped.normal().dot(normal) < 0.0);
        }
        Ok(flipped as f64 / hits.max(1) as f64)
    }
}

/// Parameters of a network that may not be there.
fn parameters(network: &Option<Mlp>) -> &[f32] {
    network.as_ref().map_or(&[], Mlp::parameters)
}
