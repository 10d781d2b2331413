//! The peak of the processor's f32 arithmetic, as a bare loop reaches it.

use std::hint::black_box;
use std::time::Instant;

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// A loop of fused multiply-adds on sixteen independent registers; returns operations made.
struct Peak(u32);

impl WithSimd for Peak {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let mut sums = [simd.splat_f32s(1.0); 16];
        let (a, b) = (simd.splat_f32s(black_box(0.999)), simd.splat_f32s(1e-3));
        for _ in 0..self.0 {
            for sum in &mut sums {
                *sum = simd.mul_add_f32s(*sum, a, b);
            }
        }
        black_box(sums);
        f64::from(self.0) * 16.0 * 2.0 * S::F32_LANES as f64
    }
}

/// Thousand million operations a second of so many threads of the current pool, each of which runs the loop so often.
pub(crate) fn gflops(threads: usize, rounds: u32) -> f64 {
    let started = Instant::now();
    let operations: f64 =
        (0..threads).into_par_iter().map(|_| pulp::Arch::new().dispatch(Peak(rounds))).sum();
    operations / started.elapsed().as_secs_f64() / 1e9
}
