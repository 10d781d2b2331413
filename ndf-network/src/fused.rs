//! Fused multiplication and addition in single precision where the machine has no instruction for it, as WebAssembly: with
//! the same bits as where it has one, so that models give the same surface everywhere, and in a fraction of the time of the
//! C library's function.
//!
//! A product of two numbers of 24 bits is exact in double precision. The sum is rounded there, and again to single
//! precision. That is rounding once, unless the first rounding ends in the middle between two numbers of single precision
//! (Figueroa 1995), or the result is smaller than normal numbers are. Both are seen in the bits, and are rare.

use pulp::Simd;

/// `a · b + c` for the lanes of vectors, rounded once.
#[inline(always)]
pub(crate) fn mul_add<S: Simd>(simd: S, a: f32, b: S::f32s, c: S::f32s) -> S::f32s {
    if cfg!(not(target_family = "wasm")) {
        return simd.mul_add_f32s(simd.splat_f32s(a), b, c);
    }
    let mut sums = c;
    let lanes = bytemuck::cast_slice::<_, f32>(std::slice::from_ref(&b));
    in_doubles(a, lanes, bytemuck::cast_slice_mut(std::slice::from_mut(&mut sums)));
    sums
}

/// Adds `a · b` to the lanes of `c`.
#[inline(always)]
fn in_doubles(a: f32, b: &[f32], c: &mut [f32]) {
    let before: [f32; 4] = match c.try_into() {
        Ok(lanes) => lanes,
        Err(_) => return b.iter().zip(c).for_each(|(&b, c)| *c = a.mul_add(b, *c)),
    };
    let mut doubtful = 0_u64;
    for (&b, c) in b.iter().zip(c.iter_mut()) {
        let sum = f64::from(a) * f64::from(b) + f64::from(*c);
        let bits = sum.to_bits();
        let is_between = bits & 0x1fff_ffff == 0x1000_0000;
        let is_small = bits << 1 != 0 && (bits << 1 >> 53) < 1023 - 126;
        doubtful |= u64::from(is_between | is_small);
        *c = sum as f32;
    }
    if doubtful != 0 {
        again(a, b, before, c);
    }
}

/// The same by the C library's function.
#[cold]
#[inline(never)]
fn again(a: f32, b: &[f32], before: [f32; 4], c: &mut [f32]) {
    for ((&b, before), c) in b.iter().zip(before).zip(c) {
        *c = a.mul_add(b, before);
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn check(a: f32, b: [f32; 4], c: [f32; 4]) {
        let mut sums = c;
        in_doubles(a, &b, &mut sums);
        for i in 0..4 {
            let expected = a.mul_add(b[i], c[i]);
            let is_same = sums[i].to_bits() == expected.to_bits() || sums[i].is_nan() && expected.is_nan();
            assert!(is_same, "{a:e} {:e} {:e}: {:e}, not {expected:e}", b[i], c[i], sums[i]);
        }
    }

    #[test]
    fn it_rounds_once() {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        // All bit patterns, and numbers whose products are near to the addend, where bits are lost.
        for _ in 0..100_000 {
            let mut any = || f32::from_bits(rng.random());
            check(any(), std::array::from_fn(|_| any()), std::array::from_fn(|_| any()));
            let a: f32 = rng.random_range(-2.0..2.0);
            let b = std::array::from_fn(|_| rng.random_range(-2.0..2.0));
            let c = b.map(|b: f32| -a * b * rng.random_range(0.999..1.001));
            check(a, b, c);
        }
    }

    #[test]
    fn it_rounds_once_where_two_roundings_differ() {
        // 1 + 2⁻²⁴ lies between two numbers; what is added to it decides, and is lost in double precision.
        let half_an_ulp = 2.0_f32.powi(-24);
        let tiny = 2.0_f32.powi(-60);
        for sign in [1.0, -1.0] {
            check(sign * half_an_ulp, [1.0 + 2.0_f32.powi(-23); 4], [1.0, -1.0, 1.5, 2.0]);
            check(
                sign * tiny,
                [tiny, 1.0, -1.0, 0.0],
                [1.0 + 2.0_f32.powi(-23), 1.0, 0.0, f32::MIN_POSITIVE],
            );
            check(
                sign * f32::MIN_POSITIVE,
                [0.5, 0.75, 1.0e-7, 0.25],
                [f32::from_bits(1), 0.0, f32::from_bits(3), -0.0],
            );
            check(sign * f32::MAX, [1.0, 2.0, 0.5, 1.0], [f32::MAX, 1.0, f32::MAX, f32::NEG_INFINITY]);
        }
    }
}
