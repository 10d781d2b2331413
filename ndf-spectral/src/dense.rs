//! All modes of a small operator by dense matrices.

use nalgebra_sparse::CsrMatrix;
use nalgebra_sparse::na::DMatrix;

use crate::error::SpectralError;
use crate::laplace_beltrami::LaplaceBeltrami;

/// The smallest eigenvalues, ascending, and their M-orthonormal functions; O(n³).
pub(crate) fn modes(
    operator: &LaplaceBeltrami,
    count: usize,
) -> Result<(Vec<f64>, DMatrix<f64>), SpectralError> {
    // With M = R Rᵀ, L φ = λ M φ is the symmetric problem R⁻¹ L R⁻ᵀ y = λ y of y = Rᵀ φ.
    let factor = dense(operator.mass()).cholesky().ok_or(SpectralError::NotPositiveDefinite)?.unpack();
    let solve = |matrix: &DMatrix<f64>| factor.solve_lower_triangular(matrix).expect("pivots are positive");
    let half = solve(&dense(operator.laplacian()));
    let reduced = solve(&half.transpose());
    let eigen = (0.5 * (&reduced + reduced.transpose())).symmetric_eigen();
    let mut order: Vec<usize> = (0..operator.vertex_count()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    order.truncate(count);
    let values = order.iter().map(|&i| eigen.eigenvalues[i]).collect();
    let vectors = eigen.eigenvectors.select_columns(&order);
    let functions = factor.tr_solve_lower_triangular(&vectors).expect("pivots are positive");
    Ok((values, functions))
}

fn dense(matrix: &CsrMatrix<f64>) -> DMatrix<f64> {
    let mut dense = DMatrix::zeros(matrix.nrows(), matrix.ncols());
    matrix.triplet_iter().for_each(|(i, j, value)| dense[(i, j)] = *value);
    dense
}
