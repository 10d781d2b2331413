//! Networks made by hand: a torus as a checkpoint of NeuS and of NeRF, so that both kinds can be tried without a trained
//! one.
//!
//! A layer with ReLU gives |x·d| for many directions d of a plane, and their mean over half a circle is 2/π of the
//! length of x in that plane. One such layer makes the distance r from the axis of x, y and z, a second the length
//! of (r − R, z), which is the distance from the core of the torus.

use std::f64::consts::{FRAC_PI_2, PI};

use super::Tensor;

/// Directions of a plane.
const DIRECTIONS: usize = 120;

/// A torus around the z axis, or, with a ring of 0, a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torus {
    /// Distance of the core from the axis.
    pub ring: f64,
    /// Radius of the tube.
    pub tube: f64,
}

/// Named tensors.
type Checkpoint = Vec<(String, Tensor)>;

/// A layer: rows of weights, and biases.
struct Rows {
    inputs: usize,
    weights: Vec<f32>,
    bias: Vec<f32>,
}

impl Rows {
    fn new(inputs: usize) -> Self {
        Self { inputs, weights: Vec::new(), bias: Vec::new() }
    }

    /// Adds an output: weights of some inputs, zero of the others.
    fn push(&mut self, weights: &[(usize, f64)], bias: f64) {
        let start = self.weights.len();
        self.weights.resize(start + self.inputs, 0.0);
        for &(input, weight) in weights {
            self.weights[start + input] += weight as f32;
        }
        self.bias.push(bias as f32);
    }

    fn outputs(&self) -> usize {
        self.bias.len()
    }
}

impl Torus {
    /// The two hidden layers on an input of which the position comes first, and what makes `scale` times the signed
    /// distance of them, plus `offset`.
    fn layers(self, inputs: usize, scale: f64, offset: f64) -> [Rows; 3] {
        let angles = || (0..DIRECTIONS).map(|k| PI * k as f64 / DIRECTIONS as f64);
        // The mean over the directions times this is the length.
        let mean = FRAC_PI_2 / DIRECTIONS as f64;
        let mut first = Rows::new(inputs);
        for angle in angles() {
            for sign in [1.0, -1.0] {
                first.push(&[(0, sign * angle.cos()), (1, sign * angle.sin())], 0.0);
            }
        }
        // z and −z, of which the activation keeps the positive one.
        first.push(&[(2, 1.0)], 0.0);
        first.push(&[(2, -1.0)], 0.0);
        let radial = 2 * DIRECTIONS;
        let mut second = Rows::new(first.outputs());
        for angle in angles() {
            for sign in [1.0, -1.0] {
                let (along, across) = (sign * angle.cos(), sign * angle.sin());
                let mut weights: Vec<(usize, f64)> = (0..radial).map(|i| (i, along * mean)).collect();
                weights.extend([(radial, across), (radial + 1, -across)]);
                second.push(&weights, -along * self.ring);
            }
        }
        let mut last = Rows::new(second.outputs());
        let weights: Vec<(usize, f64)> = (0..second.outputs()).map(|i| (i, scale * mean)).collect();
        last.push(&weights, offset - scale * self.tube);
        [first, second, last]
    }

    /// A distance in the layout of NeuS, with weight normalisation.
    pub fn as_neus(self) -> Checkpoint {
        let layers = self.layers(3 + 6 * 6, 1.0, 0.0);
        let mut all = Vec::new();
        for (l, rows) in layers.into_iter().enumerate() {
            let norm = |row: &[f32]| row.iter().map(|w| w * w).sum::<f32>().sqrt();
            let norms: Vec<f32> = rows.weights.chunks_exact(rows.inputs).map(norm).collect();
            let (outputs, inputs) = (rows.outputs(), rows.inputs);
            all.push((format!("sdf_network_fine.lin{l}.weight_g"), tensor(vec![outputs, 1], norms)));
            all.push((
                format!("sdf_network_fine.lin{l}.weight_v"),
                tensor(vec![outputs, inputs], rows.weights),
            ));
            all.push((format!("sdf_network_fine.lin{l}.bias"), tensor(vec![outputs], rows.bias)));
        }
        all
    }

    /// A density in the layout of NeRF: 50 at the surface, 500 more for every unit of depth.
    pub fn as_nerf(self) -> Checkpoint {
        let layers = self.layers(3 + 6 * 10, -500.0, 50.0);
        let names = ["pts_linears.0", "pts_linears.1", "alpha_linear"];
        let mut all = Vec::new();
        for (name, rows) in names.into_iter().zip(layers) {
            let (outputs, inputs) = (rows.outputs(), rows.inputs);
            all.push((
                format!("network_fine_state_dict.{name}.weight"),
                tensor(vec![outputs, inputs], rows.weights),
            ));
            all.push((format!("network_fine_state_dict.{name}.bias"), tensor(vec![outputs], rows.bias)));
        }
        all
    }
}

fn tensor(shape: Vec<usize>, values: Vec<f32>) -> Tensor {
    Tensor::new(shape, values).expect("as many values as the shape has")
}
