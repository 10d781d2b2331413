//! The networks' kernels beside the processor's peak, on one thread: `cargo bench -p ndf-network --bench kernels`.
//!
//! Arithmetic is counted without padding. The peak is that of a bare loop of fused multiply-adds in registers.

#![allow(clippy::print_stdout, reason = "a benchmark prints its table")]

use std::hint::black_box;
use std::time::Instant;

use ndf_network::simd::{InputGradient, backward, forward};
use ndf_network::{Activation, Activations, BLOCK, Gradients, Mlp, MlpShape, Packed};
use pulp::{Simd, WithSimd};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

mod peak;

const REPEATS: usize = 20_000;

struct Forward<'a>(&'a Packed, &'a mut Activations);

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for _ in 0..REPEATS {
            forward(simd, self.0, black_box(&mut *self.1));
        }
    }
}

struct Backward<'a>(&'a Packed, &'a Activations, &'a mut Gradients);

impl WithSimd for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for _ in 0..REPEATS {
            backward(simd, self.0, self.1, black_box(&mut *self.2), InputGradient::Wanted);
        }
    }
}

fn gflops(run: impl FnOnce() -> f64) -> f64 {
    let started = Instant::now();
    let operations = run();
    operations / started.elapsed().as_secs_f64() / 1e9
}

fn main() {
    let arch = pulp::Arch::new();
    let peak = peak::gflops(1, 20_000_000);
    println!("peak {peak:.1} GFLOP/s");
    for (name, inputs) in [("g", 11), ("reverse map", 51)] {
        let shape = MlpShape { inputs, hidden: vec![32, 32], outputs: 3, activation: Activation::Relu };
        let products = 2.0 * (BLOCK * (inputs * 32 + 32 * 32 + 32 * 3)) as f64;
        let packed = Packed::new(&Mlp::kaiming(shape, &mut ChaCha8Rng::seed_from_u64(1)));
        let mut activations = Activations::new(&packed);
        activations.input_mut().fill(0.1);
        let mut gradients = Gradients::new(&packed);
        gradients.output_mut().fill(1e-3);
        let ahead = gflops(|| {
            arch.dispatch(Forward(&packed, &mut activations));
            products * REPEATS as f64
        });
        let back = gflops(|| {
            arch.dispatch(Backward(&packed, &activations, &mut gradients));
            2.0 * products * REPEATS as f64
        });
        println!(
            "{name:>12}: forward {:>3.0} %, backward {:>3.0} %",
            100.0 * ahead / peak,
            100.0 * back / peak
        );
    }
}
