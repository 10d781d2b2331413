//! Block Lanczos with thick restart for `(L − μM)⁻¹ M`, which is self-adjoint in the inner product of M, whether the shift μ
//! is below all eigenvalues or among them.
//!
//! The space grows by blocks. A solve costs as much as reading the factor, which a block reads once; and blocks find
//! multiple eigenvalues that single vectors see only by rounding. Every new block is orthogonalised against all
//! before it, twice where much of it cancels (full reorthogonalisation), and the projected operator is kept as
//! computed, so that a restart is no more than a change of basis (Wu and Simon 2000, "Thick-restart Lanczos method for
//! large symmetric eigenvalue problems"; Stewart 2002 for the Krylov–Schur view). Shift and invert: Ericsson and Ruhe
//! 1980.
//!
//! Functions are stored in the order of the factor's rows, so that solves need not permute them.
//!
//! The kernel of L is known (constants on components) and kept out of the space: what remains has eigenvalues of one
//! order of magnitude, however small the shift.

use faer::Mat;

use crate::assembly::permuted;
use crate::components::Components;
use crate::csr::CsrMatrix;
use crate::dense;
use crate::error::SpectralError;
use crate::factorisation::Inverse;
use crate::laplace_beltrami::LaplaceBeltrami;
use crate::orthonormal::{Random, orthonormalise};
use crate::panel::{Panel, Row, WIDTH, add_combination, multiply, products, products_through, transform};

/// A Krylov space with the operator projected onto it.
pub(crate) struct KrylovSpace<'a> {
    inverse: &'a dyn Inverse,
    /// The mass matrix and the components in the factor's order.
    mass: CsrMatrix,
    components: Components,
    /// M-orthonormal functions that span the space, and the next block last.
    basis: Vec<Panel>,
    /// The operator on the span; the upper triangle is meant.
    projected: Mat<f64>,
    /// How the image of the last block leaves the space: in the next block.
    coupling: Mat<f64>,
    /// Whether the image of the next block has large parts along all of the basis, not just along its last blocks.
    coupled_to_all: bool,
    /// Products with the mass matrix, kept for their memory.
    massed: Panel,
    random: Random,
}

/// Eigenpairs of the projected operator, the largest magnitude first.
pub(crate) struct Ritz {
    /// Values θ = 1/(λ − μ).
    pub(crate) values: Vec<f64>,
    /// Coefficients in the basis, a column each.
    vectors: Mat<f64>,
    /// What the image of the vector has outside the space, a column each, in the next block.
    remainders: Mat<f64>,
}

impl Ritz {
    /// Residual of a pair relative to its value.
    pub(crate) fn residual(&self, i: usize) -> f64 {
        self.remainders.col(i).norm_l2() / self.values[i].abs()
    }

    /// How many of the first `wanted` pairs have residuals below a tolerance, up to the first that has not.
    pub(crate) fn converged(&self, wanted: usize, tolerance: f64) -> usize {
        (0..wanted.min(self.values.len())).take_while(|&i| self.residual(i) <= tolerance).count()
    }
}

impl<'a> KrylovSpace<'a> {
    /// A space without dimensions; the next block is random functions.
    pub(crate) fn new(operator: &LaplaceBeltrami, inverse: &'a dyn Inverse) -> Result<Self, SpectralError> {
        let (order, position) = inverse.order();
        let mut space = Self {
            inverse,
            mass: permuted(operator.mass(), order, position),
            components: operator.components().permuted(order),
            basis: Vec::new(),
            projected: Mat::zeros(0, 0),
            coupling: Mat::zeros(WIDTH, WIDTH),
            coupled_to_all: true,
            massed: Panel::new(),
            random: Random::default(),
        };
        let start = space.fresh_block()?;
        space.basis.push(start);
        Ok(space)
    }

    /// Dimensions.
    pub(crate) fn size(&self) -> usize {
        self.projected.nrows()
    }

    /// Replaces the next block by random functions orthogonal to the space.
    pub(crate) fn renew_block(&mut self) -> Result<(), SpectralError> {
        self.basis.pop();
        let block = self.fresh_block()?;
        self.basis.push(block);
        self.coupling.as_mut().fill(0.0);
        self.coupled_to_all = true;
        Ok(())
    }

    /// Images of random functions, orthogonal to the whole basis. Plain noise would leave traces in all results:
    /// parts that are rounding errors in the coefficients become large when L is applied to them.
    /// Where lengths differ by so much that all images are alike to the last digits there are none.
    fn fresh_block(&mut self) -> Result<Panel, SpectralError> {
        let rows = self.mass.row_count();
        let noise: Panel = (0..rows).map(|_| Row(std::array::from_fn(|_| self.random.next()))).collect();
        let mut block = Panel::new();
        multiply(&self.mass, &noise, &mut block);
        self.inverse.solve_in_order(&mut block)?;
        for _ in 0..2 {
            self.orthogonalise(&mut block);
        }
        let mut block = vec![block];
        orthonormalise(&self.mass, &mut block, WIDTH).ok_or(SpectralError::Degenerate)?;
        Ok(block.swap_remove(0))
    }

    /// Takes the means and the part along the basis from functions; returns the coefficients of that part.
    fn orthogonalise(&mut self, functions: &mut Panel) -> Mat<f64> {
        multiply(&self.mass, functions, &mut self.massed);
        self.components.remove_means(functions, &self.massed);
        let coefficients = products(&self.basis, &self.massed);
        add_combination(functions, -1.0, &self.basis, &coefficients);
        coefficients
    }

    /// Applies the operator to the next block, which joins the space; what the image has outside is the new next block.
    ///
    /// # Errors
    /// If there are no new directions to go on in.
    pub(crate) fn expand(&mut self) -> Result<(), SpectralError> {
        let size = self.size();
        let mut image = Panel::new();
        multiply(&self.mass, &self.basis[size / WIDTH], &mut image);
        self.inverse.solve_in_order(&mut image)?;
        // First the large part: along the last two blocks, but for the first image after a change of basis. Then the
        // means and all that rounding has left along the basis.
        let first =
            if std::mem::take(&mut self.coupled_to_all) { 0 } else { self.basis.len().saturating_sub(2) };
        let last = &self.basis[first..];
        let large = products_through(&self.mass, last, std::slice::from_ref(&image));
        add_combination(&mut image, -1.0, last, &large);
        let mut coefficients = self.orthogonalise(&mut image);
        let mut rows = coefficients.subrows_mut(first * WIDTH, large.nrows());
        rows += large;
        let grown = size + WIDTH;
        self.projected.resize_with(grown, grown, |_, _| 0.0);
        self.projected.subcols_mut(size, WIDTH).copy_from(&coefficients);
        let mut image = vec![image];
        match orthonormalise(&self.mass, &mut image, WIDTH) {
            Some(triangle) => {
                self.basis.append(&mut image);
                self.coupling = triangle;
            }
            None => {
                // The space is invariant, or nearly: continue in new directions.
                let block = self.fresh_block()?;
                self.basis.push(block);
                self.coupling.as_mut().fill(0.0);
                self.coupled_to_all = true;
            }
        }
        Ok(())
    }

    /// Eigenpairs of the projected operator. O(size³).
    pub(crate) fn ritz(&self) -> Ritz {
        let size = self.size();
        let symmetric = Mat::from_fn(size, size, |i, j| self.projected[(i.min(j), i.max(j))]);
        let (ascending, eigenvectors) = dense::self_adjoint_eigen(&symmetric);
        let mut order: Vec<usize> = (0..size).rev().collect();
        order.sort_by(|&a, &b| ascending[b].abs().total_cmp(&ascending[a].abs()));
        let values = order.iter().map(|&i| ascending[i]).collect();
        let vectors = Mat::from_fn(size, size, |i, j| eigenvectors[(i, order[j])]);
        let remainders = dense::product(&self.coupling, vectors.subrows(size - WIDTH, WIDTH));
        Ritz { values, vectors, remainders }
    }

    /// Shrinks the space to at least the first `keep` Ritz vectors; the next block stays. Returns the pairs of the smaller space.
    pub(crate) fn restart(&mut self, ritz: &Ritz, keep: usize) -> Ritz {
        let keep = keep.next_multiple_of(WIDTH).min(self.size());
        let next = self.basis.pop().expect("the next block is always there");
        transform(&mut self.basis, &ritz.vectors.subcols(0, keep).to_owned());
        self.basis.push(next);
        self.projected = Mat::zeros(keep, keep);
        self.coupled_to_all = true;
        (0..keep).for_each(|i| self.projected[(i, i)] = ritz.values[i]);
        Ritz {
            values: ritz.values[..keep].to_vec(),
            vectors: Mat::identity(keep, keep),
            remainders: ritz.remainders.subcols(0, keep).to_owned(),
        }
    }

    /// Some Ritz functions, M-orthonormal, each improved by its remainder: `θ⁻¹` times its image under
    /// the operator, which costs nothing here and makes residuals of Lφ = λMφ as small as those of the inverse problem
    /// (Ericsson and Ruhe 1980, §4). In the order of the vertices.
    pub(crate) fn into_functions(mut self, ritz: &Ritz, pairs: &[usize]) -> Vec<Panel> {
        if pairs.is_empty() {
            return Vec::new();
        }
        let size = self.size();
        let coefficients = Mat::from_fn(size + WIDTH, pairs.len(), |i, k| {
            let j = pairs[k];
            if i < size { ritz.vectors[(i, j)] } else { ritz.remainders[(i - size, j)] / ritz.values[j] }
        });
        let mut functions = std::mem::take(&mut self.basis);
        transform(&mut functions, &coefficients);
        // The remainders tilt the functions by no more than the residuals: the factor is nearly the identity.
        orthonormalise(&self.mass, &mut functions, pairs.len()).expect("Ritz functions are independent");
        let (_, position) = self.inverse.order();
        functions.iter_mut().for_each(|panel| *panel = position.iter().map(|&i| panel[i]).collect());
        functions
    }
}
