//! Shape and parameters of a multilayer perceptron.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::Activation;

/// Widths of a multilayer perceptron, and what is between its layers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MlpShape {
    /// Width of the input.
    pub inputs: usize,
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// Width of the output.
    pub outputs: usize,
    /// What hidden layers do to their sums.
    pub activation: Activation,
}

impl MlpShape {
    /// All widths from input to output.
    pub fn widths(&self) -> Vec<usize> {
        [&[self.inputs], self.hidden.as_slice(), &[self.outputs]].concat()
    }

    /// `(inputs, outputs)` of every layer.
    pub fn layers(&self) -> Vec<(usize, usize)> {
        self.widths().windows(2).map(|w| (w[0], w[1])).collect()
    }

    /// Number of weights and biases.
    pub fn parameter_count(&self) -> usize {
        self.layers().iter().map(|(i, o)| o * (i + 1)).sum()
    }
}

/// A network was given another number of parameters than its shape asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found} parameters, {expected} expected")]
pub struct ParameterCount {
    /// How many there are.
    pub found: usize,
    /// How many the shape asks for.
    pub expected: usize,
}

/// A multilayer perceptron: `h ← f(W h + b)` for every hidden layer, `W h + b` for the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Mlp {
    shape: MlpShape,
    parameters: Vec<f32>,
}

impl Mlp {
    /// A network of these parameters: for every layer the weights, row-major `outputs × inputs`, then the
    /// biases.
    ///
    /// # Errors
    /// If their number does not fit the shape.
    pub fn new(shape: MlpShape, parameters: Vec<f32>) -> Result<Self, ParameterCount> {
        let (found, expected) = (parameters.len(), shape.parameter_count());
        if found == expected {
            Ok(Self { shape, parameters })
        } else {
            Err(ParameterCount { found, expected })
        }
    }

    /// Kaiming-uniform initialisation for ReLU (He et al. 2015) as PyTorch's `Linear` applies it: weights and
    /// biases uniform in ±1/√inputs.
    pub fn kaiming(shape: MlpShape, rng: &mut ChaCha8Rng) -> Self {
        let mut parameters = Vec::with_capacity(shape.parameter_count());
        for (inputs, outputs) in shape.layers() {
            let bound = (inputs as f32).sqrt().recip();
            parameters.extend((0..outputs * (inputs + 1)).map(|_| rng.random_range(-bound..bound)));
        }
        Self { shape, parameters }
    }

    /// As [`kaiming`](Self::kaiming) with weights uniform in ±√(6/inputs), the gain that keeps the variance
    /// through ReLU, no biases, and a last layer of zeros: the network is 0 at birth.
    pub fn zero_at_birth(shape: MlpShape, rng: &mut ChaCha8Rng) -> Self {
        let mut parameters = Vec::with_capacity(shape.parameter_count());
        let layers = shape.layers();
        for (l, &(inputs, outputs)) in layers.iter().enumerate() {
            let bound = (6.0 / inputs as f32).sqrt();
            let last = l + 1 == layers.len();
            parameters.extend(
                (0..outputs * inputs).map(|_| if last { 0.0 } else { rng.random_range(-bound..bound) }),
            );
            parameters.extend(std::iter::repeat_n(0.0, outputs));
        }
        Self { shape, parameters }
    }

    /// Widths of the layers.
    pub fn shape(&self) -> &MlpShape {
        &self.shape
    }

    /// All parameters, layer by layer: weights row-major `outputs × inputs`, then biases.
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// All parameters, to be changed.
    pub fn parameters_mut(&mut self) -> &mut [f32] {
        &mut self.parameters
    }
}
