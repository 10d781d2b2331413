//! Panels of right-hand sides, stored row by row: each entry of the factor is read once in each direction and used for all of them, and
//! sums of tiles of rows or columns stay in registers.

#![allow(clippy::needless_range_loop, reason = "loops of a known length over registers")]

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::Simd;

use super::Supernode;
use crate::scalar::{Entry, Scalar};
use crate::simd::{self, Kernel, Row};

/// Cuts a range into tiles, the largest first: where each begins, and how long it is.
#[inline(always)]
fn tiles<T: Entry>(count: usize) -> impl Iterator<Item = (usize, usize)> {
    let mut next = 0;
    std::iter::from_fn(move || {
        let size = match count - next {
            0 => return None,
            1..4 => 1,
            4..8 => 4,
            _ => T::TILE,
        };
        next += size;
        Some((next - size, size))
    })
}

impl Supernode<'_> {
    /// Applies the triangle's inverse and takes the part of the columns from the rows below.
    #[inline(always)]
    fn forward<T: Scalar, S: Simd, const V: usize>(&self, simd: S, values: &[T], x: &mut [Row]) {
        let (head, tail) = x.split_at_mut(self.start + self.columns);
        let own = &mut head[self.start..];
        let (entries, height) = (self.entries(values), self.height());
        // From the last row up: each needs only rows above it, which are still to be replaced.
        for (above, size) in tiles::<T>(self.columns) {
            let end = self.columns - above;
            match size {
                8 => replace_rows::<T, S, V, 8>(simd, entries, height, &mut own[..end]),
                4 => replace_rows::<T, S, V, 4>(simd, entries, height, &mut own[..end]),
                _ => replace_rows::<T, S, V, 1>(simd, entries, height, &mut own[..end]),
            }
        }
        let below = &entries[self.columns..];
        for (first, size) in tiles::<T>(self.rows.len()) {
            let (entries, rows) = (&below[first..], &self.rows[first..][..size]);
            let tail = Tail { rows: &mut *tail, offset: self.start + self.columns };
            match size {
                8 => subtract_from_rows::<T, S, V, 8>(simd, entries, height, own, tail, rows),
                4 => subtract_from_rows::<T, S, V, 4>(simd, entries, height, own, tail, rows),
                _ => subtract_from_rows::<T, S, V, 1>(simd, entries, height, own, tail, rows),
            }
        }
    }

    /// Takes the part of the rows below from the columns and applies the adjoint of the triangle's inverse.
    #[inline(always)]
    fn backward<T: Scalar, S: Simd, const V: usize>(&self, simd: S, values: &[T], x: &mut [Row]) {
        let (head, tail) = x.split_at_mut(self.start + self.columns);
        let own = &mut head[self.start..];
        let entries = self.entries(values);
        for (first, size) in tiles::<T>(self.columns) {
            match size {
                8 => self.subtract_rows_below::<T, S, V, 8>(simd, entries, first, own, tail),
                4 => self.subtract_rows_below::<T, S, V, 4>(simd, entries, first, own, tail),
                _ => self.subtract_rows_below::<T, S, V, 1>(simd, entries, first, own, tail),
            }
        }
        // From the first row down: each needs only rows from its own on.
        for (first, size) in tiles::<T>(self.columns) {
            match size {
                8 => self.replace_by_columns::<T, S, V, 8>(simd, entries, first, own),
                4 => self.replace_by_columns::<T, S, V, 4>(simd, entries, first, own),
                _ => self.replace_by_columns::<T, S, V, 1>(simd, entries, first, own),
            }
        }
    }

    /// `N` columns from some row on to another.
    #[inline(always)]
    fn columns<'v, T, const N: usize>(
        &self,
        entries: &'v [T],
        first: usize,
        rows: std::ops::Range<usize>,
    ) -> [&'v [T]; N] {
        std::array::from_fn(|t| &entries[(first + t) * self.height()..][rows.clone()])
    }

    /// Takes from `N` functions' rows the products of their columns with the rows below.
    #[inline(always)]
    fn subtract_rows_below<T: Scalar, S: Simd, const V: usize, const N: usize>(
        &self,
        simd: S,
        entries: &[T],
        first: usize,
        own: &mut [Row],
        tail: &[Row],
    ) {
        let below = self.columns::<T, N>(entries, first, self.columns..self.height());
        let mut sums = [T::none::<S, V>(simd); N];
        for (i, &row) in self.rows.iter().enumerate() {
            let x = simd::load::<S, V>(simd, &tail[row - self.start - self.columns]);
            for t in 0..N {
                sums[t] = below[t][i].add_product(simd, sums[t], x);
            }
        }
        for t in 0..N {
            subtract::<S, V>(simd, &mut own[first + t], T::total(simd, sums[t], true));
        }
    }

    /// Replaces `N` rows by the products of their columns in the triangle with all rows from there on.
    #[inline(always)]
    fn replace_by_columns<T: Scalar, S: Simd, const V: usize, const N: usize>(
        &self,
        simd: S,
        entries: &[T],
        first: usize,
        own: &mut [Row],
    ) {
        let triangle = self.columns::<T, N>(entries, first, first..self.columns);
        let mut sums = [T::none::<S, V>(simd); N];
        for (i, row) in own[first..].iter().enumerate() {
            let x = simd::load::<S, V>(simd, row);
            for t in 0..N {
                sums[t] = triangle[t][i].add_product(simd, sums[t], x);
            }
        }
        for t in 0..N {
            simd::store::<S, V>(&mut own[first + t], T::total(simd, sums[t], true));
        }
    }
}

/// Replaces the last `N` of some rows by the products of the same rows of a matrix with all of them.
#[inline(always)]
fn replace_rows<T: Scalar, S: Simd, const V: usize, const N: usize>(
    simd: S,
    entries: &[T],
    height: usize,
    functions: &mut [Row],
) {
    let first = functions.len() - N;
    let sums = products::<T, S, V, N>(simd, &entries[first..], height, functions);
    for t in 0..N {
        simd::store::<S, V>(&mut functions[first + t], sums[t]);
    }
}

/// The rows after those of a supernode.
struct Tail<'a> {
    rows: &'a mut [Row],
    /// The number of the first.
    offset: usize,
}

/// Takes from `N` rows the products of as many rows of a matrix with functions.
#[inline(always)]
fn subtract_from_rows<T: Scalar, S: Simd, const V: usize, const N: usize>(
    simd: S,
    entries: &[T],
    height: usize,
    functions: &[Row],
    tail: Tail<'_>,
    rows: &[usize],
) {
    let sums = products::<T, S, V, N>(simd, entries, height, functions);
    for t in 0..N {
        subtract::<S, V>(simd, &mut tail.rows[rows[t] - tail.offset], sums[t]);
    }
}

/// Products of `N` rows of a matrix with functions; columns are `height` entries apart.
#[inline(always)]
fn products<T: Scalar, S: Simd, const V: usize, const N: usize>(
    simd: S,
    entries: &[T],
    height: usize,
    functions: &[Row],
) -> [[S::f64s; V]; N] {
    let mut sums = [T::none::<S, V>(simd); N];
    for (j, function) in functions.iter().enumerate() {
        let entries = &entries[j * height..][..N];
        let x = simd::load::<S, V>(simd, function);
        for t in 0..N {
            sums[t] = entries[t].add_product(simd, sums[t], x);
        }
    }
    let mut totals = [simd::zero::<S, V>(simd); N];
    for t in 0..N {
        totals[t] = T::total(simd, sums[t], false);
    }
    totals
}

/// `target −= x` in memory.
#[inline(always)]
fn subtract<S: Simd, const V: usize>(simd: S, target: &mut Row, x: [S::f64s; V]) {
    let difference = simd::add(simd, simd::load::<S, V>(simd, target), -1.0, x);
    simd::store::<S, V>(target, difference);
}

/// Solves `L D Lᴴ x = b`, in the order of the factor, whose triangles are [inverted](super::invert_triangles); `b` is replaced
/// by `x`. Without pivots D is the identity.
pub(crate) fn solve<T: Scalar>(
    structure: &SymbolicSupernodalCholesky<usize>,
    values: &[T],
    pivots: &[f64],
    x: &mut [Row],
) {
    simd::run(Solve { structure, values, pivots, x });
}

struct Solve<'a, T> {
    structure: &'a SymbolicSupernodalCholesky<usize>,
    values: &'a [T],
    pivots: &'a [f64],
    x: &'a mut [Row],
}

impl<T: Scalar> Kernel for Solve<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        for s in 0..self.structure.n_supernodes() {
            Supernode::new(self.structure, s).forward::<T, S, V>(simd, self.values, self.x);
        }
        for (row, pivot) in self.x.iter_mut().zip(self.pivots) {
            row.0.iter_mut().for_each(|x| *x /= pivot);
        }
        for s in (0..self.structure.n_supernodes()).rev() {
            Supernode::new(self.structure, s).backward::<T, S, V>(simd, self.values, self.x);
        }
    }
}
