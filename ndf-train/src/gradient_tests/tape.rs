//! Agreement with the tape of dfdx, in f32.

use dfdx::prelude::*;
use ndf_core::network::{Activation, Mlp};

use super::{
    Epoch, FEATURES, HIDDEN, LAMBDA_C, LAMBDA_P, OCTAVES, PHI_INPUTS, REVERSE_OCTAVES, SAMPLES, THETA_INPUTS,
    VERTICES, epoch, relative_error,
};
use crate::batch::Sample;
use crate::settings::ReverseMap;

const WEIGHTS: super::Weights = [LAMBDA_P, 0.0, 0.0, 0.0, 0.0];

type Matrix<const M: usize, const N: usize, T = NoneTape> = Tensor<Rank2<M, N>, f32, Cpu, T>;
type Taped = OwnedTape<f32, Cpu>;

/// A network as dfdx's tensors: the first layer's weights in blocks of columns, as its inputs are blocks.
struct Network<const INPUTS: usize> {
    first: Matrix<INPUTS, HIDDEN>,
    second: Matrix<HIDDEN, HIDDEN>,
    third: Matrix<HIDDEN, 3>,
    biases: (Matrix<1, HIDDEN>, Matrix<1, HIDDEN>, Matrix<1, 3>),
}

/// Rows become columns.
fn transposed(a: &[f32], columns: usize) -> Vec<f32> {
    (0..columns).flat_map(|j| a.iter().skip(j).step_by(columns).copied()).collect()
}

impl<const INPUTS: usize> Network<INPUTS> {
    fn new(device: &Cpu, mlp: &Mlp) -> Self {
        let mut rest = mlp.parameters();
        let mut take = |n: usize| {
            let (head, tail) = rest.split_at(n);
            rest = tail;
            head.to_vec()
        };
        let (w1, b1) = (take(HIDDEN * INPUTS), take(HIDDEN));
        let (w2, b2) = (take(HIDDEN * HIDDEN), take(HIDDEN));
        let (w3, b3) = (take(3 * HIDDEN), take(3));
        Self {
            first: device.tensor(transposed(&w1, INPUTS)),
            second: device.tensor(transposed(&w2, HIDDEN)),
            third: device.tensor(transposed(&w3, HIDDEN)),
            biases: (device.tensor(b1), device.tensor(b2), device.tensor(b3)),
        }
    }

    /// The network of inputs that come in blocks of columns, each with the first of its rows of weights.
    fn apply(
        &self,
        ones: &Matrix<SAMPLES, 1>,
        first: Matrix<SAMPLES, HIDDEN, Taped>,
    ) -> Matrix<SAMPLES, 3, Taped> {
        let h = (first + ones.leaky_trace().matmul(self.biases.0.leaky_trace())).relu();
        let h = h.matmul(self.second.leaky_trace()) + ones.leaky_trace().matmul(self.biases.1.leaky_trace());
        h.relu().matmul(self.third.leaky_trace()) + ones.leaky_trace().matmul(self.biases.2.leaky_trace())
    }

    /// Gradients in the order of the parameters.
    fn gradients(&self, g: &Gradients<f32, Cpu>) -> Vec<f64> {
        let parts = [
            transposed(&g.get(&self.first).as_vec(), HIDDEN),
            g.get(&self.biases.0).as_vec(),
            transposed(&g.get(&self.second).as_vec(), HIDDEN),
            g.get(&self.biases.1).as_vec(),
            transposed(&g.get(&self.third).as_vec(), 3),
            g.get(&self.biases.2).as_vec(),
        ];
        parts.concat().into_iter().map(f64::from).collect()
    }
}

/// The encoding of `x` as dfdx writes it, times the rows of `weights` from `row` on.
fn encoded<const INPUTS: usize>(
    x: &Matrix<SAMPLES, 3, Taped>,
    octaves: usize,
    weights: &Matrix<INPUTS, HIDDEN>,
    row: usize,
) -> Matrix<SAMPLES, HIDDEN, Taped> {
    let device = x.device().clone();
    let rows = |first: usize| -> Matrix<3, HIDDEN, Taped> {
        weights.leaky_trace().gather(device.tensor([first, first + 1, first + 2]))
    };
    let mut sum = x.with_empty_tape().matmul(rows(row));
    for k in 0..octaves {
        let t = x.with_empty_tape() * (std::f32::consts::PI * (1 << k) as f32);
        let (sin, cos) = (t.with_empty_tape().sin(), t.cos());
        sum = sum + sin.matmul(rows(row + 3 + 3 * k));
        sum = sum + cos.matmul(rows(row + 3 + 3 * octaves + 3 * k));
    }
    sum
}

#[test]
fn gradients_agree_with_the_tape_of_dfdx() {
    let e: Epoch = epoch(WEIGHTS, ReverseMap::Residual, Activation::Relu);
    let device: Cpu = Cpu::default();
    let theta = Network::<THETA_INPUTS>::new(&device, &e.theta);
    let phi = Network::<PHI_INPUTS>::new(&device, e.phi.as_ref().expect("the residual map has a network"));
    let features: Matrix<VERTICES, FEATURES> = device.tensor(e.features.clone());
    let ones: Matrix<SAMPLES, 1> = device.ones();

    let mut z: Option<Matrix<SAMPLES, FEATURES, Taped>> = None;
    let mut x = vec![0.0; 3 * SAMPLES];
    for c in 0..3 {
        let corner = |s: &Sample| e.faces[s.face as usize][c] as usize;
        let indices: [usize; SAMPLES] = std::array::from_fn(|s| corner(&e.samples[s]));
        let barycentric: Vec<f32> = e.samples.iter().map(|s| s.barycentric[c]).collect();
        let b = barycentric.iter().flat_map(|&b| [b; FEATURES]).collect::<Vec<_>>();
        let b: Matrix<SAMPLES, FEATURES> = device.tensor(b);
        let corner_features: Matrix<SAMPLES, FEATURES, Taped> =
            features.leaky_trace().gather(device.tensor(indices));
        let part = corner_features * b;
        z = Some(match z {
            None => part,
            Some(sum) => sum + part,
        });
        for (s, v) in indices.iter().enumerate() {
            for k in 0..3 {
                x[3 * s + k] += barycentric[s] * e.positions[*v][k];
            }
        }
    }
    let z = z.expect("a face has corners");
    let x: Matrix<SAMPLES, 3> = device.tensor(x);

    let first_rows: [usize; FEATURES] = std::array::from_fn(|k| k);
    let of_z: Matrix<FEATURES, HIDDEN, Taped> = theta.first.leaky_trace().gather(device.tensor(first_rows));
    let first = z.matmul(of_z) + encoded(&x.leaky_trace(), OCTAVES, &theta.first, FEATURES);
    let y = theta.apply(&ones, first) + x.clone();
    let first = encoded(&y, REVERSE_OCTAVES, &phi.first, 0);
    let back = phi.apply(&ones, first) + y.with_empty_tape();

    let foot: Matrix<SAMPLES, 3> = device.tensor(e.targets.iter().flat_map(|t| t.foot).collect::<Vec<_>>());
    let normal: Matrix<SAMPLES, 3> =
        device.tensor(e.targets.iter().flat_map(|t| t.normal).collect::<Vec<_>>());
    let height = ((y - foot) * normal).sum::<Rank1<SAMPLES>, _>();
    let projection = height.square().sum::<Rank0, _>() * (LAMBDA_P / SAMPLES as f32);
    let cycle = (back - x).square().sum::<Rank0, _>() * (LAMBDA_C / SAMPLES as f32);
    let total = projection + cycle;
    assert!((f64::from(total.array()) - e.loss).abs() < 1e-5 * e.loss);
    let g = total.backward();

    let by_features: Vec<f64> = g.get(&features).as_vec().into_iter().map(f64::from).collect();
    for (name, found, truth) in [
        ("features", &e.by_features, by_features),
        ("theta", &e.by_theta, theta.gradients(&g)),
        ("phi", &e.by_phi, phi.gradients(&g)),
    ] {
        let error = relative_error(found, &truth);
        assert!(error < 1e-4, "{name}: {error:.1e}");
    }
}
