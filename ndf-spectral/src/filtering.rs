//! Functions on a surface as sums of modes (Taubin 1995; Vallet and Lévy 2008).

use crate::laplace_beltrami::LaplaceBeltrami;
use crate::modes::Modes;

impl Modes {
    /// The coefficients `⟨φ, u⟩ = φᵀ M u` of a function in the modes. The operator is that of the modes.
    ///
    /// # Panics
    /// If there is not one value for every vertex.
    pub fn coefficients(&self, operator: &LaplaceBeltrami, values: &[f64]) -> Vec<f64> {
        let massed = operator.mass().multiply(values);
        self.functions.iter().map(|function| function.iter().zip(&massed).map(|(f, m)| f * m).sum()).collect()
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
        let coefficients = self.coefficients(operator, values);
        let mut filtered = vec![0.0; values.len()];
        for ((function, coefficient), &lambda) in
            self.functions.iter().zip(coefficients).zip(&self.eigenvalues)
        {
            let weight = filter(lambda) * coefficient;
            filtered.iter_mut().zip(function).for_each(|(x, f)| *x += weight * f);
        }
        filtered
    }

    /// The part of a function in modes up to a cutoff eigenvalue: [`filtered`](Self::filtered) by a step.
    ///
    /// # Panics
    /// If there is not one value for every vertex.
    pub fn low_pass(&self, operator: &LaplaceBeltrami, values: &[f64], cutoff: f64) -> Vec<f64> {
        self.filtered(operator, values, |lambda| f64::from(u8::from(lambda <= cutoff)))
    }
}
