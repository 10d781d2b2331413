//! Dense matrices, by one thread: results must not depend on how many there are.

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::evd;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, Mat, MatRef, Par};

use crate::csr::CsrMatrix;
use crate::error::SpectralError;
use crate::laplace_beltrami::LaplaceBeltrami;

/// The smallest eigenvalues of a small operator, ascending, and their M-orthonormal functions; O(n³).
pub(crate) fn modes(operator: &LaplaceBeltrami, count: usize) -> Result<(Vec<f64>, Mat<f64>), SpectralError> {
    // With M = R Rᵀ, L φ = λ M φ is the symmetric problem R⁻¹ L R⁻ᵀ y = λ y of y = Rᵀ φ.
    let mut factor = dense(operator.mass());
    cholesky(&mut factor).ok_or(SpectralError::NotPositiveDefinite)?;
    let mut reduced = dense(operator.laplacian());
    for _ in 0..2 {
        solve_lower_triangular_in_place(factor.as_ref(), reduced.as_mut(), Par::Seq);
        reduced = reduced.transpose().to_owned();
    }
    let n = operator.vertex_count();
    let symmetric = Mat::from_fn(n, n, |i, j| 0.5 * (reduced[(i, j)] + reduced[(j, i)]));
    let (mut values, vectors) = self_adjoint_eigen(&symmetric);
    values.truncate(count);
    let mut functions = vectors.subcols(0, count).to_owned();
    solve_upper_triangular_in_place(factor.transpose(), functions.as_mut(), Par::Seq);
    Ok((values, functions))
}

/// Replaces the lower triangle of a symmetric matrix by its Cholesky factor; `None` where it is not positive definite.
pub(crate) fn cholesky(matrix: &mut Mat<f64>) -> Option<()> {
    let request = cholesky_in_place_scratch::<f64>(matrix.nrows(), Par::Seq, Default::default());
    let memory = &mut MemBuffer::new(request);
    let stack = MemStack::new(memory);
    cholesky_in_place(matrix.as_mut(), Default::default(), Par::Seq, stack, Default::default()).ok()?;
    Some(())
}

/// Eigenvalues of a symmetric matrix, ascending, and its eigenvectors, a column each.
pub(crate) fn self_adjoint_eigen(matrix: &Mat<f64>) -> (Vec<f64>, Mat<f64>) {
    let size = matrix.nrows();
    let mut values = Diag::zeros(size);
    let mut vectors = Mat::zeros(size, size);
    let vectors_too = evd::ComputeEigenvectors::Yes;
    let request = evd::self_adjoint_evd_scratch::<f64>(size, vectors_too, Par::Seq, Default::default());
    evd::self_adjoint_evd(
        matrix.as_ref(),
        values.as_mut(),
        Some(vectors.as_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(request)),
        Default::default(),
    )
    .expect("a finite symmetric matrix has eigenvectors");
    (values.column_vector().iter().copied().collect(), vectors)
}

/// The product of two matrices.
pub(crate) fn product(a: &Mat<f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut product = Mat::zeros(a.nrows(), b.ncols());
    matmul(product.as_mut(), Accum::Replace, a.as_ref(), b, 1.0, Par::Seq);
    product
}

fn dense(matrix: &CsrMatrix) -> Mat<f64> {
    let mut dense = Mat::zeros(matrix.row_count(), matrix.column_count());
    matrix.entries().for_each(|(i, j, value)| dense[(i, j)] = value);
    dense
}
