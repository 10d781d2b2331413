//! How modes are computed: by dense matrices, by one Krylov space, or slice by slice.

use ndf_core::progress::Progress;

use crate::csr::CsrMatrix;
use crate::dense;
use crate::error::SpectralError;
use crate::factorisation::{Inverse, SymbolicCholesky};
use crate::found::Found;
use crate::krylov::{KrylovSpace, Ritz};
use crate::laplace_beltrami::LaplaceBeltrami;
use crate::modes::{Inversion, ModeOptions, Modes};
use crate::multigrid::Multigrid;
use crate::panel::{Panel, WIDTH};
use crate::screened_poisson::ScreenedPoisson;
use crate::slices::{SHARPER, SLICE};

/// Below so many vertices all modes are found at once by dense matrices.
const DENSE: usize = 300;

/// More modes than these are found slice by slice. Orthogonalising costs the square of what is found at once.
const AT_ONCE: usize = 128;

/// A computation of modes.
pub(crate) struct Solver<'a> {
    pub(crate) operator: &'a LaplaceBeltrami,
    /// The factorisation to use, if there is one already.
    pub(crate) factored: Option<&'a ScreenedPoisson<'a>>,
    pub(crate) options: &'a ModeOptions,
    pub(crate) progress: &'a dyn Progress,
}

/// The lower part of the spectrum.
pub(crate) struct Part<'a> {
    /// Its modes.
    pub(crate) found: Found<'a>,
    /// The functions that were found last, if more are to follow.
    pub(crate) last: Vec<Panel>,
    /// Where it ends.
    pub(crate) end: f64,
    /// How many eigenvalues lie below its end.
    pub(crate) below: usize,
    /// Whether the inertia confirmed that none is missing.
    pub(crate) verified: bool,
}

/// The inverse of `L + σM`, and what else an iteration needs.
struct ShiftInvert<'a> {
    inverse: &'a dyn Inverse,
    shift: f64,
    /// For the inertia of other shifts.
    symbolic: Option<&'a SymbolicCholesky>,
}

/// A place in the spectrum between two eigenvalues.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cut {
    /// How many of some eigenvalues lie below.
    pub(crate) below: usize,
    /// A number above those and below all others.
    pub(crate) bound: f64,
}

impl Cut {
    /// The cut below the eigenvalue `i` of some, ascending.
    fn before(i: usize, values: &[f64]) -> Self {
        let (last, next) = (values[i - 1], values.get(i).copied().unwrap_or(f64::INFINITY));
        Self { below: i, bound: last + 0.5 * (next - last).min(1e-3 * last) }
    }

    /// The last cut within the first `wanted` of some eigenvalues, ascending, or behind them, that is no cluster's: inside a cluster, that
    /// may end at the last mode by chance, counts mean nothing. `None` if all are one.
    pub(crate) fn last(values: &[f64], wanted: usize) -> Option<Self> {
        let value = |i: usize| values.get(i).copied().unwrap_or(f64::INFINITY);
        let wide = |i: &usize| value(*i) - value(i - 1) > 1e-5 * value(i - 1);
        (1..=wanted).rev().find(wide).map(|i| Self::before(i, values))
    }

    /// The cut in the widest gap of the last quarter of some eigenvalues, ascending. `None` if there are fewer than two.
    pub(crate) fn widest(values: &[f64]) -> Option<Self> {
        let gap = |i: usize| (values[i] - values[i - 1]) / values[i];
        let first = (3 * values.len() / 4).max(1);
        (first..values.len()).max_by(|&a, &b| gap(a).total_cmp(&gap(b))).map(|i| Self::before(i, values))
    }
}

impl<'a> Solver<'a> {
    pub(crate) fn run(&self) -> Result<Modes, SpectralError> {
        // From inside the pool, or every product of panels would wake it anew.
        rayon::scope(|_| self.run_in_pool())
    }

    fn run_in_pool(&self) -> Result<Modes, SpectralError> {
        let mut found = Found::kernel(self.operator, self.options.count);
        let kernel = found.len();
        let wanted = self.options.count - kernel;
        if wanted == 0 {
            return Ok(found.finish(true));
        }
        let first = if wanted > AT_ONCE { SLICE } else { wanted };
        let others = self.operator.vertex_count() - self.operator.components().count();
        if others < DENSE.max(2 * capacity(first)) || others < 2 * wanted {
            let (values, functions) = dense::modes(self.operator, self.options.count)?;
            for k in kernel..values.len() {
                found.push(values[k], |target| {
                    target.iter_mut().zip(functions.col(k).iter()).for_each(|(x, value)| *x = *value);
                });
            }
            return Ok(found.finish(true));
        }
        if self.factored.is_none() && self.options.inversion == Inversion::Multigrid {
            let shift = self.options.shift_for(self.operator);
            let inverse = Multigrid::new(self.shifted(-shift), SHARPER * self.options.tolerance)?;
            let shift_invert = ShiftInvert { inverse: &inverse, shift, symbolic: None };
            let all = self.smallest(&shift_invert, wanted, found)?;
            return Ok(all.found.finish(false));
        }
        self.progress.report("factoring", 0.0);
        let own;
        let factored = match self.factored {
            Some(factored) => factored,
            None => {
                own = ScreenedPoisson::new(self.operator, self.options.shift_for(self.operator))?;
                &own
            }
        };
        self.progress.check()?;
        let symbolic = factored.cholesky().symbolic();
        let shift_invert =
            ShiftInvert { inverse: factored.cholesky(), shift: factored.shift(), symbolic: Some(symbolic) };
        let part = self.smallest(&shift_invert, first, found)?;
        if part.found.len() == self.options.count {
            return Ok(part.found.finish(part.verified));
        }
        match self.slices(symbolic, part)? {
            Some(modes) => Ok(modes),
            // No slice can end within a cluster of more eigenvalues than it has.
            None => {
                let found = Found::kernel(self.operator, self.options.count);
                let all = self.smallest(&shift_invert, wanted, found)?;
                Ok(all.found.finish(all.verified))
            }
        }
    }

    /// `L − μM`.
    pub(crate) fn shifted(&self, shift: f64) -> CsrMatrix {
        self.operator.laplacian().plus(-shift, self.operator.mass())
    }

    /// What is said when the iteration ends too early.
    fn not_converged(&self, found: Found<'_>, applications: usize) -> SpectralError {
        let (found, asked) = (Box::new(found.finish(false)), self.options.count);
        SpectralError::NotConverged { found, asked, applications }
    }

    /// Adds the smallest eigenvalues that are not zero: those wanted, or, if there are to be more, those up to a gap.
    fn smallest(
        &self,
        shift_invert: &ShiftInvert<'_>,
        wanted: usize,
        mut found: Found<'a>,
    ) -> Result<Part<'a>, SpectralError> {
        let ShiftInvert { inverse, shift, symbolic } = *shift_invert;
        let (kernel, capacity) = (found.len(), capacity(wanted));
        let is_all = kernel + wanted == self.options.count;
        let tolerance = self.options.tolerance * if is_all { 1.0 } else { SHARPER };
        let mut space = KrylovSpace::new(self.operator, inverse)?;
        let mut applications = 0;
        for round in 0..=self.options.max_restarts {
            let is_last = round == self.options.max_restarts;
            let ritz = self.converge(&mut space, wanted, capacity, tolerance, &mut applications)?;
            let values: Vec<f64> = ritz.values.iter().map(|theta| theta.recip() - shift).collect();
            let converged = ritz.converged(wanted, tolerance);
            let mut keep = |space: KrylovSpace<'_>, ritz: &Ritz, count: usize| {
                let pairs: Vec<usize> = (0..count).collect();
                let functions = space.into_functions(ritz, &pairs);
                found.extend(&values[..count], &functions);
                functions
            };
            if converged < wanted {
                if is_last {
                    keep(space, &ritz, converged);
                    return Err(self.not_converged(found, applications));
                }
                space.restart(&ritz, wanted + (capacity - wanted) * 3 / 8);
                continue;
            }
            let cut = if is_all { Cut::last(&values, wanted) } else { Cut::widest(&values[..wanted]) };
            // The factorisation that counts takes the place of what is not needed any more.
            let ritz = space.restart(&ritz, wanted);
            let missing = match symbolic {
                Some(symbolic) if self.options.verify => self.missing(symbolic, kernel, cut)?,
                _ => None,
            };
            if missing.is_none_or(|missing| missing == 0) || is_last {
                let below = cut.map_or(wanted, |cut| cut.below);
                let kept = keep(space, &ritz, if is_all { wanted } else { below });
                let last = if is_all { Vec::new() } else { kept };
                let end = cut.map_or(f64::INFINITY, |cut| cut.bound);
                let below = kernel + below + missing.unwrap_or(0);
                return Ok(Part { found, last, end, below, verified: missing == Some(0) });
            }
            space.renew_block()?;
        }
        unreachable!("the last round returns")
    }

    /// Expands the space until the wanted pairs have converged or it is full.
    fn converge(
        &self,
        space: &mut KrylovSpace<'_>,
        wanted: usize,
        capacity: usize,
        tolerance: f64,
        applications: &mut usize,
    ) -> Result<Ritz, SpectralError> {
        loop {
            space.expand()?;
            *applications += WIDTH;
            self.progress.check()?;
            if space.size() >= wanted + WIDTH || space.size() >= capacity {
                let ritz = space.ritz();
                let converged = ritz.converged(wanted, tolerance);
                self.progress.report("modes", converged as f64 / self.options.count as f64);
                if converged == wanted || space.size() >= capacity {
                    return Ok(ritz);
                }
            }
        }
    }

    /// How many eigenvalues below a cut are missing, beside so many that are smaller than all that the cut counts; `None` where that
    /// cannot be told.
    pub(crate) fn missing(
        &self,
        symbolic: &SymbolicCholesky,
        smaller: usize,
        cut: Option<Cut>,
    ) -> Result<Option<usize>, SpectralError> {
        let Some(cut) = cut else { return Ok(None) };
        self.progress.report("verifying", 0.0);
        let negative = symbolic.negative_eigenvalues(&self.shifted(cut.bound))?;
        Ok(negative.and_then(|negative| negative.checked_sub(smaller + cut.below)))
    }
}

/// Dimension of the space at which it is restarted.
fn capacity(wanted: usize) -> usize {
    (wanted + wanted.max(48)).next_multiple_of(WIDTH)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spectra_are_cut_in_gaps() {
        let values = [1.0, 2.0, 2.0 + 1e-9, 3.0, 5.0, 5.1];
        let found = [Cut::last(&values, 6), Cut::last(&values, 2), Cut::widest(&values)].map(Option::unwrap);
        for (cut, below) in found.iter().zip([6, 1, 4]) {
            assert_eq!(cut.below, below);
            assert!(cut.bound > values[below - 1]);
            assert!(values.get(below).is_none_or(|next| cut.bound < *next));
        }
        assert_eq!(Cut::last(&[2.0, 2.0, 2.0], 2), None);
        assert_eq!(Cut::widest(&values), Some(Cut { below: 4, bound: 3.0 * (1.0 + 5e-4) }));
        assert_eq!(Cut::widest(&[1.0]), None);
    }
}
