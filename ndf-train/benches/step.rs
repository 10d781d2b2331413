//! Time of one training step beside the processor's peak: `cargo bench -p ndf-train --bench step`.
//!
//! A step is an epoch of the paper's size without projection: 32,768 samples, 8 features, no encoding for g, 8 octaves
//! for the reverse map; once without tangents, once with a term that needs their values and gradients. Arithmetic is
//! counted without padding. The peak is that of a bare loop of fused multiply-adds in registers, in the same run.

#![allow(clippy::print_stdout, reason = "a benchmark prints its table")]

use std::time::{Duration, Instant};

use ndf_core::mesh::shapes;
use ndf_core::{BoundingBox, DVec3, Foot, Hint, ManifoldMesh, Miss, Projection, Query, Surface};
use ndf_train::{Settings, Trainer};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

struct Sphere;

impl Surface for Sphere {
    fn bounds(&self) -> BoundingBox {
        BoundingBox { min: DVec3::NEG_ONE, max: DVec3::ONE }
    }

    fn project(&self, queries: &[Query], feet: &mut [Projection]) {
        for (query, foot) in queries.iter().zip(feet) {
            *foot = match query.point.try_normalize() {
                Some(n) => Ok(Foot { point: n, normal: n, hint: Hint::NONE }),
                None => Err(Miss::OutOfReach),
            };
        }
    }
}

/// A loop of fused multiply-adds on sixteen independent registers; returns operations made.
struct Peak(u32);

impl WithSimd for Peak {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let mut sums = [simd.splat_f32s(1.0); 16];
        let (a, b) = (simd.splat_f32s(std::hint::black_box(0.999)), simd.splat_f32s(1e-3));
        for _ in 0..self.0 {
            for sum in &mut sums {
                *sum = simd.mul_add_f32s(*sum, a, b);
            }
        }
        std::hint::black_box(sums);
        f64::from(self.0) * 16.0 * 2.0 * S::F32_LANES as f64
    }
}

/// Measurements of each kind, in turns.
const ROUNDS: usize = 8;
const STEPS: usize = 12;

fn peak_gflops(threads: usize) -> f64 {
    let started = Instant::now();
    let operations: f64 =
        (0..threads).into_par_iter().map(|_| pulp::Arch::new().dispatch(Peak(4_000_000))).sum();
    operations / started.elapsed().as_secs_f64() / 1e9
}

/// Multiply-adds of a network without padding: forward, or by each of the two products of the way back.
fn products(inputs: usize) -> f64 {
    (inputs * 32 + 32 * 32 + 32 * 3) as f64
}

fn main() {
    let base = ManifoldMesh::try_from(shapes::torus(50, 40, 1.0, 0.4)).expect("a torus is a manifold");
    println!(
        "{:<28} {:>7} {:>9} {:>9} {:>9} {:>9} {:>7}",
        "step", "threads", "median ms", "least ms", "GFLOP/s", "peak", "share"
    );
    for (name, lambda_n) in [("values", 0.0), ("values, tangents, normals", 1.0)] {
        let settings = Settings {
            samples: 32_768,
            epochs: 1_000_000,
            resample_every: 1_000_000,
            project_every: 1_000_000,
            lambda_n,
            ..Settings::default()
        };
        let rows = if lambda_n > 0.0 { 3.0 } else { 1.0 };
        let work = 2.0 * 3.0 * (rows * products(11) + products(51)) * settings.samples as f64;
        for threads in [1, 2] {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be had");
            pool.install(|| {
                let mut trainer = Trainer::new(&Sphere, &base, &settings).expect("settings are usable");
                let mut epoch = || {
                    let started = Instant::now();
                    trainer.run_epoch().expect("the sphere can be learned");
                    started.elapsed()
                };
                (0..5).for_each(|_| {
                    epoch();
                });
                // Steps and the peak in turns, the best of each: what the machine can do when nothing disturbs it.
                let mut times: Vec<Duration> = Vec::new();
                let mut peak = 0.0_f64;
                for _ in 0..ROUNDS {
                    times.extend((0..STEPS).map(|_| epoch()));
                    peak = peak.max(peak_gflops(threads));
                }
                times.sort_unstable();
                let (least, median) = (times[0].as_secs_f64(), times[times.len() / 2].as_secs_f64());
                let reached = work / least / 1e9;
                println!(
                    "{name:<28} {threads:>7} {:>9.2} {:>9.2} {reached:>9.1} {peak:>9.1} {:>6.0} %",
                    1e3 * median,
                    1e3 * least,
                    100.0 * reached / peak
                );
            });
        }
    }
}
