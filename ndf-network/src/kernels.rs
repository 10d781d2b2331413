//! The matrix products of a small network, register-tiled.
//!
//! Matrices are row-major, rows padded to [`LANES`](super::LANES). A tile of the result, a few rows by one panel of
//! columns, is held in registers while the sum runs; one factor is broadcast, the other loaded. A panel is 32 floats
//! wide, or 16 at the end of a matrix whose width is an odd multiple of 16.

use pulp::{NullaryFnOnce, Simd};

use super::{Lines, fused};

/// Floats in a row of a panel.
const PANEL: usize = 32;

/// A matrix in panels: the rows of the first `PANEL` columns, then those of the next.
#[derive(Clone, Debug)]
pub(crate) struct Panels {
    rows: usize,
    width: usize,
    data: Lines,
}

impl Panels {
    /// Zeros; `width` is a multiple of [`LANES`](super::LANES).
    pub(crate) fn new(rows: usize, width: usize) -> Self {
        Self { rows, width, data: Lines::zeros(rows * width) }
    }

    /// Sets the beginning of a row.
    pub(crate) fn set_row(&mut self, row: usize, values: &[f32]) {
        for (k, part) in values.chunks(PANEL).enumerate() {
            let first = k * PANEL;
            let width = PANEL.min(self.width - first);
            self.data[self.rows * first + row * width..][..part.len()].copy_from_slice(part);
        }
    }

    /// Sets the beginning of a column.
    pub(crate) fn set_column(&mut self, column: usize, values: &[f32]) {
        let first = column - column % PANEL;
        let width = PANEL.min(self.width - first);
        let entries = self.data[self.rows * first + column - first..].iter_mut().step_by(width);
        entries.zip(values).for_each(|(entry, &value)| *entry = value);
    }

    /// The rows of the panel that begins at column `first`.
    #[inline(always)]
    fn panel(&self, first: usize) -> &[f32] {
        let width = PANEL.min(self.width - first);
        &self.data[self.rows * first..][..self.rows * width]
    }
}

/// What happens to a product before it is stored.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Finish<'a> {
    /// Nothing.
    Plain,
    /// Negative entries are multiplied by this, which is below 1.
    Rectify(f32),
    /// Entries are multiplied by `below` where those of `signs`, as large as the product, are not positive.
    Where {
        /// What tells the side.
        signs: &'a [f32],
        /// The factor.
        below: f32,
    },
    /// Entries are multiplied by those of this matrix.
    Times(&'a [f32]),
}

impl Finish<'_> {
    /// Applies to `V` vectors of the result that begin at `index`.
    #[inline(always)]
    fn apply<S: Simd, const V: usize>(self, simd: S, index: usize, mut values: [S::f32s; V]) -> [S::f32s; V] {
        match self {
            Finish::Plain => {}
            // One operation less where the factor is zero, as it nearly always is.
            Finish::Rectify(0.0) => {
                let zero = simd.splat_f32s(0.0);
                for v in 0..V {
                    values[v] = simd.max_f32s(values[v], zero);
                }
            }
            Finish::Rectify(below) => {
                let below = simd.splat_f32s(below);
                for v in 0..V {
                    values[v] = simd.max_f32s(values[v], simd.mul_f32s(below, values[v]));
                }
            }
            Finish::Where { signs, below: 0.0 } => {
                let zero = simd.splat_f32s(0.0);
                let signs = load::<S, V>(&signs[index..]);
                for v in 0..V {
                    values[v] = simd.select_f32s(simd.greater_than_f32s(signs[v], zero), values[v], zero);
                }
            }
            Finish::Where { signs, below } => {
                let (zero, below) = (simd.splat_f32s(0.0), simd.splat_f32s(below));
                let signs = load::<S, V>(&signs[index..]);
                for v in 0..V {
                    let is_above = simd.greater_than_f32s(signs[v], zero);
                    values[v] = simd.select_f32s(is_above, values[v], simd.mul_f32s(below, values[v]));
                }
            }
            Finish::Times(factors) => {
                let factors = load::<S, V>(&factors[index..]);
                for v in 0..V {
                    values[v] = simd.mul_f32s(values[v], factors[v]);
                }
            }
        }
        values
    }
}

#[inline(always)]
fn load<S: Simd, const V: usize>(row: &[f32]) -> [S::f32s; V] {
    let vectors: &[[S::f32s; V]] = S::as_simd_f32s(&row[..V * S::F32_LANES]).0.as_chunks().0;
    vectors[0]
}

#[inline(always)]
fn store<S: Simd, const V: usize>(row: &mut [f32], values: [S::f32s; V]) {
    let vectors: &mut [[S::f32s; V]] = S::as_mut_simd_f32s(&mut row[..V * S::F32_LANES]).0.as_chunks_mut().0;
    vectors[0] = values;
}

/// Calls a function of a panel with the tile that fits the registers: rows of a tile, vectors in a panel.
macro_rules! by_registers {
    ($S:ident, $width:expr, $function:ident $arguments:tt) => {
        match ($S::F32_LANES, $width == PANEL) {
            (16, true) => $function::<$S, 8, 2> $arguments,
            (16, false) => $function::<$S, 8, 1> $arguments,
            (8, true) => $function::<$S, 2, 4> $arguments,
            (8, false) => $function::<$S, 4, 2> $arguments,
            (4, true) => $function::<$S, 2, 8> $arguments,
            (4, false) => $function::<$S, 4, 4> $arguments,
            (_, true) => $function::<$S, 1, 32> $arguments,
            (_, false) => $function::<$S, 1, 16> $arguments,
        }
    };
}

/// `C = bias + A B`: the affine map of a layer. `A` is `rows × B's rows` with stride `a_stride`, `C` is `rows × B's
/// width`; `bias` is as wide or empty for zero.
#[inline(always)]
pub(crate) fn product<S: Simd>(
    simd: S,
    a: &[f32],
    a_stride: usize,
    b: &Panels,
    bias: &[f32],
    finish: Finish<'_>,
    c: &mut [f32],
) {
    simd.vectorize(Product { simd, a, a_stride, b, bias, finish, c });
}

/// A product as one function of its own: inlined wherever it is called, the code of a step outgrows the first-level cache
/// of instructions.
struct Product<'a, S> {
    simd: S,
    a: &'a [f32],
    a_stride: usize,
    b: &'a Panels,
    bias: &'a [f32],
    finish: Finish<'a>,
    c: &'a mut [f32],
}

impl<S: Simd> NullaryFnOnce for Product<'_, S> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let mut first = 0;
        while first < self.b.width {
            let width = PANEL.min(self.b.width - first);
            by_registers!(S, width, product_panel(&mut self, first));
            first += width;
        }
    }
}

#[inline(always)]
fn product_panel<S: Simd, const R: usize, const V: usize>(op: &mut Product<'_, S>, first: usize) {
    let Product { simd, a, a_stride, b, bias, finish, ref mut c } = *op;
    let inner = b.rows;
    let b_rows: &[[S::f32s; V]] = &S::as_simd_f32s(b.panel(first)).0.as_chunks().0[..inner];
    let start = if bias.is_empty() { [simd.splat_f32s(0.0); V] } else { load::<S, V>(&bias[first..]) };
    for (tile, c_rows) in c.chunks_exact_mut(R * b.width).enumerate() {
        let mut rows: [&[f32]; R] = [&[]; R];
        for r in 0..R {
            rows[r] = &a[(tile * R + r) * a_stride..][..inner];
        }
        let mut sums = [start; R];
        // All slices have this length: no index is checked in the loop.
        for i in 0..inner {
            for r in 0..R {
                for v in 0..V {
                    sums[r][v] = fused::mul_add(simd, rows[r][i], b_rows[i][v], sums[r][v]);
                }
            }
        }
        for r in 0..R {
            let at = r * b.width + first;
            let finished = finish.apply(simd, tile * R * b.width + at, sums[r]);
            store::<S, V>(&mut c_rows[at..], finished);
        }
    }
}

/// `C += Aᵀ B`: the gradient of a layer's weights. `A` is `rows × columns` with stride `a_stride`, `B` is
/// `rows × width`, `C` is `columns × width`.
#[inline(always)]
pub(crate) fn add_transposed_product<S: Simd>(
    simd: S,
    a: &[f32],
    a_stride: usize,
    columns: usize,
    b: &[f32],
    width: usize,
    c: &mut [f32],
) {
    simd.vectorize(TransposedProduct { simd, a, a_stride, columns, b, width, c });
}

struct TransposedProduct<'a, S> {
    simd: S,
    a: &'a [f32],
    a_stride: usize,
    columns: usize,
    b: &'a [f32],
    width: usize,
    c: &'a mut [f32],
}

impl<S: Simd> NullaryFnOnce for TransposedProduct<'_, S> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let mut first = 0;
        while first < self.width {
            let panel = PANEL.min(self.width - first);
            by_registers!(S, panel, transposed_panel(&mut self, first));
            first += panel;
        }
    }
}

#[inline(always)]
fn transposed_panel<S: Simd, const R: usize, const V: usize>(
    op: &mut TransposedProduct<'_, S>,
    first: usize,
) {
    let mut column = 0;
    while column < op.columns {
        column += match R.min(op.columns - column) {
            8.. => transposed_tile::<S, 8, V>(op, first, column),
            4.. => transposed_tile::<S, 4, V>(op, first, column),
            3 => transposed_tile::<S, 3, V>(op, first, column),
            2 => transposed_tile::<S, 2, V>(op, first, column),
            _ => transposed_tile::<S, 1, V>(op, first, column),
        };
    }
}

/// Columns `column..` of A with the panel at `first` of B; returns the height of the tile.
#[inline(always)]
fn transposed_tile<S: Simd, const R: usize, const V: usize>(
    op: &mut TransposedProduct<'_, S>,
    first: usize,
    column: usize,
) -> usize {
    let (simd, width) = (op.simd, op.width);
    let c = &mut op.c[column * width + first..];
    let mut sums = [[simd.splat_f32s(0.0); V]; R];
    for r in 0..R {
        sums[r] = load::<S, V>(&c[r * width..]);
    }
    for (a_row, b_row) in op.a[column..].chunks(op.a_stride).zip(op.b[first..].chunks(width)) {
        let (a_row, b_row) = (&a_row[..R], load::<S, V>(b_row));
        for r in 0..R {
            let factor = simd.splat_f32s(a_row[r]);
            for v in 0..V {
                sums[r][v] = simd.mul_add_f32s(factor, b_row[v], sums[r][v]);
            }
        }
    }
    for r in 0..R {
        store::<S, V>(&mut c[r * width..], sums[r]);
    }
    R
}

/// Adds the sum of the rows of `a` (each `sums.len()` wide) to `sums`: the gradient of a layer's biases.
#[inline(always)]
pub(crate) fn add_row_sums<S: Simd>(simd: S, a: &[f32], sums: &mut [f32]) {
    let width = sums.len();
    for column in (0..width).step_by(S::F32_LANES) {
        let [mut sum] = load::<S, 1>(&sums[column..]);
        for row in a.chunks_exact(width) {
            let [x] = load::<S, 1>(&row[column..]);
            sum = simd.add_f32s(sum, x);
        }
        store::<S, 1>(&mut sums[column..], [sum]);
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
        b: &'a Panels,
        bias: &'a [f32],
        finish: Finish<'a>,
        c: &'a mut [f32],
        d: &'a mut [f32],
        inner: usize,
    }

    impl pulp::WithSimd for Both<'_> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            let Self { a, b, bias, finish, c, d, inner } = self;
            product(simd, a, inner, b, bias, finish, c);
            // Aᵀ (rows × inner → inner × width) of the product just made.
            add_transposed_product(simd, a, inner, inner, c, b.width, d);
        }
    }

    #[test]
    fn products_agree_with_the_definition_on_every_instruction_set() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for (rows, inner, width) in [(32, 11, 16), (8, 33, 48), (16, 3, 64), (32, 32, 32), (8, 5, 80)] {
            let mut random = |n: usize| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect::<Vec<f32>>();
            let (a, b, bias) = (random(rows * inner), random(inner * width), random(width));
            let (start, other) = (random(inner * width), random(rows * width));
            let mut panels = Panels::new(inner, width);
            let mut by_column = panels.clone();
            b.chunks_exact(width).enumerate().for_each(|(i, row)| panels.set_row(i, row));
            for j in 0..width {
                by_column.set_column(j, &(0..inner).map(|i| b[i * width + j]).collect::<Vec<_>>());
            }
            assert_eq!(panels.data[..], by_column.data[..]);
            let finishes = [
                Finish::Plain,
                Finish::Rectify(0.1),
                Finish::Rectify(0.0),
                Finish::Where { signs: &other, below: 0.25 },
                Finish::Where { signs: &other, below: 0.0 },
                Finish::Times(&other),
            ];
            let mut arches = vec![pulp::Arch::Scalar, pulp::Arch::new()];
            #[cfg(target_arch = "x86_64")]
            arches.extend(pulp::x86::V3::try_new().map(pulp::Arch::V3));
            for (arch, finish) in arches.into_iter().flat_map(|a| finishes.map(|f| (a, f))) {
                let mut c = vec![0.0; rows * width];
                let mut d = start.clone();
                let both = Both { a: &a, b: &panels, bias: &bias, finish, c: &mut c, d: &mut d, inner };
                arch.dispatch(both);
                for (at, &found) in c.iter().enumerate() {
                    let (s, j) = (at / width, at % width);
                    let sum: f64 = (0..inner)
                        .map(|i| f64::from(a[s * inner + i]) * f64::from(b[i * width + j]))
                        .sum::<f64>()
                        + f64::from(bias[j]);
                    let truth = match finish {
                        Finish::Plain => sum,
                        Finish::Rectify(below) => sum.max(f64::from(below) * sum),
                        Finish::Where { signs, below } if signs[at] <= 0.0 => f64::from(below) * sum,
                        Finish::Where { .. } => sum,
                        Finish::Times(factors) => sum * f64::from(factors[at]),
                    };
                    assert!((f64::from(found) - truth).abs() < 1e-5, "{finish:?}");
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
