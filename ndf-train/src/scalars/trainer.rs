//! Epoch after epoch.

use std::ops::Range;

use ndf_mesh::ManifoldMesh;
use ndf_model::SurfaceScalars;
use ndf_model::file::{Grids, Precision};
use ndf_model::intrinsic_network::{IntrinsicEncoding, single};
use ndf_model::scalars::{Channel, ScalarsError};
use ndf_network::{BLOCK, Mlp, Packed};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;

use super::settings::ScalarSettings;
use super::step::{Chunk, Network, Step};
use super::values::{Drawn, Foot, Values};
use crate::batch::{CHUNKS, Sample};
use crate::optimiser::{AdamStep, FeatureUpdate, Moments};
use crate::rounding::Rounded;

/// Samples of a chunk: four blocks, of which the last is rarely full, since chunks hold whole faces.
const CHUNK_SAMPLES: usize = 4 * BLOCK;

/// Chunks of a batch of so many samples, whatever the number of threads, so that sums come out the same.
fn chunk_count(samples: usize) -> usize {
    samples.div_ceil(CHUNK_SAMPLES).min(CHUNKS)
}

/// Samples ordered by face, in chunks of whole faces.
pub(super) struct Batch {
    samples: Vec<Sample>,
    feet: Vec<Foot>,
    chunks: Vec<ChunkRange>,
}

/// A part of a batch.
#[derive(Clone, Debug)]
struct ChunkRange {
    faces: Range<u32>,
    samples: Range<usize>,
}

impl Batch {
    pub(super) fn new(drawn: Drawn, face_count: usize) -> Self {
        let samples: Vec<Sample> = drawn.points.iter().map(Sample::new).collect();
        let count = chunk_count(samples.len());
        let (mut face, mut start) = (0, 0);
        let chunks = (1..=count)
            .map(|k| {
                // Up to the first face of which no sample is in this share.
                let share = k * samples.len() / count;
                let end_face = if k == count { face_count as u32 } else { samples[share - 1].face + 1 };
                let end = samples.partition_point(|s| s.face < end_face);
                ChunkRange {
                    faces: std::mem::replace(&mut face, end_face)..end_face,
                    samples: std::mem::replace(&mut start, end)..end,
                }
            })
            .collect();
        Self { samples, feet: drawn.feet, chunks }
    }
}

/// Everything that is learned, and what is needed for it.
pub(super) struct Trainer<'a> {
    base: &'a ManifoldMesh,
    settings: &'a ScalarSettings,
    channels: usize,
    pub(super) features: Vec<f32>,
    pub(super) mlp: Mlp,
    moments: [Moments; 2],
    epoch: usize,
    positions: Vec<[f32; 3]>,
    /// Half-edges out of every vertex: `3 f + c` for its corner c of face f.
    incident: Vec<Vec<u32>>,
    /// Where numbers are rounded to, from the first epoch in which they are.
    grids: Option<Grids>,
    /// Features and network as the loss sees them.
    rounded: Rounded,
    packed: Packed,
    chunks: Vec<Chunk>,
    pub(super) by_parameters: Vec<f32>,
    /// Derivatives by the features, 3 d floats a base face: d for each of its corners.
    pub(super) by_corners: Vec<f32>,
}

impl<'a> Trainer<'a> {
    pub(super) fn new(base: &'a ManifoldMesh, channels: usize, settings: &'a ScalarSettings) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
        let mlp = Mlp::kaiming(settings.shape.mlp(channels), &mut rng);
        let d = settings.shape.network.features;
        let features = vec![0.0; base.vertex_count() * d];
        let packed = Packed::new(&mlp);
        Self {
            channels,
            moments: [features.len(), mlp.parameters().len()].map(Moments::new),
            epoch: 0,
            grids: None,
            rounded: Rounded::default(),
            positions: single(base.positions()),
            incident: (0..base.vertex_count() as u32).map(|v| base.outgoing(v).collect()).collect(),
            chunks: (0..chunk_count(settings.samples)).map(|_| Chunk::new(&packed, channels)).collect(),
            by_parameters: vec![0.0; mlp.parameters().len()],
            by_corners: vec![0.0; base.face_count() * 3 * d],
            base,
            settings,
            features,
            mlp,
            packed,
        }
    }

    /// Epochs made.
    pub(super) fn epoch(&self) -> usize {
        self.epoch
    }

    /// The fields as learned so far, rounded where the loss sees them so. Where nothing was yet learned of the rounding, it
    /// is finer than asked for, so that it costs next to no accuracy.
    pub(super) fn fields(&self, channels: &[Channel]) -> Result<SurfaceScalars, ScalarsError> {
        let (mut features, mut mlp) = (self.features.clone(), self.mlp.clone());
        if let Some(grids) = &self.grids {
            grids.round(&mut features, &mut mlp);
        }
        let shape = self.settings.shape.clone();
        let parameters = mlp.parameters().to_vec();
        let fields =
            SurfaceScalars::new(channels.to_vec(), shape, self.base.vertex_count(), features, parameters)?;
        Ok(match (self.settings.bits, &self.grids) {
            (Some(bits), None) => fields.rounded(Precision::of_bits(bits + 3)),
            _ => fields,
        })
    }

    /// Makes one epoch; returns the mean squared error over samples and channels, in units of the channels' deviations.
    pub(super) fn run_epoch(&mut self, batch: &Batch, values: &Values) -> f64 {
        if let (Some(bits), Some(first)) = (self.settings.bits, self.settings.first_rounded())
            && self.epoch >= first
        {
            let precision = Precision::of_bits(bits);
            let d = self.settings.shape.network.features;
            self.grids.get_or_insert_with(|| Grids::new(d, &self.features, &self.mlp, precision));
        }
        self.rounded.update(self.grids.as_ref(), &self.features, &self.mlp);
        let loss = self.accumulate(batch, values);
        let Self { settings, epoch, .. } = *self;
        let rate = settings.rate.at(epoch as f32 / settings.epochs as f32);
        let step = AdamStep::new(epoch + 1, rate);
        let [of_features, of_network] = &mut self.moments;
        of_network.apply(step, self.mlp.parameters_mut(), &self.by_parameters);
        if settings.shape.network.features > 0 {
            let (first, second) = of_features.parts_mut();
            FeatureUpdate {
                step: step.scaled(settings.feature_rate),
                dimension: settings.shape.network.features,
                incident: &self.incident,
                corner_gradients: &self.by_corners,
            }
            .apply(&mut self.features, first, second);
        }
        self.epoch += 1;
        loss
    }

    /// The loss and its gradients at the current parameters.
    pub(super) fn accumulate(&mut self, batch: &Batch, values: &Values) -> f64 {
        let (features, mlp) = self.rounded.seen(&self.features, &self.mlp);
        self.packed.pack(mlp.parameters());
        let d = self.settings.shape.network.features;
        let network = Network {
            encoding: IntrinsicEncoding::new(
                self.base.faces(),
                &self.positions,
                features,
                &self.settings.shape.network,
            ),
            packed: &self.packed,
            passes: self.settings.shape.passes(self.channels),
            values,
        };
        let terms = batch.samples.len() * self.channels;
        let mut rest = self.by_corners.as_mut_slice();
        let corners: Vec<&mut [f32]> = batch
            .chunks
            .iter()
            .map(|ranges| rest.split_off_mut(..ranges.faces.len() * 3 * d).unwrap_or_default())
            .collect();
        let arch = pulp::Arch::new();
        let chunks = self.chunks.par_iter_mut().zip(&batch.chunks).zip(corners);
        chunks.for_each(|((chunk, ranges), corner_gradients)| {
            arch.dispatch(Step {
                network,
                share: 1.0 / terms as f32,
                chunk,
                samples: &batch.samples[ranges.samples.clone()],
                feet: &batch.feet[ranges.samples.clone()],
                first_face: ranges.faces.start,
                corner_gradients,
            });
        });
        let (sum, others) = self.chunks.split_first_mut().expect("there are chunks");
        others.iter().for_each(|chunk| sum.add(chunk));
        self.by_parameters.fill(0.0);
        sum.gradients.add_to(&mut self.by_parameters);
        sum.loss / terms as f64
    }
}
