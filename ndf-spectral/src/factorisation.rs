//! Sparse Cholesky factorisations of real and Hermitian matrices that share one pattern, and LDLᵀ.

use std::sync::Arc;

use crate::assembly::permuted;
use crate::csr::CsrMatrix;
use crate::error::SpectralError;
use crate::panel::{Panel, Row, WIDTH, add_scaled, multiply};
use crate::scalar::Scalar;
use crate::triangular::{self, panel, single};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::sparse::linalg::cholesky::{
    self, CholeskySymbolicParams, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, SymbolicSupernodalParams};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Par, Side};

/// Supernodes of up to so many columns are merged if the share of explicit zeros stays below the second number: few
/// larger blocks are faster to solve with than many tiny ones. (The thresholds of CHOLMOD; Chen, Davis, Hager and
/// Rajamanickam 2008.)
const RELAXATION: [(usize, f64); 4] = [(4, 1.0), (16, 0.8), (48, 0.1), (usize::MAX, 0.05)];

/// Entries of LDLᵀ without pivoting above this cost more digits of a solution than modes can spare.
const GROWTH: f64 = 1e3;

/// All threads of the current pool.
#[cfg(not(target_family = "wasm"))]
fn parallelism() -> Par {
    match rayon::current_num_threads() {
        0 | 1 => Par::Seq,
        threads => Par::rayon(threads),
    }
}

/// The only thread there is.
#[cfg(target_family = "wasm")]
fn parallelism() -> Par {
    Par::Seq
}

/// Ordering and structure of the factor of a symmetric pattern: approximate minimum degree (Amestoy, Davis and Duff
/// 1996) and supernodes. Serves every matrix of that pattern; cheap to clone.
#[derive(Clone, Debug)]
pub struct SymbolicCholesky {
    symbolic: Arc<cholesky::SymbolicCholesky<usize>>,
}

impl SymbolicCholesky {
    /// Analyses the pattern of a symmetric or Hermitian matrix. About O(n log n) for surfaces.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn new<T: Scalar>(matrix: &CsrMatrix<T>) -> Result<Self, SpectralError> {
        Self::ordered(matrix, SymmetricOrdering::Amd)
    }

    /// Analyses the pattern of a symmetric matrix of pairs of rows, 2i and 2i + 1, which have entries in the same pairs of columns: those
    /// of maps of complex numbers that are linear over the reals alone. The pairs are ordered, which have a quarter of the entries.
    ///
    /// # Errors
    /// If there is not enough memory.
    ///
    /// # Panics
    /// If the number of rows is odd.
    pub fn of_pairs(matrix: &CsrMatrix) -> Result<Self, SpectralError> {
        let rows = matrix.row_count();
        assert!(rows.is_multiple_of(2), "{rows} rows are not pairs");
        let (mut offsets, mut columns) = (vec![0], Vec::new());
        for row in (0..rows).step_by(2) {
            let start = columns.len();
            for column in [row, row + 1].iter().flat_map(|row| matrix.row(*row).0) {
                columns.push(column / 2);
            }
            columns[start..].sort_unstable();
            let mut kept = start;
            for k in start..columns.len() {
                if k == start || columns[k] != columns[kept - 1] {
                    columns[kept] = columns[k];
                    kept += 1;
                }
            }
            columns.truncate(kept);
            offsets.push(kept);
        }
        let pairs = rows / 2;
        let (mut order, mut position) = (vec![0; pairs], vec![0; pairs]);
        let request = amd::order_scratch::<usize>(pairs, columns.len());
        let mut memory = MemBuffer::try_new(request).map_err(|_| SpectralError::OutOfMemory(rows))?;
        let pattern = SymbolicSparseColMatRef::new_checked(pairs, pairs, &offsets, None, &columns);
        amd::order(&mut order, &mut position, pattern, amd::Control::default(), MemStack::new(&mut memory))
            .map_err(|e| out_of_memory(e, matrix))?;
        let [order, position] =
            [order, position].map(|pairs| pairs.iter().flat_map(|i| [2 * i, 2 * i + 1]).collect::<Vec<_>>());
        Self::ordered(matrix, SymmetricOrdering::Custom(PermRef::new_checked(&order, &position, rows)))
    }

    fn ordered<T: Scalar>(
        matrix: &CsrMatrix<T>,
        ordering: SymmetricOrdering<'_, usize>,
    ) -> Result<Self, SpectralError> {
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            supernodal_params: SymbolicSupernodalParams { relax: Some(&RELAXATION) },
            ..CholeskySymbolicParams::default()
        };
        let symbolic = factorize_symbolic_cholesky(pattern(matrix), Side::Lower, ordering, params);
        Ok(Self { symbolic: Arc::new(symbolic.map_err(|e| out_of_memory(e, matrix))?) })
    }

    /// Stored entries of the factor.
    pub fn fill(&self) -> usize {
        self.symbolic.len_val()
    }

    fn supernodes(&self) -> &SymbolicSupernodalCholesky<usize> {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(supernodes) => supernodes,
            SymbolicCholeskyRaw::Simplicial(_) => unreachable!("the analysis asks for supernodes"),
        }
    }

    /// The Cholesky factorisation of a symmetric or Hermitian positive definite matrix of the analysed pattern. About O(n^1.5) for surfaces.
    ///
    /// # Errors
    /// If the matrix is not positive definite to double precision or memory is short.
    ///
    /// # Panics
    /// If the matrix has another number of rows than the pattern.
    pub fn cholesky<T: Scalar>(&self, matrix: &CsrMatrix<T>) -> Result<Cholesky<T>, SpectralError> {
        let par = parallelism();
        let request = self.symbolic.factorize_numeric_llt_scratch::<T>(par, Default::default());
        let mut memory =
            MemBuffer::try_new(request).map_err(|_| SpectralError::OutOfMemory(matrix.row_count()))?;
        let mut values = vec![T::default(); self.fill()];
        // The conjugates of rows are columns.
        let columns = T::conjugates(matrix.values());
        self.symbolic
            .factorize_numeric_llt(
                &mut values,
                SparseColMatRef::new(pattern(matrix), &columns),
                Side::Lower,
                LltRegularization::default(),
                par,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(|_| SpectralError::NotPositiveDefinite)?;
        triangular::invert_triangles(self.supernodes(), &mut values);
        Ok(Cholesky { symbolic: self.clone(), values })
    }

    /// How many eigenvalues of a symmetric matrix of the analysed pattern are negative, by the signs of the pivots of
    /// LDLᵀ (Sylvester's law of inertia). `None` if the pivots cannot be trusted.
    ///
    /// # Errors
    /// If memory is short.
    pub fn negative_eigenvalues(&self, matrix: &CsrMatrix) -> Result<Option<usize>, SpectralError> {
        Ok(self.pivoted(matrix)?.map(|found| negative(&found.pivots)))
    }

    /// The factorisation LDLᵀ of a symmetric matrix of the analysed pattern that may have negative eigenvalues. `None` if its
    /// pivots cannot be trusted. About O(n^1.5) for surfaces.
    ///
    /// # Errors
    /// If memory is short.
    pub(crate) fn indefinite(&self, matrix: &CsrMatrix) -> Result<Option<Indefinite>, SpectralError> {
        let Some(Pivoted { mut values, pivots }) = self.pivoted(matrix)? else { return Ok(None) };
        self.diagonal().for_each(|slot| values[slot] = 1.0);
        triangular::invert_triangles(self.supernodes(), &mut values);
        let growth = values.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let (order, position) = self.order();
        let refined = (growth > GROWTH).then(|| permuted(matrix, order, position));
        Ok(Some(Indefinite { symbolic: self.clone(), values, pivots, refined }))
    }

    /// LDLᵀ; `None` if a pivot is zero or not finite.
    fn pivoted(&self, matrix: &CsrMatrix) -> Result<Option<Pivoted>, SpectralError> {
        let par = parallelism();
        let request = self.symbolic.factorize_numeric_ldlt_scratch::<f64>(par, Default::default());
        let mut memory =
            MemBuffer::try_new(request).map_err(|_| SpectralError::OutOfMemory(matrix.row_count()))?;
        let mut values = vec![0.0; self.fill()];
        let factored = self.symbolic.factorize_numeric_ldlt(
            &mut values,
            SparseColMatRef::new(pattern(matrix), matrix.values()),
            Side::Lower,
            LdltRegularization::default(),
            par,
            MemStack::new(&mut memory),
            Default::default(),
        );
        if factored.is_err() {
            return Ok(None);
        }
        let pivots: Vec<f64> = self.diagonal().map(|slot| values[slot]).collect();
        let trusted = pivots.iter().all(|p| p.is_finite() && *p != 0.0);
        Ok(trusted.then_some(Pivoted { values, pivots }))
    }

    /// Where the diagonal lies in the values of a factor.
    fn diagonal(&self) -> impl Iterator<Item = usize> + '_ {
        let s = self.supernodes();
        (0..s.n_supernodes()).flat_map(move |node| {
            let columns = s.supernode_end()[node] - s.supernode_begin()[node];
            let rows = columns + s.nnz_per_super()[node];
            (0..columns).map(move |c| s.col_ptr_for_val()[node] + c * rows + c)
        })
    }

    /// The row of the matrix behind every row of a factor, and the inverse: the row of the factor for every row of the
    /// matrix.
    fn order(&self) -> (&[usize], &[usize]) {
        self.symbolic.perm().expect("an ordering was computed").arrays()
    }
}

/// Entries of LDLᵀ, with the pivots on the diagonal, and these.
struct Pivoted {
    values: Vec<f64>,
    pivots: Vec<f64>,
}

/// How many numbers are negative.
fn negative(pivots: &[f64]) -> usize {
    pivots.iter().filter(|p| **p < 0.0).count()
}

/// The inverse of a symmetric matrix, as a factorisation or an iteration applies it.
pub(crate) trait Inverse: Sync {
    /// The order in which rows are solved for: the row of the matrix behind every row of the factor, and the row of the factor for
    /// every row of the matrix.
    fn order(&self) -> (&[usize], &[usize]);

    /// Solves for a panel of right-hand sides in the [order](Self::order) of the factor, which is replaced by the
    /// solutions.
    ///
    /// # Errors
    /// If an iteration does not converge.
    fn solve_in_order(&self, panel: &mut Panel) -> Result<(), SpectralError>;
}

/// A factorisation `P A Pᵀ = L D Lᵀ` of a symmetric matrix, definite or not, without pivoting. Where its entries are large, each solution is
/// refined once (Wilkinson 1963).
pub(crate) struct Indefinite {
    symbolic: SymbolicCholesky,
    /// Trapezoids of the supernodes, with ones on the diagonal, their triangles [inverted](triangular::invert_triangles).
    values: Vec<f64>,
    /// The diagonal of D.
    pivots: Vec<f64>,
    /// The matrix in the factor's order, where solutions are refined.
    refined: Option<CsrMatrix>,
}

impl Indefinite {
    /// How many eigenvalues are negative.
    pub(crate) fn negative_eigenvalues(&self) -> usize {
        negative(&self.pivots)
    }
}

impl Inverse for Indefinite {
    fn order(&self) -> (&[usize], &[usize]) {
        self.symbolic.order()
    }

    fn solve_in_order(&self, panel: &mut Panel) -> Result<(), SpectralError> {
        let solve = |panel: &mut Panel| {
            panel::solve(self.symbolic.supernodes(), &self.values, &self.pivots, panel);
        };
        let Some(matrix) = &self.refined else {
            solve(panel);
            return Ok(());
        };
        let mut remainder = panel.clone();
        solve(panel);
        let mut image = Panel::new();
        multiply(matrix, panel, &mut image);
        add_scaled(&mut remainder, Row([-1.0; WIDTH]), &image);
        solve(&mut remainder);
        add_scaled(panel, Row([1.0; WIDTH]), &remainder);
        Ok(())
    }
}

/// A Cholesky factorisation `P A Pᵀ = L Lᴴ` of a symmetric or Hermitian matrix.
#[derive(Clone, Debug)]
pub struct Cholesky<T = f64> {
    symbolic: SymbolicCholesky,
    /// Trapezoids of the supernodes, their triangles [inverted](triangular::invert_triangles).
    values: Vec<T>,
}

impl<T: Scalar> Cholesky<T> {
    /// The ordering and structure, to factor other matrices of the same pattern.
    pub fn symbolic(&self) -> &SymbolicCholesky {
        &self.symbolic
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.symbolic.symbolic.nrows()
    }

    /// Solves for right-hand sides, each replaced by its solution. Up to four real ones, or two complex ones, are solved for at once: the
    /// factor is read twice for all of them.
    ///
    /// # Panics
    /// If a length is not the number of rows.
    pub fn solve(&self, right_hand_sides: &mut [&mut [T]]) {
        for sides in right_hand_sides.chunks_mut(T::FUNCTIONS) {
            assert!(sides.iter().all(|side| side.len() == self.rows()));
            let (order, _) = self.symbolic.order();
            if let [side] = sides {
                let mut ordered: Vec<T> = order.iter().map(|&i| side[i]).collect();
                single::solve(self.symbolic.supernodes(), &self.values, &mut ordered);
                ordered.iter().zip(order).for_each(|(x, &i)| side[i] = *x);
                continue;
            }
            let mut panel = vec![Row::default(); self.rows()];
            for (c, side) in sides.iter().enumerate() {
                panel.iter_mut().zip(order).for_each(|(row, &i)| side[i].put(row, c));
            }
            self.solve_panel(&mut panel);
            for (c, side) in sides.iter_mut().enumerate() {
                panel.iter().zip(order).for_each(|(row, &i)| side[i] = T::of_row(row, c));
            }
        }
    }

    /// Solves for a panel of right-hand sides in the order of the factor.
    pub(crate) fn solve_panel(&self, panel: &mut Panel) {
        panel::solve(self.symbolic.supernodes(), &self.values, &[], panel);
    }
}

impl Inverse for Cholesky {
    fn order(&self) -> (&[usize], &[usize]) {
        self.symbolic.order()
    }

    fn solve_in_order(&self, panel: &mut Panel) -> Result<(), SpectralError> {
        self.solve_panel(panel);
        Ok(())
    }
}

/// Rows of a symmetric matrix have the pattern of its columns.
fn pattern<T: Scalar>(matrix: &CsrMatrix<T>) -> SymbolicSparseColMatRef<'_, usize> {
    let n = matrix.row_count();
    SymbolicSparseColMatRef::new_checked(n, n, matrix.offsets(), None, matrix.columns())
}

fn out_of_memory<T: Scalar>(_: FaerError, matrix: &CsrMatrix<T>) -> SpectralError {
    SpectralError::OutOfMemory(matrix.row_count())
}

#[cfg(test)]
mod tests {
    use faer::c64;

    use super::*;

    /// The coupling of a complex number and the one before, which is turned to it, on a ring of so many.
    fn turned(i: u32, count: u32) -> (u32, u32, c64) {
        ((i + 1) % count, i, -c64::cis(f64::from(i)))
    }

    fn ring(count: u32) -> CsrMatrix<c64> {
        CsrMatrix::symmetric(&vec![c64::from(2.5); count as usize], (0..count).map(|i| turned(i, count)))
    }

    /// The same in real form.
    fn ring_of_pairs(count: u32) -> CsrMatrix {
        let coupling = |i: u32| {
            let (j, i, c64 { re, im }) = turned(i, count);
            let (row, column) = (2 * j, 2 * i);
            [(row, column, re), (row, column + 1, -im), (row + 1, column, im), (row + 1, column + 1, re)]
        };
        CsrMatrix::symmetric(&vec![2.5; 2 * count as usize], (0..count).flat_map(coupling))
    }

    fn solved<T: Scalar>(
        symbolic: SymbolicCholesky,
        matrix: &CsrMatrix<T>,
        mut sides: Vec<Vec<T>>,
    ) -> Vec<Vec<T>> {
        let cholesky = symbolic.cholesky(matrix).unwrap();
        cholesky.solve(&mut sides.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>());
        sides
    }

    #[test]
    fn complex_systems_are_those_of_their_pairs() {
        let (matrix, pairs) = (ring(40), ring_of_pairs(40));
        let number = |i: usize, side: usize| c64::new((i as f64).cos(), (i as f64 * side as f64).sin());
        let sides: Vec<Vec<c64>> = (1..4).map(|side| (0..40).map(|i| number(i, side)).collect()).collect();
        let found = solved(SymbolicCholesky::new(&matrix).unwrap(), &matrix, sides.clone());
        let real = |sides: &[Vec<c64>]| -> Vec<Vec<f64>> {
            sides.iter().map(|side| side.iter().flat_map(|z| [z.re, z.im]).collect()).collect()
        };
        let near = |a: &[Vec<f64>], b: &[Vec<f64>]| {
            a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-13)
        };
        for (solution, side) in found.iter().zip(&sides) {
            assert!(near(&real(&[matrix.multiply(solution)]), &real(std::slice::from_ref(side))));
        }
        let found = real(&found);
        assert!(near(&found, &solved(SymbolicCholesky::of_pairs(&pairs).unwrap(), &pairs, real(&sides))));
        assert!(near(&found, &solved(SymbolicCholesky::new(&pairs).unwrap(), &pairs, real(&sides))));
    }

    #[test]
    #[should_panic(expected = "not pairs")]
    fn odd_rows_are_no_pairs() {
        let _ = SymbolicCholesky::of_pairs(&CsrMatrix::symmetric(&[1.0], std::iter::empty()));
    }
}
