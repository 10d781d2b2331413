//! Modes as they are found.

use crate::laplace_beltrami::LaplaceBeltrami;
use crate::modes::Modes;
use crate::panel::{Panel, Row, WIDTH, multiply};
use crate::vertex_functions::VertexFunctions;

/// Modes found so far, from the smallest eigenvalue on.
pub(crate) struct Found<'a> {
    operator: &'a LaplaceBeltrami,
    eigenvalues: Vec<f64>,
    functions: VertexFunctions,
}

impl<'a> Found<'a> {
    /// The modes of the kernel: constants on components, at most `count`. There is memory for `count` modes.
    pub(crate) fn kernel(operator: &'a LaplaceBeltrami, count: usize) -> Self {
        let components = operator.components();
        let kernel = count.min(components.count());
        let mut functions = VertexFunctions::with_capacity(operator.vertex_count(), count);
        for k in 0..kernel {
            for (x, &component) in functions.push().iter_mut().zip(components.labels()) {
                if component as usize == k {
                    *x = components.height(k);
                }
            }
        }
        Self { operator, eigenvalues: vec![0.0; kernel], functions }
    }

    /// How many.
    pub(crate) fn len(&self) -> usize {
        self.eigenvalues.len()
    }

    /// Eigenvalues, ascending.
    pub(crate) fn eigenvalues(&self) -> &[f64] {
        &self.eigenvalues
    }

    /// Adds a mode, whose function is written.
    pub(crate) fn push(&mut self, eigenvalue: f64, write: impl FnOnce(&mut [f64])) {
        let function = self.functions.push();
        write(function);
        let sign = sign(function);
        function.iter_mut().for_each(|x| *x *= sign);
        self.eigenvalues.push(eigenvalue);
    }

    /// Adds modes with functions in panels.
    pub(crate) fn extend(&mut self, eigenvalues: &[f64], panels: &[Panel]) {
        for (k, &eigenvalue) in eigenvalues.iter().enumerate() {
            let panel = &panels[k / WIDTH];
            self.push(eigenvalue, |function| {
                function.iter_mut().zip(panel).for_each(|(x, row)| *x = row.0[k % WIDTH]);
            });
        }
    }

    /// The modes, with their residuals.
    pub(crate) fn finish(self, verified: bool) -> Modes {
        let residuals = self.residuals();
        Modes { eigenvalues: self.eigenvalues, functions: self.functions, residuals, verified }
    }

    /// Relative residuals: see [`Modes::residuals`].
    fn residuals(&self) -> Vec<f64> {
        let typical = self.operator.typical_eigenvalue();
        let mut residuals = vec![0.0; self.len()];
        let mut panel = vec![Row::default(); self.operator.vertex_count()];
        let (mut stiffened, mut massed) = (Panel::new(), Panel::new());
        for first in (0..self.len()).step_by(WIDTH) {
            let columns = WIDTH.min(self.len() - first);
            for c in 0..columns {
                panel.iter_mut().zip(&self.functions[first + c]).for_each(|(row, x)| row.0[c] = *x);
            }
            multiply(self.operator.laplacian(), &panel, &mut stiffened);
            multiply(self.operator.mass(), &panel, &mut massed);
            for c in 0..columns {
                let lambda = self.eigenvalues[first + c];
                let (mut difference, mut size) = (0.0, 0.0);
                for (l, m) in stiffened.iter().zip(&massed) {
                    difference += (l.0[c] - lambda * m.0[c]).powi(2);
                    size += m.0[c] * m.0[c];
                }
                let scale = if lambda > 0.0 { lambda } else { typical };
                residuals[first + c] = difference.sqrt() / (size.sqrt() * scale);
            }
        }
        residuals
    }
}

/// The sign that makes the entry of largest magnitude positive; of those within 1e-6 of it the first decides.
fn sign(function: &[f64]) -> f64 {
    let largest = function.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let first = function.iter().find(|x| x.abs() >= (1.0 - 1e-6) * largest);
    first.map_or(1.0, |x| 1.0_f64.copysign(*x))
}
