//! Solves with a supernodal factor for several right-hand sides at once.
//!
//! A supernode is a set of consecutive columns with the same rows below them: a dense trapezoid. With the right-hand
//! sides stored row by row, each entry of the factor is read once in each direction and used for all of them.

#![allow(clippy::needless_range_loop, reason = "loops of a known length over registers")]

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::Simd;

use crate::simd::{self, Kernel, Row};

/// Rows or columns of a supernode worked on together: their partial results stay in registers.
const TILE: usize = 4;

/// One trapezoid of a factor.
struct Supernode<'a> {
    /// Its first column.
    start: usize,
    /// Its columns.
    columns: usize,
    /// Rows below the triangle.
    rows: &'a [usize],
    /// Entries column by column, the triangle first in each.
    values: &'a [f64],
}

impl<'a> Supernode<'a> {
    #[inline(always)]
    fn new(structure: &'a SymbolicSupernodalCholesky<usize>, values: &'a [f64], s: usize) -> Self {
        let start = structure.supernode_begin()[s];
        Self {
            start,
            columns: structure.supernode_end()[s] - start,
            rows: &structure.row_idx()[structure.col_ptr_for_row_idx()[s]..][..structure.nnz_per_super()[s]],
            values: &values[structure.col_ptr_for_val()[s]..structure.col_ptr_for_val()[s + 1]],
        }
    }

    /// Entries of a column, from the diagonal on.
    #[inline(always)]
    fn column(&self, j: usize) -> &'a [f64] {
        &self.values[j * (self.columns + self.rows.len()) + j..][..self.columns - j + self.rows.len()]
    }

    /// Entries of a column below the triangle.
    #[inline(always)]
    fn below(&self, j: usize) -> &'a [f64] {
        &self.values[j * (self.columns + self.rows.len()) + self.columns..][..self.rows.len()]
    }

    /// Solves with the columns and takes their part from the rows below.
    #[inline(always)]
    fn forward<S: Simd, const V: usize>(&self, simd: S, x: &mut [Row]) {
        let (head, tail) = x.split_at_mut(self.start + self.columns);
        let own = &mut head[self.start..];
        for j in 0..self.columns {
            let column = self.column(j);
            let (row, rest) = own[j..].split_first_mut().expect("j is a column");
            let solved = simd::scale::<S, V>(simd, column[0].recip(), simd::load(simd, row));
            simd::store::<S, V>(row, solved);
            for (target, &entry) in rest.iter_mut().zip(&column[1..]) {
                add_to::<S, V>(simd, target, -entry, solved);
            }
        }
        let offset = self.start + self.columns;
        let tiles = self.rows.len() / TILE;
        for tile in 0..tiles {
            let mut sums = [simd::zero::<S, V>(simd); TILE];
            for (j, own) in own.iter().enumerate() {
                let entries = &self.below(j)[tile * TILE..][..TILE];
                let own = simd::load::<S, V>(simd, own);
                for t in 0..TILE {
                    sums[t] = simd::add(simd, sums[t], entries[t], own);
                }
            }
            for (&row, sum) in self.rows[tile * TILE..].iter().zip(sums) {
                add_to::<S, V>(simd, &mut tail[row - offset], -1.0, sum);
            }
        }
        for (i, &row) in self.rows.iter().enumerate().skip(tiles * TILE) {
            let mut sum = simd::zero::<S, V>(simd);
            for (j, own) in own.iter().enumerate() {
                sum = simd::add(simd, sum, self.below(j)[i], simd::load(simd, own));
            }
            add_to::<S, V>(simd, &mut tail[row - offset], -1.0, sum);
        }
    }

    /// Takes the part of the rows below from the columns and solves with the transpose.
    #[inline(always)]
    fn backward<S: Simd, const V: usize>(&self, simd: S, x: &mut [Row]) {
        let (head, tail) = x.split_at_mut(self.start + self.columns);
        let own = &mut head[self.start..];
        let offset = self.start + self.columns;
        let tiles = self.columns / TILE;
        for first in (0..tiles).map(|t| t * TILE) {
            let mut below: [&[f64]; TILE] = [&[]; TILE];
            for t in 0..TILE {
                below[t] = self.below(first + t);
            }
            let mut sums = [simd::zero::<S, V>(simd); TILE];
            for (i, &row) in self.rows.iter().enumerate() {
                let x = simd::load::<S, V>(simd, &tail[row - offset]);
                for t in 0..TILE {
                    sums[t] = simd::add(simd, sums[t], below[t][i], x);
                }
            }
            for t in 0..TILE {
                add_to::<S, V>(simd, &mut own[first + t], -1.0, sums[t]);
            }
        }
        for j in tiles * TILE..self.columns {
            let mut sum = simd::zero::<S, V>(simd);
            for (&row, &entry) in self.rows.iter().zip(self.below(j)) {
                sum = simd::add(simd, sum, entry, simd::load(simd, &tail[row - offset]));
            }
            add_to::<S, V>(simd, &mut own[j], -1.0, sum);
        }
        for j in (0..self.columns).rev() {
            let column = self.column(j);
            let (row, rest) = own[j..].split_first_mut().expect("j is a column");
            let mut sum = simd::load::<S, V>(simd, row);
            for (x, &entry) in rest.iter().zip(&column[1..]) {
                sum = simd::add(simd, sum, -entry, simd::load(simd, x));
            }
            simd::store::<S, V>(row, simd::scale(simd, column[0].recip(), sum));
        }
    }
}

/// `target += factor · x` in memory.
#[inline(always)]
fn add_to<S: Simd, const V: usize>(simd: S, target: &mut Row, factor: f64, x: [S::f64s; V]) {
    let sum = simd::add(simd, simd::load::<S, V>(simd, target), factor, x);
    simd::store::<S, V>(target, sum);
}

/// Solves `L Lᵀ x = b`, in the order of the factor; `b` is replaced by `x`.
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
            Supernode::new(self.structure, self.values, s).forward::<S, V>(simd, self.x);
        }
        for s in (0..self.structure.n_supernodes()).rev() {
            Supernode::new(self.structure, self.values, s).backward::<S, V>(simd, self.x);
        }
    }
}
