//! One chunk of an epoch: samples through the network, the squared errors of all channels, and all the way back.

use ndf_model::intrinsic_network::IntrinsicEncoding;
use ndf_model::intrinsic_network::Passes;
use ndf_network::simd::{InputGradient, backward, forward};
use ndf_network::{Activations, BLOCK, Gradients, Packed};
use pulp::{Simd, WithSimd};

use super::values::{Foot, Values};
use crate::batch::Sample;
use crate::step::CornerGradients;

/// A chunk's own memory, kept from epoch to epoch.
pub(super) struct Chunk {
    activations: Activations,
    pub(super) gradients: Gradients,
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

    /// Adds the sums of another chunk.
    pub(super) fn add(&mut self, other: &Self) {
        self.gradients.add(&other.gradients);
        self.loss += other.loss;
    }
}

/// The network as it is in this epoch, and what it is to learn.
#[derive(Clone, Copy)]
pub(super) struct Network<'a> {
    pub(super) encoding: IntrinsicEncoding<'a>,
    pub(super) packed: &'a Packed,
    pub(super) passes: Passes,
    pub(super) values: &'a Values,
}

/// The work of one chunk, to be dispatched.
pub(super) struct Step<'a> {
    pub(super) network: Network<'a>,
    /// 1 / number of samples and channels of the epoch.
    pub(super) share: f32,
    pub(super) chunk: &'a mut Chunk,
    pub(super) samples: &'a [Sample],
    pub(super) feet: &'a [Foot],
    /// The face whose corners come first in `corner_gradients`.
    pub(super) first_face: u32,
    /// Derivatives of the loss by the features of the corners of faces: d floats a corner.
    pub(super) corner_gradients: &'a mut [f32],
}

impl WithSimd for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { network, share, chunk, samples, feet, first_face, corner_gradients } = self;
        let Network { encoding, packed, passes, values } = network;
        let Chunk { activations, gradients, wanted, loss } = chunk;
        let channels = values.channels.len();
        let (stride, out_stride) = (activations.input_stride(), activations.output_stride());
        let dimension = encoding.dimension();
        let by_input = if dimension > 0 { InputGradient::Wanted } else { InputGradient::Unwanted };
        let mut corners = CornerGradients { first_face, by_corner: corner_gradients, encoding };
        corners.by_corner.fill(0.0);
        gradients.clear();
        *loss = 0.0;
        for (samples, feet) in samples.chunks(BLOCK).zip(feet.chunks(BLOCK)) {
            let rows =
                activations.input_mut().chunks_exact_mut(stride).zip(wanted.chunks_exact_mut(channels));
            for ((sample, foot), (row, wanted)) in samples.iter().zip(feet).zip(rows) {
                encoding.encode(simd, sample.face, sample.barycentric, row);
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
                    if s >= samples.len() {
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
                corners.add(samples, gradients.input(), stride, |sample| sample.barycentric);
            }
        }
    }
}
