//! The smallest eigenvector of a quadratic form on one complex number a vertex.

use ndf_core::Progress;
use ndf_spectral::faer::{Mat, Side};
use ndf_spectral::{Cholesky, CsrMatrix, SymbolicCholesky};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::connection::plus_mass;
use crate::error::FieldError;

/// Vectors that are iterated at once.
const BLOCK: usize = 4;

/// The iteration ends when a round gains less than this part of the energy. An eigenvector may be thousands of times smaller in one part of
/// a surface than in another, and is wrong there by the root of it: directions must be right there, too.
const SETTLED: f64 = 1e-14;

/// Rounds before the iteration is given up.
const MOST_ROUNDS: usize = 500;

/// A quadratic form on one complex number a vertex.
pub(crate) enum Form {
    /// Of a Hermitian matrix: eigenvectors come in complex lines.
    Hermitian(CsrMatrix<Complex64>),
    /// Of a symmetric one whose rows 2v and 2v + 1 stand for the real and the imaginary part of vertex v: linear over real numbers alone.
    Real(CsrMatrix),
}

impl Form {
    fn vertices(&self) -> usize {
        match self {
            Self::Hermitian(matrix) => matrix.row_count(),
            Self::Real(matrix) => matrix.row_count() / 2,
        }
    }

    /// The matrix times a vector.
    fn image(&self, x: &[Complex64]) -> Vec<Complex64> {
        match self {
            Self::Hermitian(matrix) => matrix.multiply(x),
            Self::Real(matrix) => bytemuck::cast_slice(&matrix.multiply(bytemuck::cast_slice(x))).to_vec(),
        }
    }

    /// The inner product, conjugate in the first: its real part where linear combinations are real.
    fn inner<'a>(&self, products: impl Iterator<Item = (&'a Complex64, Complex64)>) -> Complex64 {
        let sum: Complex64 = products.map(|(a, b)| a.conj() * b).sum();
        match self {
            Self::Hermitian(_) => sum,
            Self::Real(_) => sum.re.into(),
        }
    }

    /// Factors the form with `factor · areas` added.
    fn shifted(&self, factor: f64, areas: &[f64]) -> Result<Inverse, FieldError> {
        Ok(match self {
            Self::Hermitian(matrix) => {
                let matrix = plus_mass(matrix, factor, areas.iter().copied());
                Inverse::Hermitian(SymbolicCholesky::new(&matrix)?.cholesky(&matrix)?)
            }
            Self::Real(matrix) => {
                let matrix = plus_mass(matrix, factor, areas.iter().flat_map(|area| [*area; 2]));
                Inverse::Real(SymbolicCholesky::of_pairs(&matrix)?.cholesky(&matrix)?)
            }
        })
    }
}

/// A factorised [`Form`].
enum Inverse {
    Hermitian(Cholesky<Complex64>),
    Real(Cholesky),
}

impl Inverse {
    fn solve(&self, sides: &mut [Vec<Complex64>]) {
        match self {
            Self::Hermitian(cholesky) => {
                cholesky.solve(&mut sides.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>());
            }
            Self::Real(cholesky) => {
                cholesky.solve(
                    &mut sides.iter_mut().map(|side| bytemuck::cast_slice_mut(side)).collect::<Vec<_>>(),
                );
            }
        }
    }
}

/// The vector of the smallest eigenvalue of `L x = λ M x`, of norm 1 in the mass M, and λ, both to about the
/// rounding of the matrix. One of them where the eigenvalue is multiple.
///
/// By locally optimal block conjugate gradients (Knyazev 2001) with the inverse of L + σM as their preconditioner: a round solves for
/// a block of vectors and takes the best of the span of these, of the block and of the block before.
///
/// # Errors
/// If the matrix cannot be factored, or the iteration does not end.
pub(crate) fn smallest_eigenvector(
    form: &Form,
    areas: &[f64],
    progress: &dyn Progress,
) -> Result<(f64, Vec<Complex64>), FieldError> {
    let typical = 4.0 * std::f64::consts::PI / areas.iter().sum::<f64>();
    progress.report("factoring", 0.0);
    let inverse = form.shifted(1e-6 * typical, areas)?;
    progress.check()?;
    let columns = BLOCK.min(form.vertices()).max(1);
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut noise = || random.random::<f64>() - 0.5;
    let mut block: Vec<Vec<Complex64>> = (0..columns)
        .map(|_| (0..form.vertices()).map(|_| Complex64::new(noise(), noise())).collect())
        .collect();
    let mut before: Vec<Vec<Complex64>> = Vec::new();
    let mut energy = f64::INFINITY;
    let mut gained = f64::INFINITY;
    for round in 0..MOST_ROUNDS {
        progress.check()?;
        progress.report("smoothest field", round as f64 / MOST_ROUNDS as f64);
        let mut solved: Vec<Vec<Complex64>> = block.iter().map(|x| massed(x, areas)).collect();
        inverse.solve(&mut solved);
        let span = orthonormal(form, solved.into_iter().chain(block.iter().cloned()).chain(before), areas);
        let (lowest, improved) = best_of(form, &span, columns)?;
        before = std::mem::replace(&mut block, improved);
        gained = (energy - lowest) / lowest.max(typical);
        energy = lowest;
        if round > 0 && gained < SETTLED {
            return Ok((energy.max(0.0), block.swap_remove(0)));
        }
    }
    Err(FieldError::NotConverged(MOST_ROUNDS, gained))
}

fn massed(x: &[Complex64], areas: &[f64]) -> Vec<Complex64> {
    x.iter().zip(areas).map(|(x, area)| x * area).collect()
}

/// The vectors of a span, given by an orthonormal basis, with the least energies, and the least.
fn best_of(
    form: &Form,
    span: &[Vec<Complex64>],
    count: usize,
) -> Result<(f64, Vec<Vec<Complex64>>), FieldError> {
    let k = span.len();
    let images: Vec<Vec<Complex64>> = span.iter().map(|x| form.image(x)).collect();
    let entry = |i: usize, j: usize| form.inner(span[i].iter().zip(images[j].iter().copied()));
    let projected = Mat::from_fn(k, k, |i, j| 0.5 * (entry(i, j) + entry(j, i).conj()));
    let (lowest, vectors) = lowest_eigenvectors(form, &projected, count)?;
    Ok((lowest, vectors.iter().map(|factors| combination(span, factors)).collect()))
}

/// The smallest eigenvalue of a small Hermitian matrix, and vectors of so many of the smallest; real ones of a [real form](Form::Real).
fn lowest_eigenvectors(
    form: &Form,
    matrix: &Mat<Complex64>,
    count: usize,
) -> Result<(f64, Vec<Vec<Complex64>>), FieldError> {
    let k = matrix.nrows();
    // A + iB has the eigenvalues of the symmetric (A −B; B A): programs need no complex eigensolver.
    let parts = match form {
        Form::Hermitian(_) => 2,
        Form::Real(_) => 1,
    };
    let real = Mat::from_fn(parts * k, parts * k, |r, c| match (matrix[(r % k, c % k)], r / k, c / k) {
        (z, 0, 0) | (z, 1, 1) => z.re,
        (z, 0, _) => -z.im,
        (z, ..) => z.im,
    });
    let eigen = real.self_adjoint_eigen(Side::Lower).map_err(|_| FieldError::NotConverged(0, f64::NAN))?;
    let mut lowest: Vec<Vec<Complex64>> = Vec::new();
    for c in 0..parts * k {
        if lowest.len() == count {
            break;
        }
        let part = |r: usize| if r < parts * k { eigen.U()[(r, c)] } else { 0.0 };
        let mut vector: Vec<Complex64> = (0..k).map(|r| Complex64::new(part(r), part(k + r))).collect();
        for other in &lowest {
            let along: Complex64 = other.iter().zip(&vector).map(|(a, b)| a.conj() * b).sum();
            vector.iter_mut().zip(other).for_each(|(x, y)| *x -= along * y);
        }
        // Every complex vector is there twice, the second time turned by i or so: nothing is left of that.
        let norm = vector.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
        if norm > 1e-3 {
            lowest.push(vector.iter().map(|x| x / norm).collect());
        }
    }
    Ok((eigen.S()[0], lowest))
}

/// The sum of vectors times numbers.
fn combination(vectors: &[Vec<Complex64>], factors: &[Complex64]) -> Vec<Complex64> {
    let mut sum = vec![Complex64::ZERO; vectors[0].len()];
    for (vector, factor) in vectors.iter().zip(factors) {
        sum.iter_mut().zip(vector).for_each(|(s, x)| *s += factor * x);
    }
    sum
}

/// Gram–Schmidt, twice; vectors that depend on others are left out.
fn orthonormal(
    form: &Form,
    vectors: impl Iterator<Item = Vec<Complex64>>,
    areas: &[f64],
) -> Vec<Vec<Complex64>> {
    let product = |a: &[Complex64], b: &[Complex64]| {
        form.inner(a.iter().zip(b.iter().zip(areas).map(|(b, area)| b * area)))
    };
    let mut basis: Vec<Vec<Complex64>> = Vec::new();
    'vectors: for mut vector in vectors {
        for _ in 0..2 {
            let before = product(&vector, &vector).re.sqrt();
            if !basis.is_empty() {
                let parts: Vec<Complex64> = basis.iter().map(|b| -product(b, &vector)).collect();
                vector.iter_mut().zip(combination(&basis, &parts)).for_each(|(x, along)| *x += along);
            }
            let norm = product(&vector, &vector).re.sqrt();
            if norm <= 1e-10 * before {
                continue 'vectors;
            }
            vector.iter_mut().for_each(|x| *x /= norm);
        }
        basis.push(vector);
    }
    basis
}

#[cfg(test)]
mod tests {
    use ndf_core::{DVec3, NoProgress};
    use ndf_intrinsic::IntrinsicMesh;
    use ndf_mesh::{ManifoldMesh, shapes};

    use super::*;
    use crate::bundle::TangentBundle;
    use crate::connection::{areas, connection_laplacian};

    /// A drop whose field of crosses is small in its thick end.
    fn drop_shaped() -> TangentBundle {
        let drawn = |p: DVec3| DVec3::new(p.x, p.y, 4.0 * p.z) * (0.15 + 0.5 * (p.z + 1.0));
        let mesh = shapes::icosphere(5).map_positions(drawn);
        TangentBundle::new(&IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh).unwrap()))
    }

    #[test]
    fn the_smallest_eigenvector_is_one_wherever_it_is_small() {
        let bundle = drop_shaped();
        let areas = areas(&bundle);
        for n in [1, 2, 4] {
            let form = Form::Hermitian(connection_laplacian(&bundle, n));
            let (energy, found) = smallest_eigenvector(&form, &areas, &NoProgress).unwrap();
            let image = form.image(&found);
            let square = |z: Complex64, area: f64| z.norm_sqr() * area;
            let left: f64 =
                (0..found.len()).map(|v| square(image[v] / areas[v] - energy * found[v], areas[v])).sum();
            assert!(left.sqrt() < 1e-5 * energy, "n = {n}: {:.1e}", left.sqrt() / energy);
        }
    }

    #[test]
    fn eigenvectors_of_a_multiple_eigenvalue_are_independent() {
        let (a, b) = (Complex64::new(0.6, 0.0), Complex64::new(0.0, 0.8));
        let form = Form::Hermitian(CsrMatrix::symmetric(&[Complex64::ZERO; 3], std::iter::empty()));
        // 1 on a plane and 3 on the line of (a, b, 0).
        let line = [a, b, Complex64::ZERO];
        let matrix = Mat::from_fn(3, 3, |i, j| {
            2.0 * line[i] * line[j].conj() + Complex64::from(f64::from(u8::from(i == j)))
        });
        let (lowest, vectors) = lowest_eigenvectors(&form, &matrix, 3).unwrap();
        approx::assert_abs_diff_eq!(lowest, 1.0, epsilon = 1e-12);
        for (i, x) in vectors.iter().enumerate() {
            for (j, y) in vectors.iter().enumerate() {
                let product: Complex64 = x.iter().zip(y).map(|(x, y)| x.conj() * y).sum();
                assert!((product - f64::from(u8::from(i == j))).norm() < 1e-12, "{product}");
            }
            let eigenvalue = if i < 2 { 1.0 } else { 3.0 };
            for r in 0..3 {
                let image: Complex64 = (0..3).map(|c| matrix[(r, c)] * x[c]).sum();
                assert!((image - eigenvalue * x[r]).norm() < 1e-12);
            }
        }
        assert_eq!(vectors.len(), 3);
    }
}
