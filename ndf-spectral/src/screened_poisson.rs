//! One factorisation of `L + σM` for the linear problems on a surface: screened Poisson, Poisson and heat flow.

use ndf_core::progress::Progress;

use crate::error::SpectralError;
use crate::factorisation::{Cholesky, SymbolicCholesky};
use crate::laplace_beltrami::LaplaceBeltrami;
use crate::modes::{ModeOptions, Modes};
use crate::solver::Solver;

/// The factored operator `L + σM`.
#[derive(Clone, Debug)]
pub struct ScreenedPoisson<'a> {
    operator: &'a LaplaceBeltrami,
    cholesky: Cholesky,
    shift: f64,
}

impl<'a> ScreenedPoisson<'a> {
    /// Analyses and factors `L + σM` for a shift σ > 0, in inverse squared units of length. About O(n^1.5).
    ///
    /// # Errors
    /// If the shift is not positive, memory is short, or the matrix is not positive definite to double precision.
    pub fn new(operator: &'a LaplaceBeltrami, shift: f64) -> Result<Self, SpectralError> {
        Self::factored(operator, shift, None)
    }

    /// The same operator with another shift; shares the ordering and structure of the factor.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_shift(&self, shift: f64) -> Result<Self, SpectralError> {
        Self::factored(self.operator, shift, Some(self.cholesky.symbolic()))
    }

    fn factored(
        operator: &'a LaplaceBeltrami,
        shift: f64,
        symbolic: Option<&SymbolicCholesky>,
    ) -> Result<Self, SpectralError> {
        if !(shift > 0.0 && shift.is_finite()) {
            return Err(SpectralError::Shift(shift));
        }
        let shifted = operator.laplacian().plus(shift, operator.mass());
        let cholesky = match symbolic {
            Some(symbolic) => symbolic.cholesky(&shifted)?,
            None => SymbolicCholesky::new(&shifted)?.cholesky(&shifted)?,
        };
        Ok(Self { operator, cholesky, shift })
    }

    /// The operator that was factored, without the shift.
    pub fn operator(&self) -> &'a LaplaceBeltrami {
        self.operator
    }

    /// The factorisation.
    pub fn cholesky(&self) -> &Cholesky {
        &self.cholesky
    }

    /// The shift σ.
    pub fn shift(&self) -> f64 {
        self.shift
    }

    /// The smallest modes of the operator, with this factorisation; `options.shift` plays no part.
    ///
    /// # Errors
    /// As [`LaplaceBeltrami::modes`].
    pub fn modes(&self, options: &ModeOptions, progress: &dyn Progress) -> Result<Modes, SpectralError> {
        options.check(self.operator.vertex_count())?;
        Solver { operator: self.operator, factored: Some(self), options, progress }.run()
    }

    /// The function `u` with `−Δu + σu = f`: solves (L + σM) u = M f.
    ///
    /// # Panics
    /// If there is not one value for every vertex.
    pub fn screened(&self, f: &[f64]) -> Vec<f64> {
        let mut u = self.operator.mass().multiply(f);
        self.cholesky.solve(&mut [&mut u]);
        u
    }

    /// One implicit step of the heat equation over the time `1/σ` (in squared units of length): solves
    /// (M + L/σ) u′ = M u. For another time take [`with_shift`](Self::with_shift) of its inverse.
    ///
    /// # Panics
    /// If there is not one value for every vertex.
    pub fn heat_step(&self, u: &[f64]) -> Vec<f64> {
        let mut next = self.screened(u);
        next.iter_mut().for_each(|x| *x *= self.shift);
        next
    }

    /// The function `u` with `−Δu = f`, both without their means on every component: solves L u = M f.
    ///
    /// By conjugate gradients, for which the factorisation is a nearly exact preconditioner as long as σ is below
    /// the first eigenvalue that is not zero: then a handful of iterations, each a solve.
    ///
    /// # Errors
    /// If the residual does not come down to 1e-12 of the right-hand side.
    ///
    /// # Panics
    /// If there is not one value for every vertex.
    pub fn poisson(&self, f: &[f64]) -> Result<Vec<f64>, SpectralError> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut f = f.to_vec();
        self.operator.remove_means(&mut f);
        let mut residual = self.operator.mass().multiply(&f);
        let goal = 1e-12 * dot(&residual, &residual).sqrt();
        let mut u = vec![0.0; f.len()];
        let mut direction = vec![0.0; f.len()];
        let mut previous = f64::INFINITY;
        let mut size = 0.0;
        for _ in 0..500 {
            size = dot(&residual, &residual).sqrt();
            if size <= goal {
                self.operator.remove_means(&mut u);
                return Ok(u);
            }
            let mut preconditioned = residual.clone();
            self.cholesky.solve(&mut [&mut preconditioned]);
            self.operator.remove_means(&mut preconditioned);
            let energy = dot(&residual, &preconditioned);
            let keep = energy / previous;
            previous = energy;
            direction.iter_mut().zip(&preconditioned).for_each(|(d, p)| *d = p + keep * *d);
            let image = self.operator.laplacian().multiply(&direction);
            let step = energy / dot(&direction, &image);
            u.iter_mut().zip(&direction).for_each(|(u, d)| *u += step * d);
            residual.iter_mut().zip(&image).for_each(|(r, i)| *r -= step * i);
        }
        Err(SpectralError::SolveNotConverged(1e-12 * size / goal))
    }
}
