//! Functions on a surface as sums of modes (Taubin 1995; Vallet and Lévy 2008).

use nalgebra_sparse::na::{DMatrix, DVector};

use crate::laplace_beltrami::LaplaceBeltrami;
use crate::modes::Modes;

impl Modes {
    /// Coefficients `Φᵀ M u` of functions (V × any) in the modes. The operator is that of the modes.
    ///
    /// # Panics
    /// If there is not one value for every vertex.
    pub fn coefficients(&self, operator: &LaplaceBeltrami, functions: &DMatrix<f64>) -> DMatrix<f64> {
        self.functions.tr_mul(&(operator.mass() * functions))
    }

    /// The function of coefficients weighted by a filter of the eigenvalue: `Σ h(λ) ⟨φ, u⟩ φ`. With `h = 1` the nearest
    /// function that the modes span, in the inner product of the mass matrix; with `exp(−λt)` what heat flow leaves of
    /// it after a time `t`.
    ///
    /// # Panics
    /// If there is not one value for every vertex.
    pub fn filtered(
        &self,
        operator: &LaplaceBeltrami,
        values: &[f64],
        filter: impl Fn(f64) -> f64,
    ) -> Vec<f64> {
        assert_eq!(values.len(), self.functions.nrows());
        let mut coefficients =
            self.coefficients(operator, &DMatrix::from_column_slice(values.len(), 1, values));
        for (coefficient, &lambda) in coefficients.iter_mut().zip(&self.eigenvalues) {
            *coefficient *= filter(lambda);
        }
        let filtered: DVector<f64> = &self.functions * coefficients.column(0);
        filtered.as_slice().to_vec()
    }

    /// The part of a function in modes up to a cutoff eigenvalue: [`filtered`](Self::filtered) by a step.
    ///
    /// # Panics
    /// If there is not one value for every vertex.
    pub fn low_pass(&self, operator: &LaplaceBeltrami, values: &[f64], cutoff: f64) -> Vec<f64> {
        self.filtered(operator, values, |lambda| f64::from(u8::from(lambda <= cutoff)))
    }
}
