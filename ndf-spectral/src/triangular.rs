//! Solves with a supernodal factor for several right-hand sides at once.
//!
//! A supernode is a set of consecutive columns with the same rows below them: a dense trapezoid. With the right-hand
//! sides stored row by row, each entry of the factor is read once in each direction and used for all of them. The
//! triangles on the diagonal are inverted once after factoring: a solve then consists of products alone, in which no
//! row waits for the row before (backward stable for triangles as well conditioned as these; Du Croz and Higham 1992,
//! "Stability of methods for matrix inversion").

#![allow(clippy::needless_range_loop, reason = "loops of a known length over registers")]

use faer::Par;
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::mat::{Mat, MatRef};
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::Simd;

use crate::simd::{self, Kernel, Row};

/// Rows or columns of a supernode worked on together: their partial results stay in registers.
const TILE: usize = 8;

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

impl Supernode<'_> {
    /// Applies the triangle's inverse and takes the part of the columns from the rows below.
    #[inline(always)]
    fn forward<S: Simd, const V: usize>(&self, simd: S, values: &[f64], x: &mut [Row]) {
        let (head, tail) = x.split_at_mut(self.start + self.columns);
        let own = &mut head[self.start..];
        let (entries, height) = (self.entries(values), self.height());
        // From the last row up: each needs only rows above it, which are still to be replaced.
        let mut end = self.columns;
        while end > 0 {
            let first = end.saturating_sub(TILE);
            if end - first == TILE {
                let sums = row_tile::<S, V>(simd, &entries[first..], height, &own[..end]);
                for t in 0..TILE {
                    simd::store::<S, V>(&mut own[first + t], sums[t]);
                }
            } else {
                for i in (first..end).rev() {
                    let sum = row::<S, V>(simd, &entries[i..], height, &own[..=i]);
                    simd::store::<S, V>(&mut own[i], sum);
                }
            }
            end = first;
        }
        let offset = self.start + self.columns;
        let tiles = self.rows.chunks_exact(TILE);
        let rest = self.rows.len() - tiles.remainder().len();
        for (tile, rows) in tiles.enumerate() {
            let sums = row_tile::<S, V>(simd, &entries[self.columns + tile * TILE..], height, own);
            for t in 0..TILE {
                subtract::<S, V>(simd, &mut tail[rows[t] - offset], sums[t]);
            }
        }
        for (i, &at) in self.rows.iter().enumerate().skip(rest) {
            let sum = row::<S, V>(simd, &entries[self.columns + i..], height, own);
            subtract::<S, V>(simd, &mut tail[at - offset], sum);
        }
    }

    /// Takes the part of the rows below from the columns and applies the transpose of the triangle's inverse.
    #[inline(always)]
    fn backward<S: Simd, const V: usize>(&self, simd: S, values: &[f64], x: &mut [Row]) {
        let (head, tail) = x.split_at_mut(self.start + self.columns);
        let own = &mut head[self.start..];
        let tail = |row: usize| &tail[row - self.start - self.columns];
        let entries = self.entries(values);
        let column = |j: usize| &entries[j * self.height()..][..self.height()];
        let tiles = self.columns / TILE * TILE;
        for first in (0..tiles).step_by(TILE) {
            let below: [&[f64]; TILE] = std::array::from_fn(|t| &column(first + t)[self.columns..]);
            let mut sums = [simd::zero::<S, V>(simd); TILE];
            for (i, &row) in self.rows.iter().enumerate() {
                let x = simd::load::<S, V>(simd, tail(row));
                for t in 0..TILE {
                    sums[t] = simd::add(simd, sums[t], below[t][i], x);
                }
            }
            for t in 0..TILE {
                subtract::<S, V>(simd, &mut own[first + t], sums[t]);
            }
        }
        for j in tiles..self.columns {
            let mut sum = simd::zero::<S, V>(simd);
            for (&row, &entry) in self.rows.iter().zip(&column(j)[self.columns..]) {
                sum = simd::add(simd, sum, entry, simd::load(simd, tail(row)));
            }
            subtract::<S, V>(simd, &mut own[j], sum);
        }
        // From the first row down: each needs only rows from its own on.
        for first in (0..tiles).step_by(TILE) {
            let triangle: [&[f64]; TILE] = std::array::from_fn(|t| &column(first + t)[first..self.columns]);
            let mut sums = [simd::zero::<S, V>(simd); TILE];
            for (i, row) in own[first..].iter().enumerate() {
                let x = simd::load::<S, V>(simd, row);
                for t in 0..TILE {
                    sums[t] = simd::add(simd, sums[t], triangle[t][i], x);
                }
            }
            for t in 0..TILE {
                simd::store::<S, V>(&mut own[first + t], sums[t]);
            }
        }
        for j in tiles..self.columns {
            let mut sum = simd::zero::<S, V>(simd);
            for (row, &entry) in own[j..].iter().zip(&column(j)[j..]) {
                sum = simd::add(simd, sum, entry, simd::load(simd, row));
            }
            simd::store::<S, V>(&mut own[j], sum);
        }
    }
}

/// Products of `TILE` rows of a matrix, the first starting at the first entry, with functions.
#[inline(always)]
fn row_tile<S: Simd, const V: usize>(
    simd: S,
    entries: &[f64],
    height: usize,
    functions: &[Row],
) -> [[S::f64s; V]; TILE] {
    let mut sums = [simd::zero::<S, V>(simd); TILE];
    for (j, function) in functions.iter().enumerate() {
        let entries = &entries[j * height..][..TILE];
        let x = simd::load::<S, V>(simd, function);
        for t in 0..TILE {
            sums[t] = simd::add(simd, sums[t], entries[t], x);
        }
    }
    sums
}

/// The product of one row of a matrix, starting at the first entry, with functions.
#[inline(always)]
fn row<S: Simd, const V: usize>(simd: S, entries: &[f64], height: usize, functions: &[Row]) -> [S::f64s; V] {
    let mut sum = simd::zero::<S, V>(simd);
    for (j, function) in functions.iter().enumerate() {
        sum = simd::add(simd, sum, entries[j * height], simd::load(simd, function));
    }
    sum
}

/// `target −= x` in memory.
#[inline(always)]
fn subtract<S: Simd, const V: usize>(simd: S, target: &mut Row, x: [S::f64s; V]) {
    let difference = simd::add(simd, simd::load::<S, V>(simd, target), -1.0, x);
    simd::store::<S, V>(target, difference);
}

/// Solves `L Lᵀ x = b`, in the order of the factor, whose triangles are [inverted](invert_triangles); `b` is replaced
/// by `x`.
pub(crate) fn solve(structure: &SymbolicSupernodalCholesky<usize>, values: &[f64], x: &mut [Row]) {
    simd::run(Solve { structure, values, x });
}

struct Solve<'a> {
    structure: &'a SymbolicSupernodalCholesky<usize>,
    values: &'a [f64],
    x: &'a mut [Row],
}

impl Kernel for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        for s in 0..self.structure.n_supernodes() {
            Supernode::new(self.structure, s).forward::<S, V>(simd, self.values, self.x);
        }
        for s in (0..self.structure.n_supernodes()).rev() {
            Supernode::new(self.structure, s).backward::<S, V>(simd, self.values, self.x);
        }
    }
}
