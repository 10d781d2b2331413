//! The three matrix products of a small network, register-tiled.
//!
//! All matrices are row-major, rows padded to [`LANES`](super::LANES). A tile of the result, a few rows by
//! one or two vectors, is held in registers while the sum runs; one factor is broadcast, the other loaded.

#![allow(
    clippy::too_many_arguments,
    clippy::manual_memcpy,
    reason = "kernels take matrices as slices and strides; loops over tiles of constant size unroll when indexed"
)]

use pulp::Simd;

/// Rows of a tile on machines with 32 vector registers (AVX-512, NEON); the others take half as many. Numbers
/// of rows passed to the kernels are multiples of this.
pub const TILE_ROWS: usize = 8;

#[inline(always)]
fn load<S: Simd, const V: usize>(simd: S, row: &[f32]) -> [S::f32s; V] {
    let (vectors, _) = S::as_simd_f32s(&row[..V * S::F32_LANES]);
    let mut loaded = [simd.splat_f32s(0.0); V];
    for v in 0..V {
        loaded[v] = vectors[v];
    }
    loaded
}

#[inline(always)]
fn store<S: Simd, const V: usize>(_simd: S, row: &mut [f32], values: [S::f32s; V]) {
    let (vectors, _) = S::as_mut_simd_f32s(&mut row[..V * S::F32_LANES]);
    vectors[..V].copy_from_slice(&values);
}

/// What happens to a product before it is stored.
#[derive(Clone, Copy, Debug)]
pub enum Finish<'a> {
    /// Nothing.
    Plain,
    /// Negative entries become 0.
    Relu,
    /// Entries become 0 where those of this matrix, as large as the product, are not positive.
    Where(&'a [f32]),
}

/// `C = bias + A B`: the affine map of a layer. `A` is `rows × inner` with stride `a_stride`, `B` is
/// `inner × width`, `C` is `rows × width`; `bias` has `width` entries or is empty for zero.
#[inline(always)]
pub fn product<S: Simd>(
    simd: S,
    a: &[f32],
    a_stride: usize,
    inner: usize,
    b: &[f32],
    width: usize,
    bias: &[f32],
    finish: Finish<'_>,
    c: &mut [f32],
) {
    if S::REGISTER_COUNT >= 32 {
        product_rows::<S, TILE_ROWS>(simd, a, a_stride, inner, b, width, bias, finish, c);
    } else {
        product_rows::<S, { TILE_ROWS / 2 }>(simd, a, a_stride, inner, b, width, bias, finish, c);
    }
}

#[inline(always)]
fn product_rows<S: Simd, const R: usize>(
    simd: S,
    a: &[f32],
    a_stride: usize,
    inner: usize,
    b: &[f32],
    width: usize,
    bias: &[f32],
    finish: Finish<'_>,
    c: &mut [f32],
) {
    debug_assert!(width.is_multiple_of(S::F32_LANES));
    let blocks = a.chunks_exact(R * a_stride).zip(c.chunks_exact_mut(R * width));
    for (block, (a, c)) in blocks.enumerate() {
        let finish = match finish {
            Finish::Where(signs) => Finish::Where(&signs[block * R * width..][..R * width]),
            other => other,
        };
        let mut column = 0;
        while column < width {
            if width - column >= 2 * S::F32_LANES {
                product_tile::<S, R, 2>(simd, a, a_stride, inner, b, width, column, bias, finish, c);
                column += 2 * S::F32_LANES;
            } else {
                product_tile::<S, R, 1>(simd, a, a_stride, inner, b, width, column, bias, finish, c);
                column += S::F32_LANES;
            }
        }
    }
}

#[inline(always)]
fn product_tile<S: Simd, const R: usize, const V: usize>(
    simd: S,
    a: &[f32],
    a_stride: usize,
    inner: usize,
    b: &[f32],
    width: usize,
    column: usize,
    bias: &[f32],
    finish: Finish<'_>,
    c: &mut [f32],
) {
    let start = if bias.is_empty() { [simd.splat_f32s(0.0); V] } else { load(simd, &bias[column..]) };
    let mut sums = [start; R];
    let mut rows: [&[f32]; R] = [&[]; R];
    for r in 0..R {
        rows[r] = &a[r * a_stride..][..inner];
    }
    for (i, b_row) in b.chunks_exact(width).take(inner).enumerate() {
        let b_row: [S::f32s; V] = load(simd, &b_row[column..]);
        for r in 0..R {
            let factor = simd.splat_f32s(rows[r][i]);
            for v in 0..V {
                sums[r][v] = simd.mul_add_f32s(factor, b_row[v], sums[r][v]);
            }
        }
    }
    let zero = simd.splat_f32s(0.0);
    for r in 0..R {
        match finish {
            Finish::Plain => {}
            Finish::Relu => {
                for v in 0..V {
                    sums[r][v] = simd.max_f32s(sums[r][v], zero);
                }
            }
            Finish::Where(signs) => {
                let signs: [S::f32s; V] = load(simd, &signs[r * width + column..]);
                for v in 0..V {
                    let is_positive = simd.greater_than_f32s(signs[v], zero);
                    sums[r][v] = simd.select_f32s(is_positive, sums[r][v], zero);
                }
            }
        }
        store(simd, &mut c[r * width + column..], sums[r]);
    }
}

/// `C += Aᵀ B`: the gradient of a layer's weights. `A` is `rows × outputs` with stride `a_stride`, `B` is
/// `rows × width`, `C` is `outputs × width`.
#[inline(always)]
pub fn add_transposed_product<S: Simd>(
    simd: S,
    a: &[f32],
    a_stride: usize,
    outputs: usize,
    b: &[f32],
    width: usize,
    c: &mut [f32],
) {
    let mut row = 0;
    while row < outputs {
        let left = outputs - row;
        let c = &mut c[row * width..];
        if left >= 8 && S::REGISTER_COUNT >= 32 {
            transposed_rows::<S, 8>(simd, a, a_stride, row, b, width, c);
            row += 8;
        } else if left >= 4 {
            transposed_rows::<S, 4>(simd, a, a_stride, row, b, width, c);
            row += 4;
        } else {
            transposed_rows::<S, 1>(simd, a, a_stride, row, b, width, c);
            row += 1;
        }
    }
}

#[inline(always)]
fn transposed_rows<S: Simd, const R: usize>(
    simd: S,
    a: &[f32],
    a_stride: usize,
    first: usize,
    b: &[f32],
    width: usize,
    c: &mut [f32],
) {
    let mut column = 0;
    while column < width {
        if width - column >= 2 * S::F32_LANES {
            transposed_tile::<S, R, 2>(simd, a, a_stride, first, b, width, column, c);
            column += 2 * S::F32_LANES;
        } else {
            transposed_tile::<S, R, 1>(simd, a, a_stride, first, b, width, column, c);
            column += S::F32_LANES;
        }
    }
}

#[inline(always)]
fn transposed_tile<S: Simd, const R: usize, const V: usize>(
    simd: S,
    a: &[f32],
    a_stride: usize,
    first: usize,
    b: &[f32],
    width: usize,
    column: usize,
    c: &mut [f32],
) {
    let mut sums = [[simd.splat_f32s(0.0); V]; R];
    for r in 0..R {
        sums[r] = load(simd, &c[r * width + column..]);
    }
    for (a_row, b_row) in a.chunks_exact(a_stride).zip(b.chunks_exact(width)) {
        let b_row: [S::f32s; V] = load(simd, &b_row[column..]);
        let a_row = &a_row[first..][..R];
        for r in 0..R {
            let factor = simd.splat_f32s(a_row[r]);
            for v in 0..V {
                sums[r][v] = simd.mul_add_f32s(factor, b_row[v], sums[r][v]);
            }
        }
    }
    for r in 0..R {
        store(simd, &mut c[r * width + column..], sums[r]);
    }
}

/// Adds the sum of the rows of `a` (each `sums.len()` wide) to `sums`: the gradient of a layer's biases.
#[inline(always)]
pub fn add_row_sums<S: Simd>(simd: S, a: &[f32], sums: &mut [f32]) {
    let width = sums.len();
    for column in (0..width).step_by(S::F32_LANES) {
        let [mut sum]: [S::f32s; 1] = load(simd, &sums[column..]);
        for row in a.chunks_exact(width) {
            let [x]: [S::f32s; 1] = load(simd, &row[column..]);
            sum = simd.add_f32s(sum, x);
        }
        store(simd, &mut sums[column..], [sum]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    struct Both<'a> {
        a: &'a [f32],
        b: &'a [f32],
        bias: &'a [f32],
        c: &'a mut [f32],
        d: &'a mut [f32],
        inner: usize,
        width: usize,
        rows: usize,
    }

    impl pulp::WithSimd for Both<'_> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            let Self { a, b, bias, c, d, inner, width, rows } = self;
            product(simd, a, inner, inner, b, width, bias, Finish::Plain, c);
            // Aᵀ (rows × inner → inner × width) of the product just made.
            add_transposed_product(simd, &a[..rows * inner], inner, inner, c, width, d);
        }
    }

    #[test]
    fn products_agree_with_the_definition_on_every_instruction_set() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for (rows, inner, width) in [(32, 11, 16), (8, 33, 48), (16, 3, 64), (32, 32, 32)] {
            let mut random = |n: usize| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect::<Vec<f32>>();
            let (a, b, bias) = (random(rows * inner), random(inner * width), random(width));
            let start = random(inner * width);
            let mut arches = vec![pulp::Arch::Scalar, pulp::Arch::new()];
            #[cfg(target_arch = "x86_64")]
            arches.extend(pulp::x86::V3::try_new().map(pulp::Arch::V3));
            for arch in arches {
                let mut c = vec![0.0; rows * width];
                let mut d = start.clone();
                arch.dispatch(Both { a: &a, b: &b, bias: &bias, c: &mut c, d: &mut d, inner, width, rows });
                for s in 0..rows {
                    for j in 0..width {
                        let truth: f64 = (0..inner)
                            .map(|i| f64::from(a[s * inner + i]) * f64::from(b[i * width + j]))
                            .sum::<f64>()
                            + f64::from(bias[j]);
                        assert!((f64::from(c[s * width + j]) - truth).abs() < 1e-5);
                    }
                }
                for i in 0..inner {
                    for j in 0..width {
                        let truth: f64 = (0..rows)
                            .map(|s| f64::from(a[s * inner + i]) * f64::from(c[s * width + j]))
                            .sum::<f64>()
                            + f64::from(start[i * width + j]);
                        assert!((f64::from(d[i * width + j]) - truth).abs() < 1e-4);
                    }
                }
            }
        }
    }
}
