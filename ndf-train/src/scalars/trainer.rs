//! Epoch after epoch.

use ndf_mesh::ManifoldMesh;
use ndf_model::SurfaceScalars;
use ndf_model::file::Precision;
use ndf_model::scalars::{Channel, ScalarsError};
use ndf_network::{BLOCK, Mlp};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::settings::ScalarSettings;
use super::step::{Chunk, Step};
use super::values::{Drawn, Foot, Values};
use crate::engine::optimiser::AdamStep;
use crate::engine::{CHUNKS, Chunks, Engine, Learned};
use crate::objective::Place;

/// Samples of a chunk: four blocks, of which the last is rarely full, since chunks hold whole faces.
const CHUNK_SAMPLES: usize = 4 * BLOCK;

/// Chunks of a batch of so many samples, whatever the number of threads, so that sums come out the same.
fn chunk_count(samples: usize) -> usize {
    samples.div_ceil(CHUNK_SAMPLES).min(CHUNKS)
}

/// Samples ordered by face, in chunks of whole faces.
pub(super) struct Batch {
    places: Vec<Place>,
    feet: Vec<Foot>,
    chunks: Chunks,
}

impl Batch {
    pub(super) fn new(drawn: Drawn, face_count: usize) -> Self {
        let places: Vec<Place> = drawn.points.iter().map(Place::new).collect();
        let chunks = Chunks::new(&places, face_count, chunk_count(places.len()));
        Self { places, feet: drawn.feet, chunks }
    }
}

/// Everything that is learned, and what is needed for it.
pub(super) struct Trainer<'a> {
    base: &'a ManifoldMesh,
    settings: &'a ScalarSettings,
    channels: usize,
    precision: Option<Precision>,
    pub(super) learned: Learned,
    pub(super) engine: Engine,
    chunks: Vec<Chunk>,
    epoch: usize,
}

impl<'a> Trainer<'a> {
    pub(super) fn new(base: &'a ManifoldMesh, channels: usize, settings: &'a ScalarSettings) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
        let mlp = Mlp::kaiming(settings.shape.mlp(channels), &mut rng);
        let engine = Engine::new(base, &settings.shape.network, &mlp);
        let chunk = |_| Chunk::new(&engine.packed, channels);
        Self {
            base,
            settings,
            channels,
            precision: settings.bits.map(Precision::from_bits),
            chunks: (0..chunk_count(settings.samples)).map(chunk).collect(),
            learned: Learned::new(vec![0.0; base.vertex_count() * settings.shape.network.features], mlp),
            engine,
            epoch: 0,
        }
    }

    /// Epochs made.
    pub(super) fn epoch(&self) -> usize {
        self.epoch
    }

    /// The fields as learned so far, as they will be stored.
    pub(super) fn fields(&self, channels: &[Channel]) -> Result<SurfaceScalars, ScalarsError> {
        let (features, parameters) = self.learned.numbers();
        let (shape, vertices) = (self.settings.shape.clone(), self.base.vertex_count());
        let fields = SurfaceScalars::new(channels.to_vec(), shape, vertices, features, parameters)?;
        Ok(match self.learned.to_be_rounded(self.precision) {
            Some(precision) => fields.rounded(precision),
            None => fields,
        })
    }

    /// Makes one epoch; returns the mean squared error over samples and channels, in units of the channels' deviations.
    pub(super) fn run_epoch(&mut self, batch: &Batch, values: &Values) -> f64 {
        let (settings, epoch) = (self.settings, self.epoch);
        if let (Some(precision), Some(first)) = (self.precision, settings.first_rounded())
            && epoch >= first
        {
            self.learned.choose_grids(settings.shape.network.features, precision);
        }
        let loss = self.accumulate(batch, values);
        let rate = settings.rate.at(epoch as f32 / settings.epochs as f32);
        self.engine.update(&mut self.learned, AdamStep::new(epoch + 1, rate), settings.feature_rate);
        self.epoch += 1;
        loss
    }

    /// The loss and its gradients at the current parameters.
    pub(super) fn accumulate(&mut self, batch: &Batch, values: &Values) -> f64 {
        self.engine.load(&self.learned);
        let passes = self.settings.shape.passes(self.channels);
        let errors = batch.places.len() * self.channels;
        let share = 1.0 / errors as f32;
        let arch = pulp::Arch::new();
        let chunks = &mut self.chunks;
        let sum =
            self.engine.run(&self.learned, &batch.chunks, chunks, |network, chunk, samples, corners| {
                let (places, feet) = (&batch.places[samples.clone()], &batch.feet[samples]);
                arch.dispatch(Step { network, passes, values, share, chunk, places, feet, corners });
            });
        sum.loss / errors as f64
    }
}
