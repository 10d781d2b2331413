//! Agreement with the tape of dfdx, in f32.

use ::dfdx::prelude::*;
use ndf_core::glam::Vec3;
use ndf_network::{Activation, Mlp};

use super::{
    Case, FEATURES, HIDDEN, LAMBDA_C, LAMBDA_P, OCTAVES, PHI_INPUTS, REVERSE_OCTAVES, SAMPLES, THETA_INPUTS,
    VERTICES, Weights, case, relative_error,
};
use crate::objective::{Place, Target};
use crate::settings::ReverseMap;

type Matrix<const M: usize, const N: usize, T = NoneTape> = Tensor<Rank2<M, N>, f32, Cpu, T>;
type Taped = OwnedTape<f32, Cpu>;

/// A network as dfdx's tensors: the first layer's weights in blocks of columns, as its inputs are blocks.
struct Network<const INPUTS: usize> {
    first: Matrix<INPUTS, HIDDEN>,
    second: Matrix<HIDDEN, HIDDEN>,
    third: Matrix<HIDDEN, 3>,
    biases: (Matrix<1, HIDDEN>, Matrix<1, HIDDEN>, Matrix<1, 3>),
}

/// A network's output, and 1 where a hidden unit is above zero, 0 where it is not: the slopes of ReLU.
struct Applied {
    output: Matrix<SAMPLES, 3, Taped>,
    sides: [Matrix<SAMPLES, HIDDEN>; 2],
}

fn sides(sums: &Matrix<SAMPLES, HIDDEN, Taped>) -> Matrix<SAMPLES, HIDDEN> {
    let of = |x: f32| if x > 0.0 { 1.0 } else { 0.0 };
    sums.device().tensor(sums.as_vec().into_iter().map(of).collect::<Vec<f32>>())
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

    /// The network, from the sums of the first layer without its biases. Inputs come in blocks of columns, each with
    /// rows of the weights of its own.
    fn apply(&self, ones: &Matrix<SAMPLES, 1>, first: Matrix<SAMPLES, HIDDEN, Taped>) -> Applied {
        let bias = |b: &Matrix<1, HIDDEN>| ones.leaky_trace().matmul(b.leaky_trace());
        let sums = first + bias(&self.biases.0);
        let of_first = sides(&sums);
        let sums = sums.relu().matmul(self.second.leaky_trace()) + bias(&self.biases.1);
        let of_second = sides(&sums);
        let last = ones.leaky_trace().matmul(self.biases.2.leaky_trace());
        Applied { output: sums.relu().matmul(self.third.leaky_trace()) + last, sides: [of_first, of_second] }
    }

    /// The derivative of the network in a direction, from that of the sums of the first layer.
    fn apply_tangent(
        &self,
        [of_first, of_second]: &[Matrix<SAMPLES, HIDDEN>; 2],
        first: Matrix<SAMPLES, HIDDEN, Taped>,
    ) -> Matrix<SAMPLES, 3, Taped> {
        let t = (first * of_first.clone()).matmul(self.second.leaky_trace());
        (t * of_second.clone()).matmul(self.third.leaky_trace())
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

/// Three rows of the weights of a first layer.
fn rows<const INPUTS: usize>(weights: &Matrix<INPUTS, HIDDEN>, first: usize) -> Matrix<3, HIDDEN, Taped> {
    weights.leaky_trace().gather(weights.device().tensor([first, first + 1, first + 2]))
}

/// The encoding of `x` as dfdx writes it, times the rows of `weights` from `row` on.
fn encoded<const INPUTS: usize>(
    x: &Matrix<SAMPLES, 3, Taped>,
    octaves: usize,
    weights: &Matrix<INPUTS, HIDDEN>,
    row: usize,
) -> Matrix<SAMPLES, HIDDEN, Taped> {
    let mut sum = x.with_empty_tape().matmul(rows(weights, row));
    for k in 0..octaves {
        let t = x.with_empty_tape() * (std::f32::consts::PI * (1 << k) as f32);
        let (sin, cos) = (t.with_empty_tape().sin(), t.cos());
        sum = sum + sin.matmul(rows(weights, row + 3 + 3 * k));
        sum = sum + cos.matmul(rows(weights, row + 3 + 3 * octaves + 3 * k));
    }
    sum
}

/// The derivative of the same in the direction `dx`.
fn encoded_tangent<const INPUTS: usize>(
    x: &Matrix<SAMPLES, 3>,
    dx: &Matrix<SAMPLES, 3>,
    octaves: usize,
    weights: &Matrix<INPUTS, HIDDEN>,
    row: usize,
) -> Matrix<SAMPLES, HIDDEN, Taped> {
    let mut sum = dx.leaky_trace().matmul(rows(weights, row));
    for k in 0..octaves {
        let frequency = std::f32::consts::PI * (1 << k) as f32;
        let (t, dt) = (x.clone() * frequency, dx.clone() * frequency);
        let (by_sin, by_cos) = (t.clone().cos() * dt.clone(), -(t.sin() * dt));
        sum = sum + by_sin.leaky_trace().matmul(rows(weights, row + 3 + 3 * k));
        sum = sum + by_cos.leaky_trace().matmul(rows(weights, row + 3 + 3 * octaves + 3 * k));
    }
    sum
}

/// Features and positions, combined with weights of the corners of the samples' faces.
fn combined(
    e: &Case,
    features: &Matrix<VERTICES, FEATURES>,
    weights: impl Fn(&Place) -> [f32; 3],
) -> (Matrix<SAMPLES, FEATURES, Taped>, Matrix<SAMPLES, 3>) {
    let device = features.device().clone();
    let mut x = vec![0.0; 3 * SAMPLES];
    let mut corner = |c: usize| {
        let indices: [usize; SAMPLES] =
            std::array::from_fn(|s| e.base.faces[e.places[s].face.index()][c] as usize);
        let of_corner: Vec<f32> = e.places.iter().map(|s| weights(s)[c]).collect();
        for (s, v) in indices.iter().enumerate() {
            for k in 0..3 {
                x[3 * s + k] += of_corner[s] * e.base.positions[*v][k];
            }
        }
        let w: Matrix<SAMPLES, FEATURES> =
            device.tensor(of_corner.iter().flat_map(|&w| [w; FEATURES]).collect::<Vec<_>>());
        let of_features: Matrix<SAMPLES, FEATURES, Taped> =
            features.leaky_trace().gather(device.tensor(indices));
        of_features * w
    };
    let z = corner(0) + corner(1) + corner(2);
    (z, device.tensor(x))
}

/// Squared lengths of rows.
fn squared(a: Matrix<SAMPLES, 3, Taped>) -> Tensor<Rank1<SAMPLES>, f32, Cpu, Taped> {
    a.square().sum::<Rank1<SAMPLES>, _>()
}

/// Rows' entries moved by `by` places.
fn rolled(a: &Matrix<SAMPLES, 3, Taped>, by: usize) -> Matrix<SAMPLES, 3, Taped> {
    let mut permutation = vec![0.0; 9];
    (0..3).for_each(|c| permutation[3 * ((c + by) % 3) + c] = 1.0);
    let permutation: Matrix<3, 3> = a.device().tensor(permutation);
    a.with_empty_tape().matmul(permutation)
}

fn cross(a: &Matrix<SAMPLES, 3, Taped>, b: &Matrix<SAMPLES, 3, Taped>) -> Matrix<SAMPLES, 3, Taped> {
    rolled(a, 1) * rolled(b, 2) - rolled(a, 2) * rolled(b, 1)
}

/// The objective on the tape, term by term as the supplement writes them, and its gradients by features, θ and φ.
fn on_tape(e: &Case, weights: Weights) -> (f64, [Vec<f64>; 3]) {
    let device: Cpu = Cpu::default();
    let theta = Network::<THETA_INPUTS>::new(&device, &e.theta);
    let phi = Network::<PHI_INPUTS>::new(&device, e.phi.as_ref().expect("the residual map has a network"));
    let features: Matrix<VERTICES, FEATURES> = device.tensor(e.features.clone());
    let ones: Matrix<SAMPLES, 1> = device.ones();
    let first_rows: [usize; FEATURES] = std::array::from_fn(|k| k);
    let of_z =
        || -> Matrix<FEATURES, HIDDEN, Taped> { theta.first.leaky_trace().gather(device.tensor(first_rows)) };

    let (z, x) = combined(e, &features, |s| s.barycentric);
    let first = z.matmul(of_z()) + encoded(&x.leaky_trace(), OCTAVES, &theta.first, FEATURES);
    let Applied { output, sides } = theta.apply(&ones, first);
    let y = output + x.clone();
    let tangent = |k: usize| {
        let (dz, dx) = combined(e, &features, |s| e.base.frames[s.face.index()][k]);
        let first = dz.matmul(of_z()) + encoded_tangent(&x, &dx, OCTAVES, &theta.first, FEATURES);
        theta.apply_tangent(&sides, first) + dx
    };
    let (u, v) = (tangent(0), tangent(1));

    let first = encoded(&y, REVERSE_OCTAVES, &phi.first, 0);
    let back = phi.apply(&ones, first).output + y.with_empty_tape();
    let cycle = (back - x).square().sum::<Rank0, _>();

    let of_targets = |of: fn(&Target) -> Vec3| -> Matrix<SAMPLES, 3> {
        device.tensor(e.targets.iter().flat_map(|t| of(t).to_array()).collect::<Vec<_>>())
    };
    let (foot, normal) = (of_targets(|t| t.foot), of_targets(|t| t.normal));
    let outward = of_targets(|t| t.surface_normal);
    let away = y - foot;
    let height = (away.with_empty_tape() * normal).sum::<Rank1<SAMPLES>, _>();
    let area = cross(&u, &v);
    let trace = squared(u) + squared(v);
    let length = squared(area.with_empty_tape()).sqrt();
    let unit = area.with_empty_tape() / length.broadcast::<Rank2<SAMPLES, 3>, _>();
    let determinant = (area * outward.clone()).sum::<Rank1<SAMPLES>, _>();
    let t = -(determinant / trace.with_empty_tape());
    let terms = [
        height.square().sum::<Rank0, _>(),
        away.square().sum::<Rank0, _>(),
        trace.sum::<Rank0, _>(),
        (unit - outward).square().sum::<Rank0, _>(),
        (((t * 10.0).exp() + 1.0).ln() / 10.0).sum::<Rank0, _>(),
    ];
    // All terms, whatever their weights: between them they hold the pieces of the tape.
    let mut total = cycle * (LAMBDA_C / SAMPLES as f32);
    for (term, weight) in terms.into_iter().zip(weights) {
        total = total + term * (weight / SAMPLES as f32);
    }
    let value = f64::from(total.array());
    let g = total.backward();
    let by_features = g.get(&features).as_vec().into_iter().map(f64::from).collect();
    (value, [by_features, theta.gradients(&g), phi.gradients(&g)])
}

/// Every term alone and all of them together, each with the cycle loss, by every group of parameters. Anchors are the
/// second of the terms.
#[test]
fn gradients_agree_with_the_tape_of_dfdx() {
    let alone = |k: usize| std::array::from_fn(|i| if i == k { LAMBDA_P } else { 0.0 });
    let mut cases: Vec<Weights> = (0..5).map(alone).collect();
    cases.push([3.0, 0.2, 0.1, 0.5, 2.0, 0.0]);
    for weights in cases {
        let e = case(weights, ReverseMap::Residual, Activation::Relu);
        let (loss, truths) = on_tape(&e, weights);
        assert!((loss - e.loss).abs() < 1e-5 * e.loss, "{weights:?}: {loss} {}", e.loss);
        let found = [&e.by_features, &e.by_theta, &e.by_phi];
        for (name, (found, truth)) in
            ["features", "theta", "phi"].into_iter().zip(found.into_iter().zip(&truths))
        {
            let error = relative_error(found, truth);
            assert!(error < 1e-4, "{weights:?}, {name}: {error:.1e}");
        }
    }
}
