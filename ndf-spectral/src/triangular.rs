//! Solves with a supernodal factor for several right-hand sides at once.
//!
//! A supernode is a set of consecutive columns with the same rows below them: a dense trapezoid. With the right-hand
//! sides stored row by row, each entry of the factor is read once in each direction and used for all of them. The
//! triangles on the diagonal are inverted once after factoring (Du Croz and Higham 1992, "Stability of methods for
//! matrix inversion"): a solve then consists of products alone, in which no row waits for the row before, and which go
//! by tiles of rows or columns whose sums stay in registers.

#![allow(clippy::needless_range_loop, reason = "loops of a known length over registers")]

use faer::Par;
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::mat::{Mat, MatRef};
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::Simd;

use crate::simd::{self, Kernel, Row};

/// Where one trapezoid of a factor lies.
struct Supernode<'a> {
    /// Its first column.
    start: usize,
    /// Its columns.
    columns: usize,
    /// Rows below the triangle.
    rows: &'a [usize],
    /// Where its entries begin, column by column, the triangle first in each.
    values: usize,
}

impl<'a> Supernode<'a> {
    #[inline(always)]
    fn new(structure: &'a SymbolicSupernodalCholesky<usize>, s: usize) -> Self {
        let start = structure.supernode_begin()[s];
        Self {
            start,
            columns: structure.supernode_end()[s] - start,
            rows: &structure.row_idx()[structure.col_ptr_for_row_idx()[s]..][..structure.nnz_per_super()[s]],
            values: structure.col_ptr_for_val()[s],
        }
    }

    /// Rows of the trapezoid: from one column to the next.
    #[inline(always)]
    fn height(&self) -> usize {
        self.columns + self.rows.len()
    }

    /// The entries.
    #[inline(always)]
    fn entries<'v>(&self, values: &'v [f64]) -> &'v [f64] {
        &values[self.values..][..self.columns * self.height()]
    }
}

/// Replaces the triangles of all supernodes by their inverses, with zeros above the diagonal. O(columns³) each.
pub(crate) fn invert_triangles(structure: &SymbolicSupernodalCholesky<usize>, values: &mut [f64]) {
    let widest = (0..structure.n_supernodes()).map(|s| Supernode::new(structure, s).columns).max();
    let mut inverse = Mat::zeros(widest.unwrap_or(0), widest.unwrap_or(0));
    for s in 0..structure.n_supernodes() {
        let node = Supernode::new(structure, s);
        let (columns, height) = (node.columns, node.height());
        let entries = &mut values[node.values..][..columns * height];
        let triangle = MatRef::from_column_major_slice_with_stride(entries, columns, columns, height);
        let mut inverse = inverse.submatrix_mut(0, 0, columns, columns);
        invert_lower_triangular(inverse.as_mut(), triangle, Par::Seq);
        for j in 0..columns {
            for i in 0..columns {
                entries[j * height + i] = if i < j { 0.0 } else { inverse[(i, j)] };
            }
        }
    }
}

/// Cuts a range into tiles, the largest first: where each begins, and how long it is.
#[inline(always)]
fn tiles(count: usize) -> impl Iterator<Item = (usize, usize)> {
    let mut next = 0;
    std::iter::from_fn(move || {
        let size = match count - next {
            0 => return None,
            1..4 => 1,
            4..8 => 4,
            _ => 8,
        };
        next += size;
        Some((next - size, size))
    })
}

impl Supernode<'_> {
    /// Applies the triangle's inverse and takes the part of the columns from the rows below.
    #[inline(always)]
    fn forward<S: Simd, const V: usize>(&self, simd: S, values: &[f64], x: &mut [Row]) {
        let (head, tail) = x.split_at_mut(self.start + self.columns);
        let own = &mut head[self.start..];
        let (entries, height) = (self.entries(values), self.height());
        // From the last row up: each needs only rows above it, which are still to be replaced.
        for (above, size) in tiles(self.columns) {
            let end = self.columns - above;
            match size {
                8 => replace_rows::<S, V, 8>(simd, entries, height, &mut own[..end]),
                4 => replace_rows::<S, V, 4>(simd, entries, height, &mut own[..end]),
                _ => replace_rows::<S, V, 1>(simd, entries, height, &mut own[..end]),
            }
        }
        let below = &entries[self.columns..];
        for (first, size) in tiles(self.rows.len()) {
            let (entries, rows) = (&below[first..], &self.rows[first..][..size]);
            let tail = Tail { rows: &mut *tail, offset: self.start + self.columns };
            match size {
                8 => subtract_from_rows::<S, V, 8>(simd, entries, height, own, tail, rows),
                4 => subtract_from_rows::<S, V, 4>(simd, entries, height, own, tail, rows),
                _ => subtract_from_rows::<S, V, 1>(simd, entries, height, own, tail, rows),
            }
        }
    }

    /// Takes the part of the rows below from the columns and applies the transpose of the triangle's inverse.
    #[inline(always)]
    fn backward<S: Simd, const V: usize>(&self, simd: S, values: &[f64], x: &mut [Row]) {
        let (head, tail) = x.split_at_mut(self.start + self.columns);
        let own = &mut head[self.start..];
        let entries = self.entries(values);
        for (first, size) in tiles(self.columns) {
            match size {
                8 => self.subtract_rows_below::<S, V, 8>(simd, entries, first, own, tail),
                4 => self.subtract_rows_below::<S, V, 4>(simd, entries, first, own, tail),
                _ => self.subtract_rows_below::<S, V, 1>(simd, entries, first, own, tail),
            }
        }
        // From the first row down: each needs only rows from its own on.
        for (first, size) in tiles(self.columns) {
            match size {
                8 => self.replace_by_columns::<S, V, 8>(simd, entries, first, own),
                4 => self.replace_by_columns::<S, V, 4>(simd, entries, first, own),
                _ => self.replace_by_columns::<S, V, 1>(simd, entries, first, own),
            }
        }
    }

    /// `T` columns from some row on to another.
    #[inline(always)]
    fn columns<'v, const T: usize>(
        &self,
        entries: &'v [f64],
        first: usize,
        rows: std::ops::Range<usize>,
    ) -> [&'v [f64]; T] {
        std::array::from_fn(|t| &entries[(first + t) * self.height()..][rows.clone()])
    }

    /// Takes from `T` functions' rows the products of their columns with the rows below.
    #[inline(always)]
    fn subtract_rows_below<S: Simd, const V: usize, const T: usize>(
        &self,
        simd: S,
        entries: &[f64],
        first: usize,
        own: &mut [Row],
        tail: &[Row],
    ) {
        let below = self.columns::<T>(entries, first, self.columns..self.height());
        let mut sums = [simd::zero::<S, V>(simd); T];
        for (i, &row) in self.rows.iter().enumerate() {
            let x = simd::load::<S, V>(simd, &tail[row - self.start - self.columns]);
            for t in 0..T {
                sums[t] = simd::add(simd, sums[t], below[t][i], x);
            }
        }
        for t in 0..T {
            subtract::<S, V>(simd, &mut own[first + t], sums[t]);
        }
    }

    /// Replaces `T` rows by the products of their columns in the triangle with all rows from there on.
    #[inline(always)]
    fn replace_by_columns<S: Simd, const V: usize, const T: usize>(
        &self,
        simd: S,
        entries: &[f64],
        first: usize,
        own: &mut [Row],
    ) {
        let triangle = self.columns::<T>(entries, first, first..self.columns);
        let mut sums = [simd::zero::<S, V>(simd); T];
        for (i, row) in own[first..].iter().enumerate() {
            let x = simd::load::<S, V>(simd, row);
            for t in 0..T {
                sums[t] = simd::add(simd, sums[t], triangle[t][i], x);
            }
        }
        for t in 0..T {
            simd::store::<S, V>(&mut own[first + t], sums[t]);
        }
    }
}

/// Replaces the last `T` of some rows by the products of the same rows of a matrix with all of them.
#[inline(always)]
fn replace_rows<S: Simd, const V: usize, const T: usize>(
    simd: S,
    entries: &[f64],
    height: usize,
    functions: &mut [Row],
) {
    let first = functions.len() - T;
    let sums = products::<S, V, T>(simd, &entries[first..], height, functions);
    for t in 0..T {
        simd::store::<S, V>(&mut functions[first + t], sums[t]);
    }
}

/// The rows after those of a supernode.
struct Tail<'a> {
    rows: &'a mut [Row],
    /// The number of the first.
    offset: usize,
}

/// Takes from `T` rows the products of as many rows of a matrix with functions.
#[inline(always)]
fn subtract_from_rows<S: Simd, const V: usize, const T: usize>(
    simd: S,
    entries: &[f64],
    height: usize,
    functions: &[Row],
    tail: Tail<'_>,
    rows: &[usize],
) {
    let sums = products::<S, V, T>(simd, entries, height, functions);
    for t in 0..T {
        subtract::<S, V>(simd, &mut tail.rows[rows[t] - tail.offset], sums[t]);
    }
}

/// Products of `T` rows of a matrix with functions; columns are `height` entries apart.
#[inline(always)]
fn products<S: Simd, const V: usize, const T: usize>(
    simd: S,
    entries: &[f64],
    height: usize,
    functions: &[Row],
) -> [[S::f64s; V]; T] {
    let mut sums = [simd::zero::<S, V>(simd); T];
    for (j, function) in functions.iter().enumerate() {
        let entries = &entries[j * height..][..T];
        let x = simd::load::<S, V>(simd, function);
        for t in 0..T {
            sums[t] = simd::add(simd, sums[t], entries[t], x);
        }
    }
    sums
}

/// `target −= x` in memory.
#[inline(always)]
fn subtract<S: Simd, const V: usize>(simd: S, target: &mut Row, x: [S::f64s; V]) {
    let difference = simd::add(simd, simd::load::<S, V>(simd, target), -1.0, x);
    simd::store::<S, V>(target, difference);
}

/// Solves `L D Lᵀ x = b`, in the order of the factor, whose triangles are [inverted](invert_triangles); `b` is replaced
/// by `x`. Without pivots D is the identity.
pub(crate) fn solve(
    structure: &SymbolicSupernodalCholesky<usize>,
    values: &[f64],
    pivots: &[f64],
    x: &mut [Row],
) {
    simd::run(Solve { structure, values, pivots, x });
}

struct Solve<'a> {
    structure: &'a SymbolicSupernodalCholesky<usize>,
    values: &'a [f64],
    pivots: &'a [f64],
    x: &'a mut [Row],
}

impl Kernel for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        for s in 0..self.structure.n_supernodes() {
            Supernode::new(self.structure, s).forward::<S, V>(simd, self.values, self.x);
        }
        for (row, pivot) in self.x.iter_mut().zip(self.pivots) {
            row.0.iter_mut().for_each(|x| *x /= pivot);
        }
        for s in (0..self.structure.n_supernodes()).rev() {
            Supernode::new(self.structure, s).backward::<S, V>(simd, self.values, self.x);
        }
    }
}
