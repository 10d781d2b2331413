//! One right-hand side: entries of the columns of the factor fill the vectors.

#![allow(clippy::needless_range_loop, reason = "loops of a known length over registers")]

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::Simd;

use super::Supernode;
use crate::scalar::Scalar;
use crate::simd::{self, Kernel};

/// Columns whose entries meet a vector at once.
const COLUMNS: usize = 4;

/// Solves `L Lᴴ x = b`, in the order of the factor, whose triangles are [inverted](super::invert_triangles); `b` is replaced by `x`.
pub(crate) fn solve<T: Scalar>(structure: &SymbolicSupernodalCholesky<usize>, values: &[T], x: &mut [T]) {
    simd::run(Solve { structure, values, x });
}

struct Solve<'a, T> {
    structure: &'a SymbolicSupernodalCholesky<usize>,
    values: &'a [T],
    x: &'a mut [T],
}

impl<T: Scalar> Kernel for Solve<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        let nodes = 0..self.structure.n_supernodes();
        let tallest = nodes.clone().map(|s| Supernode::new(self.structure, s).height()).max();
        let mut part = vec![T::default(); tallest.unwrap_or(0)];
        for s in nodes.clone() {
            Supernode::new(self.structure, s).forward_single(simd, self.values, self.x, &mut part);
        }
        for s in nodes.rev() {
            Supernode::new(self.structure, s).backward_single(simd, self.values, self.x, &mut part);
        }
    }
}

impl Supernode<'_> {
    /// Applies the triangle's inverse and takes the part of the columns from the rows below.
    #[inline(always)]
    fn forward_single<T: Scalar, S: Simd>(&self, simd: S, values: &[T], x: &mut [T], part: &mut [T]) {
        let (entries, height) = (self.entries(values), self.height());
        let own = &mut x[self.start..][..self.columns];
        let part = &mut part[..height];
        part.fill(T::default());
        let (triangle, below) = part.split_at_mut(self.columns);
        for (first, size) in tiles(self.columns) {
            let (entries, sum) = (&entries[first * height + first..], &mut triangle[first..]);
            match size {
                COLUMNS => add_columns::<T, S, COLUMNS>(simd, entries, height, &own[first..], sum),
                _ => add_columns::<T, S, 1>(simd, entries, height, &own[first..], sum),
            }
        }
        own.copy_from_slice(triangle);
        for (first, size) in tiles(self.columns) {
            let entries = &entries[first * height + self.columns..];
            match size {
                COLUMNS => add_columns::<T, S, COLUMNS>(simd, entries, height, &own[first..], below),
                _ => add_columns::<T, S, 1>(simd, entries, height, &own[first..], below),
            }
        }
        for (&row, &sum) in self.rows.iter().zip(&*below) {
            x[row] -= sum;
        }
    }

    /// Takes the part of the rows below from the columns and applies the adjoint of the triangle's inverse.
    #[inline(always)]
    fn backward_single<T: Scalar, S: Simd>(&self, simd: S, values: &[T], x: &mut [T], part: &mut [T]) {
        let (entries, height) = (self.entries(values), self.height());
        let below = &mut part[..self.rows.len()];
        for (value, &row) in below.iter_mut().zip(self.rows) {
            *value = x[row];
        }
        let own = &mut x[self.start..][..self.columns];
        for (first, size) in tiles(self.columns) {
            let entries = &entries[first * height + self.columns..];
            match size {
                COLUMNS => {
                    let products = column_products::<T, S, COLUMNS>(simd, entries, height, below);
                    own[first..].iter_mut().zip(products).for_each(|(x, product)| *x -= product);
                }
                _ => own[first] -= column_products::<T, S, 1>(simd, entries, height, below)[0],
            }
        }
        // From the first row down: each needs only rows from its own on.
        for (first, size) in tiles(self.columns) {
            let entries = &entries[first * height + first..];
            match size {
                COLUMNS => {
                    let products = column_products::<T, S, COLUMNS>(simd, entries, height, &own[first..]);
                    own[first..][..COLUMNS].copy_from_slice(&products);
                }
                _ => own[first] = column_products::<T, S, 1>(simd, entries, height, &own[first..])[0],
            }
        }
    }
}

/// Cuts columns into tiles of [`COLUMNS`] and of one: where each begins, and how many it has.
#[inline(always)]
fn tiles(columns: usize) -> impl Iterator<Item = (usize, usize)> {
    let whole = columns - columns % COLUMNS;
    (0..whole).step_by(COLUMNS).map(|first| (first, COLUMNS)).chain((whole..columns).map(|first| (first, 1)))
}

/// Adds to a sum the products of `N` columns, `height` entries apart, with as many factors.
#[inline(always)]
fn add_columns<T: Scalar, S: Simd, const N: usize>(
    simd: S,
    entries: &[T],
    height: usize,
    factors: &[T],
    sum: &mut [T],
) {
    let rows = sum.len();
    let (sums, rest) = T::vectors_mut::<S>(sum);
    let mut columns = [(&[] as &[T::Vector<S>], &[] as &[T]); N];
    let mut splat = [T::splat(simd, T::default()); N];
    for t in 0..N {
        let (whole, part) = T::vectors::<S>(&entries[t * height..][..rows]);
        columns[t] = (&whole[..sums.len()], &part[..rest.len()]);
        splat[t] = T::splat(simd, factors[t]);
    }
    for i in 0..sums.len() {
        let mut sum = sums[i];
        for t in 0..N {
            sum = T::mul_add(simd, splat[t], columns[t].0[i], sum);
        }
        sums[i] = sum;
    }
    for i in 0..rest.len() {
        for t in 0..N {
            rest[i] += factors[t] * columns[t].1[i];
        }
    }
}

/// The products of the conjugates of `N` columns, `height` entries apart, with a vector.
#[inline(always)]
fn column_products<T: Scalar, S: Simd, const N: usize>(
    simd: S,
    entries: &[T],
    height: usize,
    vector: &[T],
) -> [T; N] {
    let (vectors, rest) = T::vectors::<S>(vector);
    let mut columns = [(&[] as &[T::Vector<S>], &[] as &[T]); N];
    for t in 0..N {
        let (whole, part) = T::vectors::<S>(&entries[t * height..][..vector.len()]);
        columns[t] = (&whole[..vectors.len()], &part[..rest.len()]);
    }
    let mut sums = [T::splat(simd, T::default()); N];
    for i in 0..vectors.len() {
        for t in 0..N {
            sums[t] = T::conj_mul_add(simd, columns[t].0[i], vectors[i], sums[t]);
        }
    }
    let mut products = [T::default(); N];
    for t in 0..N {
        products[t] = T::reduce(simd, sums[t]);
        for i in 0..rest.len() {
            products[t] += columns[t].1[i].conjugate() * rest[i];
        }
    }
    products
}
