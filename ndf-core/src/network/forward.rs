//! Values and directional derivatives of a network for a block of samples.

use pulp::Simd;

use super::kernels::{Finish, product};
use super::{BLOCK, Mlp, padded};

/// The parameters of an [`Mlp`] in the layout of the kernels. To be refilled with [`pack`](Self::pack) after
/// every change of the parameters; no allocation after the first time.
#[derive(Clone, Debug)]
pub struct Packed {
    layers: Vec<PackedLayer>,
}

/// One layer, weights in both orders.
#[derive(Clone, Debug)]
pub struct PackedLayer {
    /// Width of the input, without padding.
    pub inputs: usize,
    /// Width of the output, without padding.
    pub outputs: usize,
    /// `inputs × padded(outputs)`: for the way forward.
    by_input: Vec<f32>,
    /// `outputs × padded(inputs)`: for the way back.
    pub(super) by_output: Vec<f32>,
    bias: Vec<f32>,
}

impl Packed {
    /// The parameters of `mlp`, packed.
    pub fn new(mlp: &Mlp) -> Self {
        let layer = |(inputs, outputs): (usize, usize)| PackedLayer {
            inputs,
            outputs,
            by_input: vec![0.0; inputs * padded(outputs)],
            by_output: vec![0.0; outputs * padded(inputs)],
            bias: vec![0.0; padded(outputs)],
        };
        let mut packed = Self { layers: mlp.shape().layers().into_iter().map(layer).collect() };
        packed.pack(mlp.parameters());
        packed
    }

    /// Takes over changed parameters.
    ///
    /// # Panics
    /// If their number differs from that of the network this was made of.
    pub fn pack(&mut self, parameters: &[f32]) {
        let mut rest = parameters;
        for layer in &mut self.layers {
            let (weights, after) = rest.split_at(layer.inputs * layer.outputs);
            let (bias, after) = after.split_at(layer.outputs);
            rest = after;
            layer.bias[..layer.outputs].copy_from_slice(bias);
            let (out_stride, in_stride) = (padded(layer.outputs), padded(layer.inputs));
            for (j, row) in weights.chunks_exact(layer.inputs).enumerate() {
                layer.by_output[j * in_stride..][..layer.inputs].copy_from_slice(row);
                for (i, &w) in row.iter().enumerate() {
                    layer.by_input[i * out_stride + j] = w;
                }
            }
        }
        assert!(rest.is_empty(), "more parameters than the network has");
    }

    /// The layers, from input to output.
    pub fn layers(&self) -> &[PackedLayer] {
        &self.layers
    }
}

/// Everything a block's way through a network leaves behind: the input, every hidden layer after its ReLU,
/// the output. Level `l` is [`BLOCK`] rows of `padded(width of l)`.
#[derive(Clone, Debug)]
pub struct Activations {
    pub(super) levels: Vec<Vec<f32>>,
}

impl Activations {
    /// Room for a block on its way through `packed`.
    pub fn new(packed: &Packed) -> Self {
        let first = packed.layers.first().map_or(0, |l| l.inputs);
        let widths = std::iter::once(first).chain(packed.layers.iter().map(|l| l.outputs));
        Self { levels: widths.map(|w| vec![0.0; BLOCK * padded(w)]).collect() }
    }

    /// Stride of the input rows.
    pub fn input_stride(&self) -> usize {
        self.levels[0].len() / BLOCK
    }

    /// Stride of the output rows.
    pub fn output_stride(&self) -> usize {
        self.output().len() / BLOCK
    }

    /// The rows of input, to be filled. Padding must stay 0.
    pub fn input_mut(&mut self) -> &mut [f32] {
        &mut self.levels[0]
    }

    /// The rows of input.
    pub fn input(&self) -> &[f32] {
        &self.levels[0]
    }

    /// The rows of output.
    pub fn output(&self) -> &[f32] {
        self.levels.last().expect("a network has an output")
    }
}

/// Carries the input of `activations` through the network.
#[inline(always)]
pub fn forward<S: Simd>(simd: S, packed: &Packed, activations: &mut Activations) {
    let last = packed.layers.len() - 1;
    for (l, layer) in packed.layers.iter().enumerate() {
        let (before, after) = activations.levels.split_at_mut(l + 1);
        let (input, output) = (&before[l], &mut after[0]);
        let width = padded(layer.outputs);
        let finish = if l < last { Finish::Relu } else { Finish::Plain };
        let stride = padded(layer.inputs);
        product(simd, input, stride, layer.inputs, &layer.by_input, width, &layer.bias, finish, output);
    }
}

/// Carries a tangent of the input through the derivative of the network at `activations`, which
/// [`forward`] has filled: `tangent` holds the input tangent and receives all others.
#[inline(always)]
pub fn forward_tangent<S: Simd>(
    simd: S,
    packed: &Packed,
    activations: &Activations,
    tangent: &mut Activations,
) {
    let last = packed.layers.len() - 1;
    for (l, layer) in packed.layers.iter().enumerate() {
        let (before, after) = tangent.levels.split_at_mut(l + 1);
        let (input, output) = (&before[l], &mut after[0]);
        let width = padded(layer.outputs);
        let finish = if l < last { Finish::Where(&activations.levels[l + 1]) } else { Finish::Plain };
        let stride = padded(layer.inputs);
        product(simd, input, stride, layer.inputs, &layer.by_input, width, &[], finish, output);
    }
}
