//! Gradients of a network's parameters and inputs for a block of samples, by reverse accumulation.

use pulp::Simd;

use super::kernels::{Finish, add_row_sums, add_transposed_product, product};
use super::{Activations, Lines, Packed, padded};

/// Gradients by all parameters of a network, in the layout of the kernels, and room for the deltas of a
/// block. Gradients accumulate over blocks until [`clear`](Self::clear).
#[derive(Clone, Debug)]
pub struct Gradients {
    layers: Vec<LayerGradients>,
    /// Per level the derivative of the loss by its sums, [`BLOCK`](super::BLOCK) padded rows.
    deltas: Vec<Lines>,
    /// Per hidden layer with a smooth activation, the derivative of the loss by its sums through the tangents, which
    /// [`backward_tangent`] leaves to [`backward`].
    through_slopes: Vec<Lines>,
}

/// Gradients by the parameters of a layer.
#[derive(Clone, Debug)]
struct LayerGradients {
    inputs: usize,
    outputs: usize,
    /// `inputs × padded(outputs)` or `outputs × padded(inputs)`, whichever is smaller.
    weights: Lines,
    /// `padded(outputs)`.
    biases: Lines,
}

impl LayerGradients {
    fn new(inputs: usize, outputs: usize) -> Self {
        let size = (inputs * padded(outputs)).min(outputs * padded(inputs));
        Self { inputs, outputs, weights: Lines::zeros(size), biases: Lines::zeros(padded(outputs)) }
    }

    /// Whether the weights have a row for every input.
    fn is_by_input(&self) -> bool {
        self.inputs * padded(self.outputs) < self.outputs * padded(self.inputs)
    }

    /// Adds the products of the inputs of a block with the derivatives by the outputs.
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, level: &[f32], delta: &[f32]) {
        let (in_width, out_width) = (padded(self.inputs), padded(self.outputs));
        if self.is_by_input() {
            add_transposed_product(simd, level, in_width, self.inputs, delta, out_width, &mut self.weights);
        } else {
            add_transposed_product(simd, delta, out_width, self.outputs, level, in_width, &mut self.weights);
        }
    }

    /// Adds the gradients to `weights`, row-major `outputs × inputs`, and `biases`.
    fn add_to(&self, weights: &mut [f32], biases: &mut [f32]) {
        if self.is_by_input() {
            for (i, row) in self.weights.chunks_exact(padded(self.outputs)).enumerate() {
                let column = weights[i..].iter_mut().step_by(self.inputs);
                column.zip(row).for_each(|(to, from)| *to += from);
            }
        } else {
            let rows = self.weights.chunks_exact(padded(self.inputs));
            for (to, from) in weights.chunks_exact_mut(self.inputs).zip(rows) {
                to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
            }
        }
        biases.iter_mut().zip(&*self.biases).for_each(|(to, from)| *to += from);
    }
}

impl Gradients {
    /// Zero gradients for the network of `packed`.
    pub fn new(packed: &Packed) -> Self {
        let room = Activations::new(packed);
        Self {
            layers: packed.layers().iter().map(|l| LayerGradients::new(l.inputs, l.outputs)).collect(),
            deltas: room.levels,
            through_slopes: room.hidden.into_iter().map(|hidden| hidden.sums).collect(),
        }
    }

    /// Sets all gradients to zero.
    pub fn clear(&mut self) {
        for layer in &mut self.layers {
            layer.weights.fill(0.0);
            layer.biases.fill(0.0);
        }
    }

    /// Adds those of another block or chunk.
    pub fn add(&mut self, other: &Self) {
        for (layer, other) in self.layers.iter_mut().zip(&other.layers) {
            layer.weights.iter_mut().zip(&*other.weights).for_each(|(to, from)| *to += from);
            layer.biases.iter_mut().zip(&*other.biases).for_each(|(to, from)| *to += from);
        }
    }

    /// Rows of the derivative of the loss by the network's output, to be filled before [`backward`]. Padding
    /// and rows without a sample must be 0.
    pub fn output_mut(&mut self) -> &mut [f32] {
        self.deltas.last_mut().expect("a network has an output")
    }

    /// Rows of the derivative of the loss by the network's input, after [`backward`].
    pub fn input(&self) -> &[f32] {
        &self.deltas[0]
    }

    /// The same rows, to be added to.
    pub fn input_mut(&mut self) -> &mut [f32] {
        &mut self.deltas[0]
    }

    /// Adds the gradients to `sums`, in the order of [`Mlp::parameters`](super::Mlp::parameters).
    pub fn add_to(&self, sums: &mut [f32]) {
        let mut rest = sums;
        for layer in &self.layers {
            let (weights, after) = rest.split_at_mut(layer.inputs * layer.outputs);
            let (biases, after) = after.split_at_mut(layer.outputs);
            rest = after;
            layer.add_to(weights, biases);
        }
    }
}

/// Which part of the input's derivative is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputGradient {
    /// None: the last product is left out.
    Unwanted,
    /// All of it.
    Wanted,
}

/// Carries the derivative by the output, which lies in `gradients`, back through the network at `activations`,
/// which [`forward`](super::forward::forward) has filled; adds to the gradients of the parameters. Where tangents have
/// gradients too, theirs come first: see [`backward_tangent`].
#[inline(always)]
pub fn backward<S: Simd>(
    simd: S,
    packed: &Packed,
    activations: &Activations,
    gradients: &mut Gradients,
    input: InputGradient,
) {
    for (l, layer) in packed.layers().iter().enumerate().rev() {
        let (before, after) = gradients.deltas.split_at_mut(l + 1);
        let (delta_in, delta_out) = (&mut before[l], &after[0]);
        gradients.layers[l].add(simd, &activations.levels[l], delta_out);
        add_row_sums(simd, delta_out, &mut gradients.layers[l].biases);
        if l == 0 && input == InputGradient::Unwanted {
            break;
        }
        let finish = match packed.activation().negative_slope() {
            _ if l == 0 => Finish::Plain,
            Some(below) => Finish::Where { signs: &activations.levels[l], below },
            None => Finish::Times(&activations.hidden[l - 1].slopes),
        };
        product(simd, delta_out, padded(layer.outputs), &layer.by_output, &[], finish, delta_in);
        if l > 0 && !gradients.through_slopes.is_empty() {
            let through_slopes = &mut gradients.through_slopes[l - 1];
            delta_in.iter_mut().zip(&**through_slopes).for_each(|(delta, more)| *delta += more);
            through_slopes.fill(0.0);
        }
    }
}

/// Carries the derivative by an output tangent, which lies in `gradients`, back through the tangent map of the network
/// at `activations`; `tangent` is what [`forward_tangent`](super::forward::forward_tangent) has filled.
///
/// A tangent depends on the values through the slopes of the activations. Between the kinks of one that is linear on
/// both sides of 0 that is not at all; for others this part waits in `gradients` for [`backward`], which must be called
/// afterwards.
#[inline(always)]
pub fn backward_tangent<S: Simd>(
    simd: S,
    packed: &Packed,
    activations: &Activations,
    tangent: &Activations,
    gradients: &mut Gradients,
    input: InputGradient,
) {
    for (l, layer) in packed.layers().iter().enumerate().rev() {
        let (before, after) = gradients.deltas.split_at_mut(l + 1);
        let (delta_in, delta_out) = (&mut before[l], &after[0]);
        gradients.layers[l].add(simd, &tangent.levels[l], delta_out);
        if l == 0 && input == InputGradient::Unwanted {
            break;
        }
        let finish = match packed.activation().negative_slope() {
            Some(below) if l > 0 => Finish::Where { signs: &activations.levels[l], below },
            _ => Finish::Plain,
        };
        product(simd, delta_out, padded(layer.outputs), &layer.by_output, &[], finish, delta_in);
        if l > 0 && !gradients.through_slopes.is_empty() {
            // The tangent after the activation is f′(sum) · (tangent of the sum).
            let (at, along) = (&activations.hidden[l - 1], &tangent.hidden[l - 1].sums);
            let derivatives = at.slopes.iter().zip(&*at.curvatures).zip(&**along);
            let through_slopes = gradients.through_slopes[l - 1].iter_mut();
            for ((delta, more), ((slope, curvature), along)) in
                delta_in.iter_mut().zip(through_slopes).zip(derivatives)
            {
                *more += *delta * curvature * along;
                *delta *= slope;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::BLOCK;
    use super::super::forward::{forward, forward_tangent};
    use super::super::{Activation, Mlp, MlpShape};
    use super::*;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    /// The network in f64, by the definition.
    fn reference(shape: &MlpShape, parameters: &[f64], input: &[f64]) -> Vec<f64> {
        let mut h = input.to_vec();
        let mut rest = parameters;
        let layers = shape.layers();
        for (l, &(inputs, outputs)) in layers.iter().enumerate() {
            let (weights, after) = rest.split_at(inputs * outputs);
            let (bias, after) = after.split_at(outputs);
            rest = after;
            h = (0..outputs)
                .map(|j| {
                    let y = bias[j] + (0..inputs).map(|i| weights[j * inputs + i] * h[i]).sum::<f64>();
                    if l + 1 < layers.len() { y.max(0.0) } else { y }
                })
                .collect();
        }
        h
    }

    struct Run<'a> {
        packed: &'a Packed,
        activations: &'a mut Activations,
        tangent: &'a mut Activations,
        gradients: &'a mut Gradients,
    }

    impl pulp::WithSimd for Run<'_> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            forward(simd, self.packed, self.activations);
            forward_tangent(simd, self.packed, self.activations, self.tangent);
            backward(simd, self.packed, self.activations, self.gradients, InputGradient::Wanted);
        }
    }

    #[test]
    fn value_tangent_and_gradients_agree_with_finite_differences() {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        for hidden in [vec![32, 32], vec![20], vec![48, 16, 24]] {
            let shape = MlpShape { inputs: 11, hidden, outputs: 3, activation: Activation::Relu };
            let mlp = Mlp::kaiming(shape.clone(), &mut rng);
            let packed = Packed::new(&mlp);
            let mut activations = Activations::new(&packed);
            let mut tangent = Activations::new(&packed);
            let mut gradients = Gradients::new(&packed);
            let (in_stride, out_stride) = (activations.input_stride(), activations.output_stride());
            for s in 0..BLOCK {
                for i in 0..shape.inputs {
                    activations.input_mut()[s * in_stride + i] = rng.random_range(-1.0..1.0);
                    tangent.input_mut()[s * in_stride + i] = rng.random_range(-1.0..1.0);
                }
                for j in 0..shape.outputs {
                    gradients.output_mut()[s * out_stride + j] = rng.random_range(-1.0..1.0);
                }
            }
            pulp::Arch::new().dispatch(Run {
                packed: &packed,
                activations: &mut activations,
                tangent: &mut tangent,
                gradients: &mut gradients,
            });

            let wide = |x: &[f32]| x.iter().map(|&v| f64::from(v)).collect::<Vec<_>>();
            let parameters = wide(mlp.parameters());
            let row = |s: usize| wide(&activations.levels[0][s * in_stride..][..shape.inputs]);
            let weight = |s: usize| wide(&gradients.deltas[shape.layers().len()][s * out_stride..][..3]);
            let loss = |parameters: &[f64], s: usize, input: &[f64]| -> f64 {
                reference(&shape, parameters, input).iter().zip(weight(s)).map(|(y, w)| y * w).sum()
            };
            let h = 1e-6;
            for s in 0..BLOCK {
                let value = reference(&shape, &parameters, &row(s));
                let direction = wide(&tangent.levels[0][s * in_stride..][..shape.inputs]);
                let along = |h: f64| -> Vec<f64> {
                    let moved: Vec<f64> = row(s).iter().zip(&direction).map(|(x, d)| x + h * d).collect();
                    reference(&shape, &parameters, &moved)
                };
                let (up, down) = (along(h), along(-h));
                for j in 0..3 {
                    assert!((f64::from(activations.output()[s * out_stride + j]) - value[j]).abs() < 1e-5);
                    let slope = (up[j] - down[j]) / (2.0 * h);
                    assert!((f64::from(tangent.output()[s * out_stride + j]) - slope).abs() < 1e-4);
                }
                for i in 0..shape.inputs {
                    let at = |h: f64| {
                        let mut x = row(s);
                        x[i] += h;
                        loss(&parameters, s, &x)
                    };
                    let slope = (at(h) - at(-h)) / (2.0 * h);
                    assert!((f64::from(gradients.input()[s * in_stride + i]) - slope).abs() < 1e-4);
                }
            }
            let mut sums = vec![0.0; mlp.parameters().len()];
            gradients.add_to(&mut sums);
            for p in (0..parameters.len()).step_by(7) {
                let at = |h: f64| {
                    let mut moved = parameters.clone();
                    moved[p] += h;
                    (0..BLOCK).map(|s| loss(&moved, s, &row(s))).sum::<f64>()
                };
                let slope = (at(h) - at(-h)) / (2.0 * h);
                assert!((f64::from(sums[p]) - slope).abs() < 1e-3 * slope.abs().max(1.0), "parameter {p}");
            }
        }
    }
}
