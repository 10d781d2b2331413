//! Epoch after epoch.

use std::time::{Duration, Instant};

use ndf_core::field::{FieldError, SampleEncoding, sample_encoding};
use ndf_core::network::encoding;
use ndf_core::network::{Mlp, MlpShape, Packed};
use ndf_core::progress::Progress;
use ndf_core::projection::projected;
use ndf_core::sampling::{AreaSampler, FaceSample};
use ndf_core::{DVec3, DisplacementField, ManifoldMesh, Query, Similarity, Surface};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;

use crate::batch::Batch;
use crate::optimiser::{AdamStep, Moments};
use crate::settings::Settings;
use crate::step::{Chunk, LossSums, Model, Step};

/// Chunks an epoch is cut into, whatever the number of threads, so that sums come out the same.
const CHUNKS: usize = 32;

/// Samples on which the result is measured.
const MEASURED_SAMPLES: usize = 65_536;

/// Streams of random numbers: batches count up from 0, the measurement has its own.
const MEASURING_STREAM: u64 = u64::MAX;

/// Why training did not end well.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// The settings do not make sense.
    #[error("{0}")]
    Settings(&'static str),
    /// The base mesh has no area.
    #[error("the base mesh has no area")]
    NoArea,
    /// The base mesh does not make a field.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// A loss became NaN or infinite.
    #[error("training diverged in epoch {epoch}; try a smaller learning rate")]
    Diverged {
        /// The epoch.
        epoch: usize,
    },
    /// Too few samples have a foot.
    #[error("only {share:.1} % of the base mesh finds the surface; is it near the surface?")]
    OutOfReach {
        /// Share of the samples with a foot, in percent.
        share: f64,
    },
}

/// Mean losses of an epoch, unweighted, in units of the normalised box squared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EpochLosses {
    /// Epoch, counted from 0.
    pub epoch: usize,
    /// Mean squared distance to the (tangent plane of the) surface.
    pub projection: f64,
    /// Mean squared distance between g_φ(g_θ(x)) and x.
    pub cycle: f64,
}

/// What came out, measured on fresh samples with true projections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitReport {
    /// Epochs made.
    pub epochs: usize,
    /// Wall seconds of training.
    pub seconds: f64,
    /// Of these, spent on projecting.
    pub seconds_projecting: f64,
    /// Root of the mean squared distance to the surface, in the normalised box.
    pub projection_rms: f64,
    /// Largest distance to the surface, in the normalised box.
    pub projection_max: f64,
    /// Cycle loss of the last epoch; 0 without cycle loss.
    pub cycle_loss: f64,
    /// Share of the samples whose normal opposes the surface's.
    pub flipped_fraction: f64,
    /// Share of the samples that have no foot.
    pub missed_fraction: f64,
    /// Whether training was cancelled before its last epoch.
    pub interrupted: bool,
}

/// A learned field, how to get to it from the user's units, and how good it is.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The field, in the normalised box.
    pub field: DisplacementField,
    /// From the surface's coordinates to the box.
    pub similarity: Similarity,
    /// How good it is.
    pub report: FitReport,
}

/// Learns the displacement field of `base` (in the surface's coordinates) that covers `surface`.
///
/// # Errors
/// If the settings or the base mesh are not usable, or training diverges.
pub fn fit(
    surface: &dyn Surface,
    base: &ManifoldMesh,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Fit, TrainError> {
    let mut trainer = Trainer::new(surface, base, settings)?;
    let mut interrupted = false;
    let mut losses = None;
    while trainer.epoch < settings.epochs {
        let epoch = trainer.epoch;
        if epoch.is_multiple_of(50) {
            if let Some(EpochLosses { projection, .. }) = losses {
                progress.detail(&format!("distance {:.2e}", projection.sqrt()));
            }
            progress.report("training", epoch as f64 / settings.epochs as f64);
        }
        let out_of_time = settings.time_limit.is_some_and(|limit| trainer.started.elapsed() >= limit);
        if out_of_time || progress.cancelled() {
            interrupted = true;
            break;
        }
        losses = Some(trainer.run_epoch()?);
    }
    progress.report("training", 1.0);
    let field = trainer.field()?;
    let mut report = trainer.measure(&field);
    report.cycle_loss = losses.map_or(0.0, |l| l.cycle);
    report.interrupted = interrupted;
    Ok(Fit { field, similarity: trainer.similarity, report })
}

/// The state of a training run.
pub struct Trainer<'a> {
    surface: &'a dyn Surface,
    settings: Settings,
    similarity: Similarity,
    /// The field training started from: base mesh and shapes.
    start: DisplacementField,
    positions: Vec<[f32; 3]>,
    /// Faces and corners around every vertex: `incident[v]` lists `3 f + c`.
    incident: Vec<Vec<u32>>,
    sampler: AreaSampler,
    features: Vec<f32>,
    theta: Mlp,
    phi: Mlp,
    packed: (Packed, Packed),
    moments: [Moments; 3],
    gradients: (Vec<f32>, Vec<f32>),
    batch: Batch,
    encoding_gradients: Vec<f32>,
    chunks: Vec<Chunk>,
    epoch: usize,
    started: Instant,
    projecting: Duration,
}

impl<'a> Trainer<'a> {
    /// Everything ready for the first epoch.
    ///
    /// # Errors
    /// If the settings or the base mesh are not usable.
    pub fn new(
        surface: &'a dyn Surface,
        base: &ManifoldMesh,
        settings: &Settings,
    ) -> Result<Self, TrainError> {
        if let Some(defect) = settings.defect() {
            return Err(TrainError::Settings(defect));
        }
        let similarity = Similarity::to_box(&base.bounds());
        let normalised = base.positions().iter().map(|&p| similarity.to_normalised(p)).collect();
        let base = base.with_positions(normalised);
        let start = DisplacementField::untrained(base, settings.field.clone(), settings.seed)?;
        let base = start.base();
        let sampler = AreaSampler::of_manifold(base).ok_or(TrainError::NoArea)?;
        let shape = MlpShape {
            inputs: 3 + encoding::width(settings.reverse_octaves),
            hidden: settings.field.hidden.clone(),
            outputs: 3,
        };
        let mut rng = ChaCha8Rng::seed_from_u64(settings.seed ^ 0x9e37_79b9_7f4a_7c15);
        let phi = if settings.field.residual {
            Mlp::zero_at_birth(shape, &mut rng)
        } else {
            Mlp::kaiming(shape, &mut rng)
        };
        let theta = start.network().clone();
        let packed = (Packed::new(&theta), Packed::new(&phi));
        let features = start.features().to_vec();
        let (parameters, reverse_parameters) = (theta.parameters().len(), phi.parameters().len());
        Ok(Self {
            surface,
            similarity,
            positions: sample_encoding::single(base.positions()),
            incident: (0..base.vertex_count() as u32).map(|v| base.outgoing(v).collect()).collect(),
            sampler,
            moments: [features.len(), parameters, reverse_parameters].map(Moments::new),
            gradients: (vec![0.0; parameters], vec![0.0; reverse_parameters]),
            batch: Batch::new(settings.samples, base.face_count()),
            encoding_gradients: vec![0.0; settings.samples * settings.field.features],
            chunks: (0..CHUNKS).map(|_| Chunk::new(&packed.0, &packed.1)).collect(),
            features,
            theta,
            phi,
            packed,
            start,
            settings: settings.clone(),
            epoch: 0,
            started: Instant::now(),
            projecting: Duration::ZERO,
        })
    }

    /// Makes one epoch: samples and feet if they are due, one step of the optimiser.
    ///
    /// # Errors
    /// If a loss is not finite, or hardly a sample finds the surface.
    pub fn run_epoch(&mut self) -> Result<EpochLosses, TrainError> {
        let settings = &self.settings;
        let resample = self.epoch.is_multiple_of(settings.resample_every);
        if resample {
            let stream = (self.epoch / settings.resample_every) as u64;
            self.batch.resample(&self.sampler, settings.seed, stream);
        }
        if resample || self.epoch.is_multiple_of(settings.project_every) {
            self.project()?;
        }
        let sums = self.gradients();
        self.update();
        let n = self.settings.samples as f64;
        let losses =
            EpochLosses { epoch: self.epoch, projection: sums.projection / n, cycle: sums.cycle / n };
        if !(losses.projection.is_finite() && losses.cycle.is_finite()) {
            return Err(TrainError::Diverged { epoch: self.epoch });
        }
        self.epoch += 1;
        Ok(losses)
    }

    fn project(&mut self) -> Result<(), TrainError> {
        let before = Instant::now();
        let field = self.field().map_err(|_| TrainError::Diverged { epoch: self.epoch })?;
        let samples: Vec<_> = self
            .batch
            .samples
            .iter()
            .map(|s| FaceSample { face: s.face, barycentric: s.barycentric.map(f64::from) })
            .collect();
        // The guide is the normal of the base face, not that of g: where g has folded over, its own normal would
        // send it to the far side of the surface and keep it folded.
        let base = self.start.base().as_triangle_mesh();
        let guide = |sample: &FaceSample| base.face_normal(sample.face);
        let images: Vec<(DVec3, DVec3)> =
            field.map(&samples).into_iter().zip(samples.iter().map(guide)).collect();
        self.batch.project(self.surface, &self.similarity, &images);
        self.projecting += before.elapsed();
        let share = 100.0 * self.batch.hit_share();
        if share < 1.0 { Err(TrainError::OutOfReach { share }) } else { Ok(()) }
    }

    /// Values and gradients of the losses at the current parameters.
    fn gradients(&mut self) -> LossSums {
        self.packed.0.pack(self.theta.parameters());
        self.packed.1.pack(self.phi.parameters());
        let settings = &self.settings;
        let d = settings.field.features;
        let model = Model {
            encoding: SampleEncoding {
                faces: self.start.base().faces(),
                positions: &self.positions,
                features: &self.features,
                dimension: d,
                octaves: settings.field.octaves,
            },
            theta: &self.packed.0,
            phi: &self.packed.1,
            reverse_octaves: settings.reverse_octaves,
            residual: settings.field.residual,
            projection_weight: settings.lambda_p / settings.samples as f32,
            cycle_weight: settings.lambda_c / settings.samples as f32,
        };
        let size = settings.samples.div_ceil(CHUNKS);
        // Without features there is nothing to write; every chunk then gets an empty slice.
        let mut parts: Vec<&mut [f32]> = if d > 0 {
            self.encoding_gradients.chunks_mut(size * d).collect()
        } else {
            std::iter::repeat_with(|| &mut [][..]).take(CHUNKS).collect()
        };
        let batch = &self.batch;
        let work = batch.samples.par_chunks(size).zip(batch.targets.par_chunks(size));
        let arch = pulp::Arch::new();
        self.chunks.par_iter_mut().zip(work).zip(&mut parts).for_each(|((chunk, (samples, targets)), dz)| {
            arch.dispatch(Step { model, chunk, samples, targets, encoding_gradients: dz });
        });
        let (to_theta, to_phi) = (&mut self.gradients.0, &mut self.gradients.1);
        to_theta.fill(0.0);
        to_phi.fill(0.0);
        let mut sums = LossSums::default();
        for chunk in &self.chunks[..settings.samples.div_ceil(size)] {
            chunk.theta_gradients.add_to(to_theta);
            chunk.phi_gradients.add_to(to_phi);
            sums.projection += chunk.losses.projection;
            sums.cycle += chunk.losses.cycle;
        }
        sums
    }

    /// One step of Adam for all parameters.
    fn update(&mut self) {
        let settings = &self.settings;
        let fraction = self.epoch as f32 / settings.epochs.max(1) as f32;
        let step = AdamStep::new(self.epoch + 1, settings.rate.at(fraction));
        let [of_features, of_theta, of_phi] = &mut self.moments;
        of_theta.apply(step, self.theta.parameters_mut(), &self.gradients.0);
        if settings.lambda_c > 0.0 {
            of_phi.apply(step, self.phi.parameters_mut(), &self.gradients.1);
        }
        let d = settings.field.features;
        if d == 0 {
            return;
        }
        let step = step.scaled(settings.feature_rate);
        let (first, second) = of_features.parts_mut();
        let (samples, starts) = (&self.batch.samples, &self.batch.face_starts);
        let dz = &self.encoding_gradients;
        let vertices = self.features.par_chunks_mut(d).zip(&self.incident);
        let moments = first.par_chunks_mut(d).zip(second.par_chunks_mut(d));
        vertices.zip(moments).with_min_len(64).for_each_init(
            || vec![0.0; d],
            |gradient, ((features, incident), (first, second))| {
                gradient.fill(0.0);
                for &corner in incident {
                    let (f, c) = (corner as usize / 3, corner as usize % 3);
                    for s in starts[f] as usize..starts[f + 1] as usize {
                        let b = samples[s].barycentric[c];
                        gradient.iter_mut().zip(&dz[s * d..][..d]).for_each(|(g, dz)| *g += b * dz);
                    }
                }
                for k in 0..d {
                    step.update(&mut features[k], &mut first[k], &mut second[k], gradient[k]);
                }
            },
        );
    }

    /// The field as learned so far.
    ///
    /// # Errors
    /// If a parameter is not finite.
    pub fn field(&self) -> Result<DisplacementField, FieldError> {
        self.start.with_parameters(self.features.clone(), self.theta.parameters().to_vec())
    }

    /// Measures `field` on fresh samples with true projections.
    fn measure(&self, field: &DisplacementField) -> FitReport {
        let samples = self.sampler.sample(MEASURED_SAMPLES, self.settings.seed, MEASURING_STREAM);
        let mapped = field.map_with_tangents(&samples);
        let queries: Vec<Query> =
            mapped.iter().map(|m| Query::at(self.similarity.to_world(m.point))).collect();
        let (mut squares, mut largest, mut hits, mut flipped) = (0.0, 0.0_f64, 0, 0);
        for (foot, mapped) in projected(self.surface, &queries).iter().zip(&mapped) {
            if let Ok(foot) = foot {
                let distance = self.similarity.to_normalised(foot.point).distance(mapped.point);
                squares += distance * distance;
                largest = largest.max(distance);
                hits += 1;
                flipped += usize::from(foot.normal.dot(mapped.normal()) < 0.0);
            }
        }
        let share = |n: usize, of: usize| n as f64 / of.max(1) as f64;
        FitReport {
            epochs: self.epoch,
            seconds: self.started.elapsed().as_secs_f64(),
            seconds_projecting: self.projecting.as_secs_f64(),
            projection_rms: (squares / hits.max(1) as f64).sqrt(),
            projection_max: largest,
            cycle_loss: 0.0,
            flipped_fraction: share(flipped, hits),
            missed_fraction: share(samples.len() - hits, samples.len()),
            interrupted: false,
        }
    }
}
