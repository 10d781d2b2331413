//! The same step on dfdx's tape: both networks, the encoding, the gather of the features. Without the optimiser.

use std::time::Instant;

use dfdx::prelude::*;

const SAMPLES: usize = 32_768;
const VERTICES: usize = 2000;
const FEATURES: usize = 8;
const HIDDEN: usize = 32;
const OCTAVES: usize = 8;

type Matrix<const M: usize, const N: usize> = Tensor<Rank2<M, N>, f32, Cpu>;
type Taped<const M: usize, const N: usize> = Tensor<Rank2<M, N>, f32, Cpu, OwnedTape<f32, Cpu>>;

/// What follows the first layer's sums.
struct Rest {
    second: Matrix<HIDDEN, HIDDEN>,
    third: Matrix<HIDDEN, 3>,
}

impl Rest {
    fn apply(&self, first: Taped<SAMPLES, HIDDEN>) -> Taped<SAMPLES, 3> {
        first.relu().matmul(self.second.leaky_trace()).relu().matmul(self.third.leaky_trace())
    }
}

/// Least milliseconds of five steps. Biases are left out, which favours dfdx.
pub(crate) fn milliseconds() -> f64 {
    let device: Cpu = Cpu::default();
    let rest = || Rest { second: device.sample_normal(), third: device.sample_normal() };
    let features: Matrix<VERTICES, FEATURES> = device.sample_normal();
    let (of_z, of_x): (Matrix<FEATURES, HIDDEN>, Matrix<3, HIDDEN>) =
        (device.sample_normal(), device.sample_normal());
    let x: Matrix<SAMPLES, 3> = device.sample_normal();
    let foot: Matrix<SAMPLES, 3> = device.sample_normal();
    let (theta, phi) = (rest(), rest());
    let of_y: Matrix<3, HIDDEN> = device.sample_normal();
    let codes: Vec<[Matrix<3, HIDDEN>; 2]> =
        (0..OCTAVES).map(|_| [device.sample_normal(), device.sample_normal()]).collect();
    let indices: Vec<Tensor<Rank1<SAMPLES>, usize, Cpu>> = (0..3)
        .map(|c| device.tensor((0..SAMPLES).map(|s| (s / 17 + 7 * c) % VERTICES).collect::<Vec<_>>()))
        .collect();
    let step = || {
        let corner = |c: usize| -> Taped<SAMPLES, FEATURES> {
            features.leaky_trace().gather(indices[c].clone()) * (1.0 / 3.0)
        };
        let z = corner(0) + corner(1) + corner(2);
        let first = z.matmul(of_z.leaky_trace()) + x.leaky_trace().matmul(of_x.leaky_trace());
        let y = theta.apply(first) + x.clone();
        let mut first = y.with_empty_tape().matmul(of_y.leaky_trace());
        for (k, [by_sine, by_cosine]) in codes.iter().enumerate() {
            let angle = y.with_empty_tape() * (std::f32::consts::PI * (1 << k) as f32);
            let (sine, cosine) = (angle.with_empty_tape().sin(), angle.cos());
            first = first + sine.matmul(by_sine.leaky_trace()) + cosine.matmul(by_cosine.leaky_trace());
        }
        let back = phi.apply(first) + y.with_empty_tape();
        let loss =
            (y - foot.clone()).square().mean::<Rank0, _>() + (back - x.clone()).square().mean::<Rank0, _>();
        std::hint::black_box(loss.backward().get(&features).as_vec());
    };
    step();
    let times = (0..5).map(|_| {
        let started = Instant::now();
        step();
        1e3 * started.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}
