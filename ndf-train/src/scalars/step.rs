//! One chunk of an epoch: samples through the network, the squared errors of all channels, and all the way back.

use ndf_model::intrinsic_network::Passes;
use ndf_network::simd::{InputGradient, backward, forward};
use ndf_network::{Activations, BLOCK, Gradients, Packed};
use pulp::{Simd, WithSimd};

use super::values::{Foot, Values};
use crate::engine::{CornerGradients, Memory, Network};
use crate::objective::Place;

/// A chunk's own memory, kept from epoch to epoch.
pub(super) struct Chunk {
    activations: Activations,
    gradients: Gradients,
    /// What the network is to give, for every sample of a block and every channel.
    wanted: Vec<f32>,
    /// Sum over samples and channels of the squared errors.
    pub(super) loss: f64,
}

impl Chunk {
    pub(super) fn new(packed: &Packed, channels: usize) -> Self {
        Self {
            activations: Activations::new(packed),
            gradients: Gradients::new(packed),
            wanted: vec![0.0; BLOCK * channels],
            loss: 0.0,
        }
    }
}

impl Memory for Chunk {
    fn gradients(&self) -> &Gradients {
        &self.gradients
    }

    fn add(&mut self, other: &Self) {
        self.gradients.add(&other.gradients);
        self.loss += other.loss;
    }
}

/// The work of one chunk, to be dispatched.
pub(super) struct Step<'a> {
    pub(super) network: Network<'a>,
    pub(super) passes: Passes,
    pub(super) values: &'a Values,
    /// 1 / number of samples and channels of the epoch.
    pub(super) share: f32,
    pub(super) chunk: &'a mut Chunk,
    pub(super) places: &'a [Place],
    pub(super) feet: &'a [Foot],
    /// Derivatives of the loss by the features, to be added to.
    pub(super) corners: CornerGradients<'a>,
}

impl WithSimd for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { network, passes, values, share, chunk, places, feet, mut corners } = self;
        let Network { encoding, packed } = network;
        let Chunk { activations, gradients, wanted, loss } = chunk;
        let channels = values.channels.len();
        let (stride, out_stride) = (activations.input_stride(), activations.output_stride());
        let has_features = encoding.dimension() > 0;
        let by_input = if has_features { InputGradient::Wanted } else { InputGradient::Unwanted };
        gradients.clear();
        *loss = 0.0;
        for (places, feet) in places.chunks(BLOCK).zip(feet.chunks(BLOCK)) {
            let rows =
                activations.input_mut().chunks_exact_mut(stride).zip(wanted.chunks_exact_mut(channels));
            for ((place, foot), (row, wanted)) in places.iter().zip(feet).zip(rows) {
                encoding.encode(simd, place.face, place.barycentric, row);
                values.outputs_at(foot, wanted);
            }
            for pass in 0..passes.count {
                passes.set_code(pass, activations.input_mut(), stride);
                forward(simd, packed, activations);
                let first = pass * passes.outputs;
                let outputs = activations.output().chunks_exact(out_stride);
                let deltas = gradients.output_mut().chunks_exact_mut(out_stride);
                let mut sum = 0.0;
                for (s, (delta, output)) in deltas.zip(outputs).enumerate() {
                    let delta = &mut delta[..passes.outputs];
                    if s >= places.len() {
                        delta.fill(0.0);
                        continue;
                    }
                    let wanted = &wanted[s * channels + first..];
                    for ((delta, output), wanted) in delta.iter_mut().zip(output).zip(wanted) {
                        let error = output - wanted;
                        sum += error * error;
                        *delta = 2.0 * share * error;
                    }
                }
                *loss += f64::from(sum);
                backward(simd, packed, activations, gradients, by_input);
                corners.add(places, gradients.input(), stride, |place| place.barycentric);
            }
        }
    }
}
