//! Values and directional derivatives of a network for a block of samples.

use pulp::{Simd, WithSimd};

use super::activation::Jet;
use super::kernels::{Finish, Panels, product};
use super::{Activation, BLOCK, Lines, Mlp, padded};

/// The parameters of an [`Mlp`] in the layout of the kernels. To be refilled with [`pack`](Self::pack) after
/// every change of the parameters; no allocation after the first time.
#[derive(Clone, Debug)]
pub struct Packed {
    layers: Vec<PackedLayer>,
    activation: Activation,
}

/// One layer, weights in both orders.
#[derive(Clone, Debug)]
pub struct PackedLayer {
    /// Width of the input, without padding.
    pub inputs: usize,
    /// Width of the output, without padding.
    pub outputs: usize,
    /// `inputs × padded(outputs)`: for the way forward.
    by_input: Panels,
    /// `outputs × padded(inputs)`: for the way back.
    pub(super) by_output: Panels,
    bias: Lines,
}

impl Packed {
    /// The parameters of `mlp`, packed.
    pub fn new(mlp: &Mlp) -> Self {
        let layer = |(inputs, outputs): (usize, usize)| PackedLayer {
            inputs,
            outputs,
            by_input: Panels::new(inputs, padded(outputs)),
            by_output: Panels::new(outputs, padded(inputs)),
            bias: Lines::zeros(padded(outputs)),
        };
        let shape = mlp.shape();
        let layers = shape.layers().into_iter().map(layer).collect();
        let mut packed = Self { layers, activation: shape.activation };
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
            for (j, row) in weights.chunks_exact(layer.inputs).enumerate() {
                layer.by_output.set_row(j, row);
                layer.by_input.set_column(j, row);
            }
        }
        assert!(rest.is_empty(), "more parameters than the network has");
    }

    /// The layers, from input to output.
    pub fn layers(&self) -> &[PackedLayer] {
        &self.layers
    }

    /// What hidden layers do to their sums.
    pub fn activation(&self) -> Activation {
        self.activation
    }
}

/// Everything a block's way through a network leaves behind: the input, every hidden layer after its activation, the
/// output. Level `l` is [`BLOCK`] rows of `padded(width of l)`.
#[derive(Clone, Debug)]
pub struct Activations {
    pub(super) levels: Vec<Lines>,
    /// Of every hidden layer, what its activation was given and what it made of it; empty for activations that are
    /// linear on both sides of 0, which need no memory of it.
    pub(super) hidden: Vec<Hidden>,
}

/// What a smooth activation leaves behind.
#[derive(Clone, Debug)]
pub(super) struct Hidden {
    /// The sums W h + b, or their derivative in the direction of a tangent.
    pub(super) sums: Lines,
    /// The activation's slopes there.
    pub(super) slopes: Lines,
    /// The activation's second derivatives there.
    pub(super) curvatures: Lines,
}

impl Activations {
    /// Room for a block on its way through `packed`.
    pub fn new(packed: &Packed) -> Self {
        let zeros = |width| Lines::zeros(BLOCK * padded(width));
        let first = packed.layers.first().map_or(0, |l| l.inputs);
        let widths = std::iter::once(first).chain(packed.layers.iter().map(|l| l.outputs));
        let hidden = match (packed.activation.negative_slope(), packed.layers.split_last()) {
            (None, Some((_, hidden))) => {
                let room = |l: &PackedLayer| Hidden {
                    sums: zeros(l.outputs),
                    slopes: zeros(l.outputs),
                    curvatures: zeros(l.outputs),
                };
                hidden.iter().map(room).collect()
            }
            _ => Vec::new(),
        };
        Self { levels: widths.map(zeros).collect(), hidden }
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
        let (stride, weights, bias) = (padded(layer.inputs), &layer.by_input, &layer.bias);
        match packed.activation.negative_slope() {
            _ if l == last => product(simd, input, stride, weights, bias, Finish::Plain, output),
            Some(below) => product(simd, input, stride, weights, bias, Finish::Rectify(below), output),
            None => {
                let hidden = &mut activations.hidden[l];
                product(simd, input, stride, weights, bias, Finish::Plain, &mut hidden.sums);
                hidden.activate(packed.activation, output);
            }
        }
    }
}

impl Hidden {
    /// Applies the activation to the sums and remembers its derivatives. Padding stays finite, and no weight meets it.
    #[inline(always)]
    fn activate(&mut self, activation: Activation, output: &mut [f32]) {
        // One loop for each kind, so that each becomes vectors.
        match activation {
            Activation::Silu => self.activate_by(|x| Activation::Silu.jet(x), output),
            Activation::Sine => self.activate_by(|x| Activation::Sine.jet(x), output),
            Activation::Tanh => self.activate_by(|x| Activation::Tanh.jet(x), output),
            linear @ (Activation::Relu | Activation::LeakyRelu) => {
                self.activate_by(|x| linear.jet(x), output);
            }
        }
    }

    #[inline(always)]
    fn activate_by(&mut self, jet: impl Fn(f32) -> Jet, output: &mut [f32]) {
        let derivatives = self.slopes.iter_mut().zip(&mut *self.curvatures);
        for ((y, x), (slope, curvature)) in output.iter_mut().zip(&*self.sums).zip(derivatives) {
            let jet = jet(*x);
            (*y, *slope, *curvature) = (jet.value, jet.slope, jet.curvature);
        }
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
        let (stride, weights) = (padded(layer.inputs), &layer.by_input);
        match packed.activation.negative_slope() {
            _ if l == last => product(simd, input, stride, weights, &[], Finish::Plain, output),
            Some(below) => {
                let finish = Finish::Where { signs: &activations.levels[l + 1], below };
                product(simd, input, stride, weights, &[], finish, output);
            }
            None => {
                let sums = &mut tangent.hidden[l].sums;
                product(simd, input, stride, weights, &[], Finish::Plain, sums);
                let slopes = &activations.hidden[l].slopes;
                output.iter_mut().zip(&**sums).zip(&**slopes).for_each(|((y, x), slope)| *y = *x * slope);
            }
        }
    }
}

impl Mlp {
    /// The outputs for rows of input, one row a sample, on one thread. Many calls with the same parameters are cheaper
    /// through [`Packed`], which this makes anew.
    ///
    /// # Panics
    /// If the network has no inputs, or `rows` is not made of whole rows.
    pub fn evaluate(&self, rows: &[f32]) -> Vec<f32> {
        let (inputs, outputs) = (self.shape().inputs, self.shape().outputs);
        assert!(inputs > 0 && rows.len().is_multiple_of(inputs), "rows of {inputs} numbers");
        let packed = Packed::new(self);
        let mut activations = Activations::new(&packed);
        let mut found = Vec::with_capacity(rows.len() / inputs * outputs);
        for rows in rows.chunks(BLOCK * inputs) {
            let stride = activations.input_stride();
            for (to, row) in activations.input_mut().chunks_exact_mut(stride).zip(rows.chunks_exact(inputs)) {
                to[..inputs].copy_from_slice(row);
            }
            pulp::Arch::new().dispatch(Forward { packed: &packed, activations: &mut activations });
            let results = activations.output().chunks_exact(activations.output_stride());
            found.extend(results.take(rows.len() / inputs).flat_map(|row| &row[..outputs]));
        }
        found
    }
}

/// A block's way through a network, to be dispatched.
struct Forward<'a> {
    packed: &'a Packed,
    activations: &'a mut Activations,
}

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        forward(simd, self.packed, self.activations);
    }
}
