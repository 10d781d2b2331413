//! Rows of four numbers as vectors of the machine the program runs on.

#![allow(clippy::needless_range_loop, reason = "loops of a known length over registers")]

use pulp::{Simd, WithSimd};

/// Numbers in a row. Blocks of four functions need some two thirds of the applications of blocks of eight, and keep a
/// core as busy: both are limited by memory.
pub(crate) const WIDTH: usize = 4;

/// Four numbers in half a line of the cache.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(32))]
pub struct Row(pub(crate) [f64; WIDTH]);

/// Work written for rows of `V` vectors each.
pub(crate) trait Kernel {
    type Output;

    /// Must be `#[inline(always)]`, with all it calls in its loops, to be compiled for the instructions of `S`.
    fn run<S: Simd, const V: usize>(self, simd: S) -> Self::Output;
}

/// Runs a kernel with vectors of up to four numbers.
#[inline]
pub(crate) fn run<K: Kernel>(kernel: K) -> K::Output {
    struct Dispatch<K>(K);

    impl<K: Kernel> WithSimd for Dispatch<K> {
        type Output = K::Output;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> K::Output {
            match S::F64_LANES {
                4 => self.0.run::<S, 1>(simd),
                2 => self.0.run::<S, 2>(simd),
                1 => self.0.run::<S, 4>(simd),
                lanes => unreachable!("{lanes} lanes are more than were asked for"),
            }
        }
    }

    // Not the vectors of eight that `Arch` would take where there are some, nor code for all that it knows.
    #[cfg(target_arch = "x86_64")]
    match pulp::x86::V3::try_new() {
        Some(simd) => Simd::vectorize(simd, Dispatch(kernel)),
        None => Simd::vectorize(pulp::Scalar::new(), Dispatch(kernel)),
    }
    #[cfg(not(target_arch = "x86_64"))]
    pulp::Arch::new().dispatch(Dispatch(kernel))
}

/// A row in registers.
#[inline(always)]
pub(crate) fn load<S: Simd, const V: usize>(simd: S, row: &Row) -> [S::f64s; V] {
    let (vectors, _) = S::as_simd_f64s(&row.0);
    let mut loaded = [simd.splat_f64s(0.0); V];
    loaded.copy_from_slice(&vectors[..V]);
    loaded
}

/// A row back to memory.
#[inline(always)]
pub(crate) fn store<S: Simd, const V: usize>(row: &mut Row, values: [S::f64s; V]) {
    let (vectors, _) = S::as_mut_simd_f64s(&mut row.0);
    vectors[..V].copy_from_slice(&values);
}

/// `sum + factor · x`, in one rounding where the machine has an instruction for that: without one, as in WebAssembly, it
/// takes some thirty times as long.
#[inline(always)]
pub(crate) fn add<S: Simd, const V: usize>(
    simd: S,
    mut sum: [S::f64s; V],
    factor: f64,
    x: [S::f64s; V],
) -> [S::f64s; V] {
    let factor = simd.splat_f64s(factor);
    for v in 0..V {
        sum[v] = simd.mul_add_e_f64s(factor, x[v], sum[v]);
    }
    sum
}

/// A row of zeros.
#[inline(always)]
pub(crate) fn zero<S: Simd, const V: usize>(simd: S) -> [S::f64s; V] {
    [simd.splat_f64s(0.0); V]
}
