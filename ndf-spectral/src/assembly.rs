//! Assembly of symmetric sparse matrices from contributions of triangles.

use crate::csr::CsrMatrix;
use crate::scalar::Scalar;

/// A contribution to the entry (i, j), and its conjugate to (j, i); both to the diagonal where `i = j`.
pub(crate) type Coupling<T = f64> = (u32, u32, T);

/// The symmetric or Hermitian matrix of a diagonal and couplings, which sum where they meet. Every diagonal entry is stored.
/// Time and memory linear in the couplings.
pub(crate) fn symmetric<T: Scalar>(
    diagonal: &[T],
    couplings: impl Iterator<Item = Coupling<T>> + Clone,
) -> CsrMatrix<T> {
    // Two stable counting sorts, by column and then by row, leave the columns of every row ascending. As the matrix
    // is symmetric, rows and columns have the same counts.
    let n = diagonal.len();
    let mut starts: Vec<usize> = vec![1; n + 1];
    starts[0] = 0;
    for (i, j, _) in couplings.clone() {
        starts[i as usize + 1] += 1;
        starts[j as usize + 1] += 1;
    }
    for i in 0..n {
        starts[i + 1] += starts[i];
    }
    let mut next = starts.clone();
    let mut by_column = vec![(0_u32, T::default()); starts[n]];
    let mut put = |row: u32, column: u32, value: T| {
        let slot = &mut next[column as usize];
        by_column[*slot] = (row, value);
        *slot += 1;
    };
    for (i, &value) in diagonal.iter().enumerate() {
        put(i as u32, i as u32, value);
    }
    for (i, j, value) in couplings {
        put(i, j, value);
        put(j, i, value.conjugate());
    }
    next.copy_from_slice(&starts);
    let mut by_row = vec![(0_u32, T::default()); starts[n]];
    for column in 0..n {
        for &(row, value) in &by_column[starts[column]..starts[column + 1]] {
            by_row[next[row as usize]] = (column as u32, value);
            next[row as usize] += 1;
        }
    }
    drop(by_column);
    let mut offsets = Vec::with_capacity(n + 1);
    offsets.push(0);
    let (mut columns, mut values) = (Vec::with_capacity(8 * n), Vec::<T>::with_capacity(8 * n));
    for row in 0..n {
        let start = columns.len();
        for &(column, value) in &by_row[starts[row]..starts[row + 1]] {
            match values.last_mut() {
                Some(last) if columns.len() > start && columns.last() == Some(&(column as usize)) => {
                    *last += value;
                }
                _ => {
                    columns.push(column as usize);
                    values.push(value);
                }
            }
        }
        offsets.push(columns.len());
    }
    CsrMatrix::new(n, offsets, columns, values).expect("columns ascend within every row")
}

/// The symmetric matrix with rows and columns in another order: row `i` is row `order[i]` of the given one, and
/// `position` is the inverse of `order`. O(entries).
pub(crate) fn permuted(matrix: &CsrMatrix, order: &[usize], position: &[usize]) -> CsrMatrix {
    let diagonal: Vec<f64> = order.iter().map(|&i| matrix.get(i, i).unwrap_or(0.0)).collect();
    let above = matrix.entries().filter(|(i, j, _)| i < j);
    symmetric(&diagonal, above.map(|(i, j, value)| (position[i] as u32, position[j] as u32, value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contributions_meet_in_sorted_rows() {
        let couplings = [(2, 0, 1.0), (0, 1, 2.0), (0, 2, 4.0), (1, 1, 8.0)];
        let matrix = symmetric(&[1.0, 0.0, 3.0], couplings.into_iter());
        assert_eq!(matrix.offsets(), [0, 3, 5, 7]);
        assert_eq!(matrix.columns(), [0, 1, 2, 0, 1, 0, 2]);
        assert_eq!(matrix.values(), [1.0, 2.0, 5.0, 2.0, 16.0, 5.0, 3.0]);
        let (order, position) = ([2, 0, 1], [1, 2, 0]);
        let moved = permuted(&matrix, &order, &position);
        for (i, j) in [(0, 0), (0, 1), (1, 2), (2, 2), (0, 2)] {
            assert_eq!(moved.get(i, j), matrix.get(order[i], order[j]));
        }
    }
}
