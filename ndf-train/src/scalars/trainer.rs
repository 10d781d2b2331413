//! Epoch after epoch.

use ndf_core::field::{SampleEncoding, sample_encoding};
use ndf_core::network::{Mlp, Packed};
use ndf_core::scalars::{Channel, StoredScalarsError};
use ndf_core::{ManifoldMesh, StoredScalars};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;

use super::settings::ScalarSettings;
use super::step::{Chunk, Network, Step};
use super::values::{Drawn, Foot, Values};
use crate::batch::{CHUNKS, Sample};
use crate::optimiser::{AdamStep, FeatureUpdate, Moments};

/// Samples ordered by face, in chunks of whole faces.
pub(super) struct Batch {
    samples: Vec<Sample>,
    feet: Vec<Foot>,
    /// Chunk k has the faces `faces[k] .. faces[k + 1]` and the samples `starts[k] .. starts[k + 1]`.
    faces: [u32; CHUNKS + 1],
    starts: [usize; CHUNKS + 1],
}

impl Batch {
    pub(super) fn new(drawn: Drawn, face_count: usize) -> Self {
        let samples: Vec<Sample> = drawn.points.iter().map(Sample::new).collect();
        let (mut faces, mut starts) = ([0; CHUNKS + 1], [0; CHUNKS + 1]);
        for k in 1..CHUNKS {
            // The first face of which no sample is before this share.
            let share = k * samples.len() / CHUNKS;
            faces[k] = share.checked_sub(1).map_or(0, |last| samples[last].face + 1);
            starts[k] = samples.partition_point(|s| s.face < faces[k]);
        }
        (faces[CHUNKS], starts[CHUNKS]) = (face_count as u32, samples.len());
        Self { samples, feet: drawn.feet, faces, starts }
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
    packed: Packed,
    chunks: Vec<Chunk>,
    pub(super) by_parameters: Vec<f32>,
    /// Derivatives by the features, 3 d floats a base face: d for each of its corners.
    pub(super) by_corners: Vec<f32>,
}

impl<'a> Trainer<'a> {
    pub(super) fn new(base: &'a ManifoldMesh, channels: usize, settings: &'a ScalarSettings) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
        let mlp = Mlp::kaiming(settings.shape.network(channels), &mut rng);
        let d = settings.shape.features;
        let features = vec![0.0; base.vertex_count() * d];
        let packed = Packed::new(&mlp);
        Self {
            channels,
            moments: [features.len(), mlp.parameters().len()].map(Moments::new),
            epoch: 0,
            positions: sample_encoding::single(base.positions()),
            incident: (0..base.vertex_count() as u32).map(|v| base.outgoing(v).collect()).collect(),
            chunks: (0..CHUNKS).map(|_| Chunk::new(&packed, channels)).collect(),
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

    /// The fields as learned so far.
    pub(super) fn fields(&self, channels: &[Channel]) -> Result<StoredScalars, StoredScalarsError> {
        let (features, parameters) = (self.features.clone(), self.mlp.parameters().to_vec());
        let shape = self.settings.shape.clone();
        StoredScalars::new(channels.to_vec(), shape, self.base.vertex_count(), features, parameters)
    }

    /// Makes one epoch; returns the mean squared error over samples and channels, in units of the channels' deviations.
    pub(super) fn run_epoch(&mut self, batch: &Batch, values: &Values) -> f64 {
        let loss = self.accumulate(batch, values);
        let Self { settings, epoch, .. } = *self;
        let rate = settings.rate.at(epoch as f32 / settings.epochs as f32);
        let step = AdamStep::new(epoch + 1, rate);
        let [of_features, of_network] = &mut self.moments;
        of_network.apply(step, self.mlp.parameters_mut(), &self.by_parameters);
        if settings.shape.features > 0 {
            let (first, second) = of_features.parts_mut();
            FeatureUpdate {
                step: step.scaled(settings.feature_rate),
                dimension: settings.shape.features,
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
        self.packed.pack(self.mlp.parameters());
        let d = self.settings.shape.features;
        let network = Network {
            encoding: SampleEncoding {
                faces: self.base.faces(),
                positions: &self.positions,
                features: &self.features,
                dimension: d,
                octaves: self.settings.shape.octaves,
            },
            packed: &self.packed,
            passes: self.settings.shape.passes(self.channels),
            values,
        };
        let terms = batch.samples.len() * self.channels;
        let mut rest = self.by_corners.as_mut_slice();
        let corners: Vec<&mut [f32]> = batch
            .faces
            .windows(2)
            .map(|faces| rest.split_off_mut(..(faces[1] - faces[0]) as usize * 3 * d).unwrap_or_default())
            .collect();
        let arch = pulp::Arch::new();
        self.chunks.par_iter_mut().zip(corners).enumerate().for_each(|(k, (chunk, corner_gradients))| {
            let samples = batch.starts[k]..batch.starts[k + 1];
            arch.dispatch(Step {
                network,
                share: 1.0 / terms as f32,
                chunk,
                samples: &batch.samples[samples.clone()],
                feet: &batch.feet[samples],
                first_face: batch.faces[k],
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
