//! Sparse matrices by rows, and how they become those of other crates.

use std::sync::Arc;

use crate::assembly;
use crate::scalar::Scalar;
use faer::sparse::{SparseColMat, SparseRowMat, SymbolicSparseRowMat};

/// A sparse matrix of real or complex numbers in compressed rows (CSR). The columns of a row ascend and none occurs twice. Clones share
/// their pattern.
///
/// Converts into faer's matrices and back, and with the feature `nalgebra` into those of nalgebra-sparse:
///
/// ```
/// use ndf_spectral::CsrMatrix;
/// use ndf_spectral::faer::sparse::SparseRowMat;
///
/// // (2 0 1; 0 3 0)
/// let matrix = CsrMatrix::new(3, vec![0, 2, 3], vec![0, 2, 1], vec![2.0, 1.0, 3.0])?;
/// assert_eq!(matrix.multiply(&[1.0, 10.0, 100.0]), [102.0, 30.0]);
/// let theirs = SparseRowMat::from(matrix.clone());
/// assert_eq!(CsrMatrix::from(theirs), matrix);
/// # Ok::<(), ndf_spectral::CsrError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct CsrMatrix<T = f64> {
    column_count: usize,
    /// Where the entries of every row begin, and where the last ends.
    offsets: Arc<Vec<usize>>,
    columns: Arc<Vec<usize>>,
    values: Vec<T>,
}

/// Why arrays are no sparse matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CsrError {
    /// The offsets do not run from 0 to the number of entries, ascending.
    #[error("row offsets must ascend from 0 to the number of entries")]
    Offsets,
    /// There is not one value for every column index.
    #[error("{columns} column indices for {values} values")]
    Lengths {
        /// Column indices.
        columns: usize,
        /// Values.
        values: usize,
    },
    /// The columns of a row do not ascend, or lie outside of the matrix.
    #[error("the columns of row {0} must ascend and be less than the number of columns")]
    Columns(usize),
}

impl<T: Scalar> CsrMatrix<T> {
    /// A matrix of its arrays: row `i` has the entries `offsets[i]..offsets[i + 1]`. O(entries).
    ///
    /// # Errors
    /// If the offsets do not ascend from 0 to the number of entries, the columns of a row do not ascend, or a column is
    /// outside of the matrix.
    pub fn new(
        column_count: usize,
        offsets: Vec<usize>,
        columns: Vec<usize>,
        values: Vec<T>,
    ) -> Result<Self, CsrError> {
        if columns.len() != values.len() {
            return Err(CsrError::Lengths { columns: columns.len(), values: values.len() });
        }
        if offsets.first() != Some(&0) || offsets.last() != Some(&columns.len()) || !offsets.is_sorted() {
            return Err(CsrError::Offsets);
        }
        for (row, range) in offsets.windows(2).enumerate() {
            let columns = &columns[range[0]..range[1]];
            let ascend = columns.windows(2).all(|pair| pair[0] < pair[1]);
            if !ascend || columns.last().is_some_and(|&last| last >= column_count) {
                return Err(CsrError::Columns(row));
            }
        }
        Ok(Self::checked(column_count, offsets, columns, values))
    }

    /// A matrix of arrays that are known to be one.
    fn checked(column_count: usize, offsets: Vec<usize>, columns: Vec<usize>, values: Vec<T>) -> Self {
        Self { column_count, offsets: Arc::new(offsets), columns: Arc::new(columns), values }
    }

    /// Offsets, columns and values, which are copied where another matrix has them, too.
    fn into_arrays(self) -> (Vec<usize>, Vec<usize>, Vec<T>) {
        (Arc::unwrap_or_clone(self.offsets), Arc::unwrap_or_clone(self.columns), self.values)
    }

    /// The symmetric matrix of a diagonal and couplings (i, j, x), each of which adds x to the entry (i, j) and its conjugate to (j, i),
    /// both to a diagonal entry: Hermitian where numbers are complex and the diagonal is real. O(rows + couplings).
    ///
    /// # Panics
    /// If a row or a column is outside of the matrix.
    pub fn symmetric(diagonal: &[T], couplings: impl Iterator<Item = (u32, u32, T)> + Clone) -> Self {
        assembly::symmetric(diagonal, couplings)
    }

    /// Number of rows.
    pub fn row_count(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Number of columns.
    pub fn column_count(&self) -> usize {
        self.column_count
    }

    /// Where the entries of every row begin, and where the last ends: one number more than rows.
    pub fn offsets(&self) -> &[usize] {
        &self.offsets
    }

    /// The column of every entry, row by row.
    pub fn columns(&self) -> &[usize] {
        &self.columns
    }

    /// The value of every entry, row by row.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// The value of every entry, to be changed.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// Columns and values of a row.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, row: usize) -> (&[usize], &[T]) {
        let range = self.offsets[row]..self.offsets[row + 1];
        (&self.columns[range.clone()], &self.values[range])
    }

    /// All entries as row, column and value, row by row.
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize, T)> + Clone + '_ {
        (0..self.row_count()).flat_map(move |row| {
            let (columns, values) = self.row(row);
            columns.iter().zip(values).map(move |(&column, &value)| (row, column, value))
        })
    }

    /// A value; `None` where no entry is stored. O(log of the row's entries).
    ///
    /// # Panics
    /// If there is no such row.
    pub fn get(&self, row: usize, column: usize) -> Option<T> {
        let (columns, values) = self.row(row);
        columns.binary_search(&column).ok().map(|slot| values[slot])
    }

    /// The value of a stored entry, to be changed; `None` where none is. O(log of the row's entries).
    ///
    /// # Panics
    /// If there is no such row.
    pub fn get_mut(&mut self, row: usize, column: usize) -> Option<&mut T> {
        let start = self.offsets[row];
        let slot = self.row(row).0.binary_search(&column).ok()?;
        Some(&mut self.values[start + slot])
    }

    /// The matrix times a vector. O(entries).
    ///
    /// # Panics
    /// If there is not one value for every column.
    pub fn multiply(&self, vector: &[T]) -> Vec<T> {
        assert_eq!(vector.len(), self.column_count);
        let product = |row| {
            let (columns, values) = self.row(row);
            columns.iter().zip(values).map(|(&column, &value)| value * vector[column]).sum()
        };
        (0..self.row_count()).map(product).collect()
    }
}

impl CsrMatrix {
    /// The product with another matrix, row by row (Gustavson 1978). O(multiplications), and the logarithm of a row's entries.
    ///
    /// # Panics
    /// If the other matrix has not as many rows as this one has columns.
    pub fn times(&self, other: &Self) -> Self {
        assert_eq!(self.column_count, other.row_count());
        let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        let mut sums = vec![0.0; other.column_count];
        // The row of the product in which a column was last met.
        let mut met = vec![usize::MAX; other.column_count];
        for row in 0..self.row_count() {
            let start = columns.len();
            let (factors, weights) = self.row(row);
            for (&factor, &weight) in factors.iter().zip(weights) {
                let (others, entries) = other.row(factor);
                for (&column, &entry) in others.iter().zip(entries) {
                    if met[column] != row {
                        met[column] = row;
                        sums[column] = 0.0;
                        columns.push(column);
                    }
                    sums[column] += weight * entry;
                }
            }
            columns[start..].sort_unstable();
            values.extend(columns[start..].iter().map(|&column: &usize| sums[column]));
            offsets.push(columns.len());
        }
        Self::checked(other.column_count, offsets, columns, values)
    }

    /// The transposed matrix. O(entries).
    pub fn transposed(&self) -> Self {
        let mut offsets = vec![0; self.column_count + 1];
        self.columns.iter().for_each(|&column| offsets[column + 1] += 1);
        (0..self.column_count).for_each(|column| offsets[column + 1] += offsets[column]);
        let mut next = offsets.clone();
        let (mut columns, mut values) = (vec![0; self.columns.len()], vec![0.0; self.values.len()]);
        for (row, column, value) in self.entries() {
            columns[next[column]] = row;
            values[next[column]] = value;
            next[column] += 1;
        }
        Self::checked(self.row_count(), offsets, columns, values)
    }

    /// The rows and columns of a square matrix that are kept, in their order. O(entries).
    ///
    /// # Panics
    /// If there is not one mark for every row.
    pub fn restricted(&self, kept: &[bool]) -> Self {
        assert_eq!([kept.len(), self.column_count], [self.row_count(); 2]);
        let mut count = 0;
        let position = |kept: &bool| {
            count += usize::from(*kept);
            count.wrapping_sub(1)
        };
        let positions: Vec<usize> = kept.iter().map(position).collect();
        let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        for row in (0..kept.len()).filter(|&row| kept[row]) {
            let (all, entries) = self.row(row);
            for (&column, &value) in all.iter().zip(entries).filter(|(column, _)| kept[**column]) {
                columns.push(positions[column]);
                values.push(value);
            }
            offsets.push(columns.len());
        }
        Self::checked(count, offsets, columns, values)
    }

    /// `self + factor · other` for a matrix whose pattern is part of this one's. O(entries).
    ///
    /// # Panics
    /// If the other matrix has an entry where this one has none.
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        assert_eq!(self.row_count(), other.row_count());
        let mut sum = self.clone();
        for row in 0..other.row_count() {
            let mut slot = sum.offsets[row];
            let (columns, values) = other.row(row);
            for (&column, &value) in columns.iter().zip(values) {
                while sum.columns[slot] != column {
                    slot += 1;
                }
                sum.values[slot] += factor * value;
            }
        }
        sum
    }
}

impl From<CsrMatrix> for SparseRowMat<usize, f64> {
    fn from(matrix: CsrMatrix) -> Self {
        let (rows, column_count) = (matrix.row_count(), matrix.column_count);
        let (offsets, columns, values) = matrix.into_arrays();
        SparseRowMat::new(
            SymbolicSparseRowMat::new_checked(rows, column_count, offsets, None, columns),
            values,
        )
    }
}

impl From<SparseRowMat<usize, f64>> for CsrMatrix {
    /// Rows of faer's matrices may be unsorted, and have gaps between them.
    fn from(matrix: SparseRowMat<usize, f64>) -> Self {
        let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        for row in 0..matrix.nrows() {
            let mut entries: Vec<(usize, f64)> = matrix
                .symbolic()
                .col_idx_of_row(row)
                .zip(matrix.val_of_row(row))
                .map(|(column, &value)| (column, value))
                .collect();
            entries.sort_by_key(|&(column, _)| column);
            columns.extend(entries.iter().map(|&(column, _)| column));
            values.extend(entries.iter().map(|&(_, value)| value));
            offsets.push(columns.len());
        }
        Self::checked(matrix.ncols(), offsets, columns, values)
    }
}

impl From<CsrMatrix> for SparseColMat<usize, f64> {
    /// # Panics
    /// If memory is short.
    fn from(matrix: CsrMatrix) -> Self {
        SparseRowMat::from(matrix).to_col_major().expect("there is memory for the matrix")
    }
}

impl From<SparseColMat<usize, f64>> for CsrMatrix {
    /// # Panics
    /// If memory is short.
    fn from(matrix: SparseColMat<usize, f64>) -> Self {
        matrix.to_row_major().expect("there is memory for the matrix").into()
    }
}

#[cfg(feature = "nalgebra")]
impl From<CsrMatrix> for nalgebra_sparse::CsrMatrix<f64> {
    fn from(matrix: CsrMatrix) -> Self {
        let (rows, column_count) = (matrix.row_count(), matrix.column_count);
        let (offsets, columns, values) = matrix.into_arrays();
        Self::try_from_csr_data(rows, column_count, offsets, columns, values)
            .expect("rows are sorted and columns are inside")
    }
}

#[cfg(feature = "nalgebra")]
impl From<nalgebra_sparse::CsrMatrix<f64>> for CsrMatrix {
    fn from(matrix: nalgebra_sparse::CsrMatrix<f64>) -> Self {
        let column_count = matrix.ncols();
        let (offsets, columns, values) = matrix.disassemble();
        Self::checked(column_count, offsets, columns, values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (1 2 0; 0 0 0; 0 3 4; 5 0 0).
    fn matrix() -> CsrMatrix {
        let values = vec![1.0, 2.0, 3.0, 4.0, 5.0];
        CsrMatrix::new(3, vec![0, 2, 2, 4, 5], vec![0, 1, 1, 2, 0], values).unwrap()
    }

    #[test]
    fn entries_products_and_sums() {
        let mut matrix = matrix();
        assert_eq!(matrix.multiply(&[1.0, 10.0, 100.0]), [21.0, 0.0, 430.0, 5.0]);
        assert_eq!((matrix.get(2, 2), matrix.get(2, 0)), (Some(4.0), None));
        *matrix.get_mut(3, 0).unwrap() += 1.0;
        assert_eq!(matrix.get_mut(1, 0), None);
        let last = CsrMatrix::new(3, vec![0, 1, 1, 2, 2], vec![1, 2], vec![1.0, 1.0]).unwrap();
        assert_eq!(matrix.plus(-2.0, &last).values(), [1.0, 0.0, 3.0, 2.0, 6.0]);
        let entries: Vec<_> = last.entries().collect();
        assert_eq!(entries, [(0, 1, 1.0), (2, 2, 1.0)]);
    }

    #[test]
    fn products_of_matrices_are_those_of_their_vectors() {
        let matrix = matrix();
        let transposed = matrix.transposed();
        assert_eq!((transposed.row_count(), transposed.column_count()), (3, 4));
        assert_eq!(transposed.get(0, 3), Some(5.0));
        assert_eq!(transposed.transposed(), matrix);
        let square = transposed.times(&matrix);
        for i in 0..3 {
            let unit: Vec<f64> = (0..3).map(|j| f64::from(u8::from(i == j))).collect();
            assert_eq!(square.multiply(&unit), transposed.multiply(&matrix.multiply(&unit)));
            assert!(square.row(i).0.is_sorted());
        }
    }

    #[test]
    fn arrays_that_are_no_matrix_are_refused() {
        let new = |offsets: &[usize], columns: &[usize], values: usize| {
            CsrMatrix::new(2, offsets.to_vec(), columns.to_vec(), vec![1.0; values]).unwrap_err()
        };
        assert_eq!(new(&[0, 1], &[0], 2), CsrError::Lengths { columns: 1, values: 2 });
        for offsets in [&[][..], &[1, 1], &[0, 2], &[0, 2, 1]] {
            assert_eq!(new(offsets, &[0], 1), CsrError::Offsets);
        }
        assert_eq!(new(&[0, 1], &[2], 1), CsrError::Columns(0));
        assert_eq!(new(&[0, 0, 2], &[1, 0], 2), CsrError::Columns(1));
        assert_eq!(new(&[0, 2], &[1, 1], 2), CsrError::Columns(0));
    }

    #[test]
    fn faers_matrices_are_the_same() {
        let by_rows = SparseRowMat::from(matrix());
        let by_columns = SparseColMat::from(matrix());
        for (row, column, value) in matrix().entries() {
            assert_eq!(by_rows.get(row, column), Some(&value));
            assert_eq!(by_columns.get(row, column), Some(&value));
        }
        assert_eq!(CsrMatrix::from(by_rows), matrix());
        assert_eq!(CsrMatrix::from(by_columns), matrix());
        let unsorted = SymbolicSparseRowMat::new_unsorted_checked(1, 3, vec![0, 2], None, vec![2, 0]);
        let sorted = CsrMatrix::from(SparseRowMat::new(unsorted, vec![1.0, 2.0]));
        assert_eq!((sorted.columns(), sorted.values()), (&[0, 2][..], &[2.0, 1.0][..]));
    }

    #[cfg(feature = "nalgebra")]
    #[test]
    fn nalgebras_matrices_are_the_same() {
        let theirs = nalgebra_sparse::CsrMatrix::from(matrix());
        assert_eq!((theirs.nrows(), theirs.ncols(), theirs.nnz()), (4, 3, 5));
        assert!(theirs.triplet_iter().map(|(i, j, v)| (i, j, *v)).eq(matrix().entries()));
        assert_eq!(CsrMatrix::from(theirs), matrix());
    }
}
