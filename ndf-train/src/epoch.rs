//! One epoch: its chunks over all threads.

use crate::batch::Batch;
use crate::objective::Objective;
use crate::step::{Chunk, Model, Step};

/// What all chunks of an epoch share.
pub(crate) struct Epoch<'a> {
    pub(crate) model: Model<'a>,
    pub(crate) objective: &'a Objective,
    /// 1 / number of samples.
    pub(crate) share: f32,
    pub(crate) batch: &'a Batch,
    pub(crate) arch: pulp::Arch,
}

impl Epoch<'_> {
    /// Runs the chunks from number `first` on, over all threads; `corner_gradients` begins with the first's faces.
    pub(crate) fn run(&self, first: usize, chunks: &mut [Chunk], corner_gradients: &mut [f32]) {
        let faces = |k: usize| self.batch.chunk_faces[k];
        if let [chunk] = chunks {
            corner_gradients.fill(0.0);
            let samples = self.batch.samples_of(faces(first)..faces(first + 1));
            self.arch.dispatch(Step {
                model: self.model,
                objective: self.objective,
                share: self.share,
                chunk,
                samples: &self.batch.samples[samples.clone()],
                targets: &self.batch.targets[samples.clone()],
                origins: self.batch.origins.get(samples).unwrap_or_default(),
                first_face: faces(first),
                corner_gradients,
            });
            return;
        }
        let half = chunks.len() / 2;
        let (left, right) = chunks.split_at_mut(half);
        let floats = (faces(first + half) - faces(first)) as usize * 3 * self.model.encoding.dimension();
        let (left_corners, right_corners) = corner_gradients.split_at_mut(floats);
        rayon::join(|| self.run(first, left, left_corners), || self.run(first + half, right, right_corners));
    }
}
