//! What both kinds of training share: features and a perceptron, their gradients over chunks of samples, and one step of the
//! optimiser.

mod chunks;
mod learned;
pub(crate) mod optimiser;

use std::ops::Range;

use ndf_mesh::{Halfedge, ManifoldMesh};
use ndf_model::NetworkShape;
use ndf_model::intrinsic_network::{IntrinsicEncoding, single};
use ndf_network::{Gradients, Mlp, Packed};
use rayon::prelude::*;

pub(crate) use chunks::{CHUNKS, Chunks};
pub(crate) use learned::{Learned, rounded_epochs};

use crate::objective::Place;
use learned::Rounded;
use optimiser::{AdamStep, FeatureUpdate};

/// What is needed to learn an [`IntrinsicNetwork`](ndf_model::IntrinsicNetwork), besides [what is learned](Learned):
/// all of it can be made anew.
pub(crate) struct Engine {
    shape: NetworkShape,
    faces: Vec<[u32; 3]>,
    positions: Vec<[f32; 3]>,
    /// Half-edges out of every vertex: `3 f + c` for its corner c of face f.
    incident: Vec<Vec<Halfedge>>,
    /// What is learned as losses see it, where numbers are rounded.
    rounded: Rounded,
    pub(crate) packed: Packed,
    /// Derivatives by the parameters of the perceptron.
    pub(crate) by_parameters: Vec<f32>,
    /// Derivatives by the features, 3 d floats a base face: d for each of its corners.
    pub(crate) by_corners: Vec<f32>,
}

/// The network as losses see it in an epoch.
#[derive(Clone, Copy)]
pub(crate) struct Network<'a> {
    pub(crate) encoding: IntrinsicEncoding<'a>,
    pub(crate) packed: &'a Packed,
}

/// A chunk's own memory, kept from epoch to epoch.
pub(crate) trait Memory: Send {
    /// Gradients of the perceptron.
    fn gradients(&self) -> &Gradients;
    /// Adds the sums of another chunk.
    fn add(&mut self, other: &Self);
}

impl Engine {
    pub(crate) fn new(base: &ManifoldMesh, shape: &NetworkShape, mlp: &Mlp) -> Self {
        Self {
            shape: shape.clone(),
            faces: base.faces().to_vec(),
            positions: single(base.positions()),
            incident: base.topology().vertices().map(|v| base.topology().outgoing(v).collect()).collect(),
            rounded: Rounded::default(),
            packed: Packed::new(mlp),
            by_parameters: vec![0.0; mlp.parameters().len()],
            by_corners: vec![0.0; base.face_count() * 3 * shape.features],
        }
    }

    /// Takes over what was learned, rounded where it has grids.
    pub(crate) fn load(&mut self, learned: &Learned) {
        self.rounded.update(learned);
        let (_, mlp) = self.rounded.seen(learned);
        self.packed.pack(mlp.parameters());
    }

    /// The gradients of an epoch, as `work` gives them for chunks of samples, over all threads; returns the memory of
    /// the first chunk with the sums of all. Whatever the number of threads, they are added in order.
    pub(crate) fn run<'m, M: Memory>(
        &mut self,
        learned: &Learned,
        chunks: &Chunks,
        memory: &'m mut [M],
        work: impl Fn(Network<'_>, &mut M, Range<usize>, CornerGradients<'_>) + Sync,
    ) -> &'m M {
        let d = self.shape.features;
        let network = Network {
            encoding: IntrinsicEncoding::new(
                &self.faces,
                &self.positions,
                self.rounded.seen(learned).0,
                &self.shape,
            ),
            packed: &self.packed,
        };
        let mut rest = self.by_corners.as_mut_slice();
        let corners: Vec<&mut [f32]> = chunks
            .iter()
            .map(|chunk| rest.split_off_mut(..chunk.faces.len() * 3 * d).unwrap_or_default())
            .collect();
        let parts = memory.par_iter_mut().zip(chunks.as_slice()).zip(corners);
        parts.for_each(|((memory, chunk), by_corner)| {
            by_corner.fill(0.0);
            let encoding = network.encoding;
            let corners = CornerGradients { first_face: chunk.faces.start, by_corner, encoding };
            work(network, memory, chunk.samples.clone(), corners);
        });
        let (sum, others) = memory.split_first_mut().expect("there are chunks");
        others.iter().for_each(|chunk| sum.add(chunk));
        self.by_parameters.fill(0.0);
        sum.gradients().add_to(&mut self.by_parameters);
        sum
    }

    /// Adds the gradients of `work` on points anywhere on the base mesh, on this thread.
    pub(crate) fn add<M: Memory>(
        &mut self,
        learned: &Learned,
        memory: &mut M,
        work: impl FnOnce(Network<'_>, &mut M, CornerGradients<'_>),
    ) {
        let features = self.rounded.seen(learned).0;
        let encoding = IntrinsicEncoding::new(&self.faces, &self.positions, features, &self.shape);
        let corners = CornerGradients { first_face: 0, by_corner: &mut self.by_corners, encoding };
        work(Network { encoding, packed: &self.packed }, memory, corners);
        memory.gradients().add_to(&mut self.by_parameters);
    }

    /// One step of Adam, for the features at a multiple of the rate.
    pub(crate) fn update(&self, learned: &mut Learned, step: AdamStep, feature_rate: f32) {
        let Learned { features, mlp, moments: [of_features, of_mlp], .. } = learned;
        of_mlp.apply(step, mlp.parameters_mut(), &self.by_parameters);
        if self.shape.features == 0 {
            return;
        }
        let (first, second) = of_features.parts_mut();
        FeatureUpdate {
            step: step.scaled(feature_rate),
            dimension: self.shape.features,
            incident: &self.incident,
            corner_gradients: &self.by_corners,
        }
        .apply(features, first, second);
    }
}

/// Sums of the gradients by the features, corner by corner.
pub(crate) struct CornerGradients<'a> {
    /// The face whose corners come first in `by_corner`.
    pub(crate) first_face: usize,
    /// d floats a corner.
    pub(crate) by_corner: &'a mut [f32],
    pub(crate) encoding: IntrinsicEncoding<'a>,
}

impl CornerGradients<'_> {
    /// Adds the derivatives by the interpolated features, which begin the rows, times the weights of the corners.
    #[inline(always)]
    pub(crate) fn add(
        &mut self,
        places: &[Place],
        rows: &[f32],
        stride: usize,
        weights: impl Fn(&Place) -> [f32; 3],
    ) {
        let d = self.encoding.dimension();
        if d == 0 {
            return;
        }
        for (place, row) in places.iter().zip(rows.chunks_exact(stride)) {
            let face = place.face.index() - self.first_face;
            self.encoding.add_to_corners(weights(place), row, &mut self.by_corner[3 * face * d..]);
        }
    }
}
