//! Blocks of four functions on the vertices, stored vertex by vertex: a factor, a mass matrix or a basis is read once for
//! all four.
//!
//! Work is cut into slices of rows of a fixed size and their results are summed in order, so that they do not
//! depend on the number of threads.

#![allow(clippy::needless_range_loop, reason = "loops of a known length over registers")]

use std::ops::Range;

use faer::Mat;
use pulp::Simd;
use rayon::prelude::*;

use crate::csr::CsrMatrix;
use crate::simd::{self, Kernel};
pub(crate) use crate::simd::{Row, WIDTH};

/// Rows a thread works on at a time: slices of some dozen panels fit the second cache of a core.
const SLICE: usize = 512;

/// Four functions.
pub(crate) type Panel = Vec<Row>;

/// `matrix · panel`. O(entries).
pub(crate) fn multiply(matrix: &CsrMatrix, panel: &[Row], product: &mut Panel) {
    product.resize(matrix.row_count(), Row::default());
    product.par_chunks_mut(SLICE).enumerate().for_each(|(slice, product)| {
        simd::run(Multiply { matrix, panel, first: slice * SLICE, product });
    });
}

struct Multiply<'a> {
    matrix: &'a CsrMatrix,
    panel: &'a [Row],
    /// The row of the matrix that the first of the product is for.
    first: usize,
    product: &'a mut [Row],
}

impl Kernel for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        let (columns, values) = (self.matrix.columns(), self.matrix.values());
        let offsets = self.matrix.offsets()[self.first..].windows(2);
        for (row, range) in self.product.iter_mut().zip(offsets) {
            let range = range[0]..range[1];
            let mut sum = simd::zero::<S, V>(simd);
            for (&value, &column) in values[range.clone()].iter().zip(&columns[range]) {
                sum = simd::add(simd, sum, value, simd::load(simd, &self.panel[column]));
            }
            simd::store::<S, V>(row, sum);
        }
    }
}

/// `(a₁, a₂, …)ᵀ b`: inner products of all functions. O(n · functions).
pub(crate) fn products(a: &[Panel], b: &[Row]) -> Mat<f64> {
    summed(b.len(), |range| slice_products(a, &b[range.clone()], range))
}

/// `(a₁, a₂, …)ᵀ matrix (b₁, b₂, …)`. The products with the matrix never leave the cache. O(n · functions²).
pub(crate) fn products_through(matrix: &CsrMatrix, a: &[Panel], b: &[Panel]) -> Mat<f64> {
    let rows = b.first().map_or(0, Vec::len);
    summed(rows, |range| {
        let mut image = vec![Row::default(); range.len()];
        let mut sums = Mat::zeros(a.len() * WIDTH, b.len() * WIDTH);
        for (j, panel) in b.iter().enumerate() {
            simd::run(Multiply { matrix, panel, first: range.start, product: &mut image });
            let block = slice_products(a, &image, range.clone());
            sums.subcols_mut(j * WIDTH, WIDTH).copy_from(&block);
        }
        sums
    })
}

/// The inner product of every function with its counterpart. O(n).
pub(crate) fn inner_products(a: &[Row], b: &[Row]) -> Row {
    let slices: Vec<Row> = a
        .par_chunks(SLICE)
        .zip(b.par_chunks(SLICE))
        .map(|(a, b)| {
            let mut sum = [0.0; WIDTH];
            for (a, b) in a.iter().zip(b) {
                (0..WIDTH).for_each(|c| sum[c] += a.0[c] * b.0[c]);
            }
            Row(sum)
        })
        .collect();
    slices.iter().fold(Row::default(), |sum, slice| Row(std::array::from_fn(|c| sum.0[c] + slice.0[c])))
}

/// `target += factors · functions`, a factor for each function. O(n).
pub(crate) fn add_scaled(target: &mut [Row], factors: Row, functions: &[Row]) {
    on_rows(target, functions, |target, row| {
        (0..WIDTH).for_each(|c| target.0[c] += factors.0[c] * row.0[c]);
    });
}

/// `target ← factors · target + functions`, a factor for each function. O(n).
pub(crate) fn scaled_sum(target: &mut [Row], factors: Row, functions: &[Row]) {
    on_rows(target, functions, |target, row| {
        (0..WIDTH).for_each(|c| target.0[c] = factors.0[c] * target.0[c] + row.0[c]);
    });
}

/// `target ← keep · target + factor · diagonal · functions`. O(n).
pub(crate) fn scale_rows(target: &mut [Row], keep: f64, factor: f64, diagonal: &[f64], functions: &[Row]) {
    target.par_chunks_mut(SLICE).zip(diagonal.par_chunks(SLICE)).zip(functions.par_chunks(SLICE)).for_each(
        |((target, diagonal), functions)| {
            for ((target, d), row) in target.iter_mut().zip(diagonal).zip(functions) {
                let factor = factor * d;
                (0..WIDTH).for_each(|c| target.0[c] = keep * target.0[c] + factor * row.0[c]);
            }
        },
    );
}

/// Changes every row of a panel by that of another.
fn on_rows(target: &mut [Row], functions: &[Row], change: impl Fn(&mut Row, &Row) + Sync) {
    target.par_chunks_mut(SLICE).zip(functions.par_chunks(SLICE)).for_each(|(target, functions)| {
        target.iter_mut().zip(functions).for_each(|(target, row)| change(target, row));
    });
}

/// The sum of a matrix for every slice of some rows, in the order of the slices.
fn summed(rows: usize, slice: impl Fn(Range<usize>) -> Mat<f64> + Sync) -> Mat<f64> {
    let slices: Vec<Mat<f64>> = (0..rows.div_ceil(SLICE))
        .into_par_iter()
        .map(|number| slice(number * SLICE..rows.min((number + 1) * SLICE)))
        .collect();
    let mut slices = slices.into_iter();
    let first = slices.next().unwrap_or_else(Mat::new);
    slices.fold(first, |mut sum, slice| {
        sum += slice;
        sum
    })
}

/// Inner products of a slice of functions with rows of others.
fn slice_products(a: &[Panel], b: &[Row], range: Range<usize>) -> Mat<f64> {
    let mut sums = Mat::zeros(a.len() * WIDTH, WIDTH);
    for (i, a) in a.iter().enumerate() {
        let block = simd::run(Products { a: &a[range.clone()], b });
        for (r, row) in block.iter().enumerate() {
            for (c, value) in row.0.iter().enumerate() {
                sums[(i * WIDTH + r, c)] = *value;
            }
        }
    }
    sums
}

struct Products<'a> {
    a: &'a [Row],
    b: &'a [Row],
}

impl Kernel for Products<'_> {
    type Output = [Row; WIDTH];

    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) -> Self::Output {
        let mut sums = [simd::zero::<S, V>(simd); WIDTH];
        for (a, b) in self.a.iter().zip(self.b) {
            let b = simd::load::<S, V>(simd, b);
            for i in 0..WIDTH {
                sums[i] = simd::add(simd, sums[i], a.0[i], b);
            }
        }
        let mut rows = [Row::default(); WIDTH];
        for i in 0..WIDTH {
            simd::store::<S, V>(&mut rows[i], sums[i]);
        }
        rows
    }
}

/// `target += factor · (a₁, a₂, …) · coefficients`. O(n · functions).
pub(crate) fn add_combination(target: &mut Panel, factor: f64, a: &[Panel], coefficients: &Mat<f64>) {
    debug_assert_eq!((coefficients.nrows(), coefficients.ncols()), (a.len() * WIDTH, WIDTH));
    let blocks: Vec<[Row; WIDTH]> = (0..a.len()).map(|i| block(coefficients, i, 0, factor)).collect();
    target.par_chunks_mut(SLICE).enumerate().for_each(|(slice, target)| {
        for (a, block) in a.iter().zip(&blocks) {
            let a = &a[slice * SLICE..][..target.len()];
            simd::run(Combination { target: &mut *target, a, block });
        }
    });
}

/// Block (i, j) of coefficients times a factor, zero where they end.
fn block(coefficients: &Mat<f64>, i: usize, j: usize, factor: f64) -> [Row; WIDTH] {
    let entry = |r, c| {
        let (r, c) = (i * WIDTH + r, j * WIDTH + c);
        let inside = r < coefficients.nrows() && c < coefficients.ncols();
        if inside { factor * coefficients[(r, c)] } else { 0.0 }
    };
    std::array::from_fn(|r| Row(std::array::from_fn(|c| entry(r, c))))
}

/// `(a₁, a₂, …) ← (a₁, a₂, …) · coefficients`: as many functions as the coefficients have columns, no more than there
/// were, up to zeros at the end. In place. O(n · functions²).
pub(crate) fn transform(a: &mut Vec<Panel>, coefficients: &Mat<f64>) {
    debug_assert!(coefficients.nrows() <= a.len() * WIDTH && coefficients.ncols() <= a.len() * WIDTH);
    let results = coefficients.ncols().div_ceil(WIDTH);
    let column = |j| (0..a.len()).map(|i| block(coefficients, i, j, 1.0)).collect();
    let blocks: Vec<Vec<[Row; WIDTH]>> = (0..results).map(column).collect();
    let mut slices: Vec<Vec<&mut [Row]>> = Vec::new();
    for panel in &mut *a {
        for (slice, rows) in panel.chunks_mut(SLICE).enumerate() {
            if slice == slices.len() {
                slices.push(Vec::new());
            }
            slices[slice].push(rows);
        }
    }
    slices.into_par_iter().for_each(|mut panels| {
        let rows = panels.first().map_or(0, |rows| rows.len());
        let mut transformed = vec![Row::default(); rows * results];
        for (target, blocks) in transformed.chunks_mut(rows).zip(&blocks) {
            for (a, block) in panels.iter().zip(blocks) {
                simd::run(Combination { target: &mut *target, a, block });
            }
        }
        panels.iter_mut().zip(transformed.chunks(rows)).for_each(|(rows, new)| rows.copy_from_slice(new));
    });
    a.truncate(results);
}

struct Combination<'a> {
    target: &'a mut [Row],
    a: &'a [Row],
    block: &'a [Row; WIDTH],
}

impl Kernel for Combination<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        let mut block = [simd::zero::<S, V>(simd); WIDTH];
        for i in 0..WIDTH {
            block[i] = simd::load(simd, &self.block[i]);
        }
        for (target, a) in self.target.iter_mut().zip(self.a) {
            // Two sums, so that an addition need not wait for the one before.
            let mut sums = [simd::load::<S, V>(simd, target), simd::zero(simd)];
            for i in 0..WIDTH {
                sums[i % 2] = simd::add(simd, sums[i % 2], a.0[i], block[i]);
            }
            simd::store::<S, V>(target, simd::add(simd, sums[0], 1.0, sums[1]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::symmetric;
    use crate::orthonormal::Random;
    use approx::assert_relative_eq;

    fn random_panels(count: usize, rows: usize) -> (Vec<Panel>, Mat<f64>) {
        let mut random = Random::default();
        let panels: Vec<Panel> = (0..count)
            .map(|_| (0..rows).map(|_| Row(std::array::from_fn(|_| random.next()))).collect())
            .collect();
        let dense = Mat::from_fn(rows, count * WIDTH, |i, j| panels[j / WIDTH][i].0[j % WIDTH]);
        (panels, dense)
    }

    #[test]
    fn products_and_combinations_are_those_of_matrices() {
        let (panels, dense) = random_panels(3, 2 * SLICE + 17);
        let rows = dense.nrows();
        let product = dense.transpose() * dense.subcols(WIDTH, 2 * WIDTH);
        let close = |a: &Mat<f64>, b: &Mat<f64>| assert!((a - b).norm_max() < 1e-9);
        close(&products(&panels, &panels[1]), &product.subcols(0, WIDTH).to_owned());
        let twice = symmetric(&vec![2.0; rows], std::iter::empty());
        close(&products_through(&twice, &panels, &panels[1..]), &(&product + &product));
        let coefficients = Mat::from_fn(3 * WIDTH, 11, |i, j| (i * j) as f64 - 3.0 * i as f64);
        let mut combined = panels.clone();
        transform(&mut combined, &coefficients);
        assert_eq!(combined.len(), 11_usize.div_ceil(WIDTH));
        let expected = &dense * &coefficients;
        for (i, j) in [(0, 0), (5, 10), (SLICE + 1, 7), (2 * SLICE + 16, 8)] {
            assert_relative_eq!(combined[j / WIDTH][i].0[j % WIDTH], expected[(i, j)], epsilon = 1e-9);
        }
    }
}
