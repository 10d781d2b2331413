//! Gradients of a network's parameters and inputs for a block of samples, by reverse accumulation.

use pulp::Simd;

use super::kernels::{Finish, add_row_sums, add_transposed_product, product};
use super::{Activations, BLOCK, Packed, padded};

/// Gradients by all parameters of a network, in the layout of the kernels, and room for the deltas of a
/// block. Gradients accumulate over blocks until [`clear`](Self::clear).
#[derive(Clone, Debug)]
pub struct Gradients {
    /// Per layer `outputs × padded(inputs)`.
    weights: Vec<Vec<f32>>,
    /// Per layer `padded(outputs)`.
    biases: Vec<Vec<f32>>,
    /// Per level the derivative of the loss by its pre-activations, [`BLOCK`] padded rows.
    deltas: Vec<Vec<f32>>,
    shapes: Vec<(usize, usize)>,
}

impl Gradients {
    /// Zero gradients for the network of `packed`.
    pub fn new(packed: &Packed) -> Self {
        let layers = packed.layers();
        Self {
            weights: layers.iter().map(|l| vec![0.0; l.outputs * padded(l.inputs)]).collect(),
            biases: layers.iter().map(|l| vec![0.0; padded(l.outputs)]).collect(),
            deltas: Activations::new(packed).levels,
            shapes: layers.iter().map(|l| (l.inputs, l.outputs)).collect(),
        }
    }

    /// Sets all gradients to zero.
    pub fn clear(&mut self) {
        self.weights.iter_mut().chain(&mut self.biases).for_each(|g| g.fill(0.0));
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

    /// Adds the gradients to `sums`, in the order of [`Mlp::parameters`](super::Mlp::parameters).
    pub fn add_to(&self, sums: &mut [f32]) {
        let mut rest = sums;
        for ((&(inputs, outputs), weights), biases) in self.shapes.iter().zip(&self.weights).zip(&self.biases)
        {
            let (to_weights, after) = rest.split_at_mut(inputs * outputs);
            let (to_biases, after) = after.split_at_mut(outputs);
            rest = after;
            for (to, from) in to_weights.chunks_exact_mut(inputs).zip(weights.chunks_exact(padded(inputs))) {
                to.iter_mut().zip(from).for_each(|(t, f)| *t += f);
            }
            to_biases.iter_mut().zip(biases).for_each(|(t, f)| *t += f);
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
/// which [`forward`](super::forward()) has filled; adds to the gradients of the parameters.
#[inline(always)]
pub fn backward<S: Simd>(
    simd: S,
    packed: &Packed,
    activations: &Activations,
    gradients: &mut Gradients,
    input: InputGradient,
) {
    reverse(simd, packed, activations, activations, gradients, input);
    for (delta, biases) in gradients.deltas[1..].iter().zip(&mut gradients.biases) {
        add_row_sums(simd, delta, biases);
    }
}

/// Carries the derivative by an output tangent, which lies in `gradients`, back through the tangent map of the network
/// at `activations`; `tangent` is what [`forward_tangent`](super::forward_tangent) has filled. A tangent does not
/// depend on biases, and on the values only through the signs of the ReLUs, hence not at all between kinks.
#[inline(always)]
pub fn backward_tangent<S: Simd>(
    simd: S,
    packed: &Packed,
    activations: &Activations,
    tangent: &Activations,
    gradients: &mut Gradients,
    input: InputGradient,
) {
    reverse(simd, packed, activations, tangent, gradients, input);
}

/// The way back through a chain of matrices and masks: `levels` are what was multiplied on the way forward, `signs`
/// hold the masks.
#[inline(always)]
fn reverse<S: Simd>(
    simd: S,
    packed: &Packed,
    signs: &Activations,
    levels: &Activations,
    gradients: &mut Gradients,
    input: InputGradient,
) {
    for (l, layer) in packed.layers().iter().enumerate().rev() {
        let (before, after) = gradients.deltas.split_at_mut(l + 1);
        let (delta_in, delta_out) = (&mut before[l], &after[0]);
        let (in_width, out_width) = (padded(layer.inputs), padded(layer.outputs));
        let level = &levels.levels[l];
        let weights = &mut gradients.weights[l];
        add_transposed_product(simd, delta_out, out_width, layer.outputs, level, in_width, weights);
        if l == 0 && input == InputGradient::Unwanted {
            break;
        }
        debug_assert_eq!(level.len(), BLOCK * in_width);
        let finish = if l > 0 { Finish::Where(&signs.levels[l]) } else { Finish::Plain };
        product(simd, delta_out, out_width, layer.outputs, &layer.by_output, in_width, &[], finish, delta_in);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Mlp, MlpShape, forward, forward_tangent};
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
            let shape = MlpShape { inputs: 11, hidden, outputs: 3 };
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
