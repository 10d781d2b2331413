//! Solves with a supernodal factor.
//!
//! A supernode is a set of consecutive columns with the same rows below them: a dense trapezoid. The
//! triangles on the diagonal are inverted once after factoring (Du Croz and Higham 1992, "Stability of methods for
//! matrix inversion"): a solve then consists of products alone, in which no row waits for the row before. Several right-hand sides are
//! solved for [row by row](panel), a single one [column by column](single).

use faer::Par;
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::mat::{Mat, MatRef};
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

use crate::scalar::Scalar;

pub(crate) mod panel;
pub(crate) mod single;

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
    fn entries<'v, T>(&self, values: &'v [T]) -> &'v [T] {
        &values[self.values..][..self.columns * self.height()]
    }
}

/// Replaces the triangles of all supernodes by their inverses, with zeros above the diagonal. O(columns³) each.
pub(crate) fn invert_triangles<T: Scalar>(structure: &SymbolicSupernodalCholesky<usize>, values: &mut [T]) {
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
                entries[j * height + i] = if i < j { T::default() } else { inverse[(i, j)] };
            }
        }
    }
}
