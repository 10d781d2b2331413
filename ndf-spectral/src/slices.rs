//! Many modes, slice by slice (Grimes, Lewis and Simon 1994, "A shifted block Lanczos algorithm for solving sparse symmetric
//! generalized eigenproblems").
//!
//! The factorisation LDLᵀ of L − μM, with a shift μ among the eigenvalues, gives those nearest to μ on both sides, and the signs of
//! its pivots how many lie below μ. A slice begins where the part of the spectrum that is known ends; it has all eigenvalues from there to
//! its shift, as many as the pivots tell, and about as many above. It ends in a gap, where they are counted again.

use crate::error::SpectralError;
use crate::factorisation::{Indefinite, SymbolicCholesky};
use crate::krylov::{KrylovSpace, Ritz};
use crate::modes::Modes;
use crate::panel::{Panel, WIDTH, add_combination, products_through};
use crate::solver::{Cut, Part, Solver};

/// About so many modes are found at once. Fewer cost more factorisations, more cost more orthogonalisation.
pub(crate) const SLICE: usize = 80;

/// Dimension at which the space of a slice is restarted.
const CAPACITY: usize = 3 * SLICE;

/// By what the tolerance is multiplied: functions of different slices are as orthogonal as their residuals are small.
pub(crate) const SHARPER: f64 = 0.01;

/// How often another shift is tried before slices are given up.
const ATTEMPTS: usize = 8;

/// The modes of a slice, by ascending eigenvalue.
struct Slice {
    eigenvalues: Vec<f64>,
    functions: Vec<Panel>,
    end: f64,
    /// Eigenvalues below the end that it lacks; `None` if that is not known.
    missing: Option<usize>,
}

/// What a shift finds.
enum Attempt {
    Found(Slice),
    /// The shift, or what was found with it, is no good: the slice is to be narrower by a factor.
    Narrower(f64),
}

impl<'a> Solver<'a> {
    /// All modes from those of a part on; `None` if the spectrum cannot be cut, since more eigenvalues than a slice has are one.
    pub(crate) fn slices(
        &self,
        symbolic: &SymbolicCholesky,
        mut part: Part<'a>,
    ) -> Result<Option<Modes>, SpectralError> {
        while part.found.len() < self.options.count {
            let mut width = 0.5 * SLICE as f64 * spacing(part.found.eigenvalues());
            let mut attempts = 0;
            let mut slice = loop {
                match self.slice(symbolic, &part, width)? {
                    Attempt::Found(slice) => break slice,
                    Attempt::Narrower(factor) => width *= factor,
                }
                attempts += 1;
                if attempts == ATTEMPTS {
                    return Ok(None);
                }
            };
            // Errors of functions along each other are those of the residuals over the distance of the eigenvalues, which is small
            // only across the cut.
            for panel in &mut slice.functions {
                let along = products_through(self.operator.mass(), &part.last, std::slice::from_ref(panel));
                add_combination(panel, -1.0, &part.last, &along);
            }
            part.found.extend(&slice.eigenvalues, &slice.functions);
            part.end = slice.end;
            part.below += slice.eigenvalues.len() + slice.missing.unwrap_or(0);
            part.verified &= slice.missing == Some(0);
            part.last = slice.functions;
        }
        Ok(Some(part.found.finish(part.verified)))
    }

    /// The slice whose shift is so far beyond the end of the part that is known.
    fn slice(
        &self,
        symbolic: &SymbolicCholesky,
        part: &Part<'a>,
        width: f64,
    ) -> Result<Attempt, SpectralError> {
        let remaining = self.options.count - part.found.len();
        let shift = part.end + width;
        let Some(inverse) = symbolic.indefinite(&self.shifted(shift))? else {
            return Ok(Attempt::Narrower(0.97));
        };
        let Some(left) = inverse.negative_eigenvalues().checked_sub(part.below) else {
            return Ok(Attempt::Narrower(0.97));
        };
        if left > SLICE {
            return Ok(Attempt::Narrower(0.5 * SLICE as f64 / left as f64));
        }
        // One more than is wanted shows the gap behind.
        let right = (remaining + 1).saturating_sub(left).min(3 * SLICE / 8);
        let tolerance = SHARPER * self.options.tolerance;
        let sought = Sought { start: part.end, shift, left, right, tolerance };
        let Some((space, ritz, pairs)) = self.around(&inverse, &sought)? else {
            return Ok(Attempt::Narrower(0.8));
        };
        let values: Vec<f64> = pairs.iter().map(|&i| sought.eigenvalue(&ritz, i)).collect();
        let is_last = values.len() >= remaining;
        let cut = if is_last { Cut::last(&values, remaining) } else { Cut::widest(&values) };
        let (below, end) = cut.map_or((0, f64::INFINITY), |cut| (cut.below, cut.bound));
        let kept = if is_last { remaining } else { below };
        if kept == 0 || !is_last && end >= values[below] {
            return Ok(Attempt::Narrower(0.8));
        }
        let functions = space.into_functions(&ritz, &pairs[..kept]);
        drop(inverse);
        let missing = match self.options.verify {
            true => self.missing(symbolic, part.below, cut)?,
            false => None,
        };
        if missing.is_some_and(|missing| missing > 0) {
            return Ok(Attempt::Narrower(0.8));
        }
        let progress = (part.found.len() + kept) as f64 / self.options.count as f64;
        self.progress.report("modes", progress);
        Ok(Attempt::Found(Slice { eigenvalues: values[..kept].to_vec(), functions, end, missing }))
    }

    /// The space in which all that is sought has converged, and the pairs by ascending eigenvalue; `None` if there are more than
    /// there can be, or they do not converge.
    fn around<'i>(
        &self,
        inverse: &'i Indefinite,
        sought: &Sought,
    ) -> Result<Option<(KrylovSpace<'i>, Ritz, Vec<usize>)>, SpectralError> {
        let mut space = KrylovSpace::new(self.operator, inverse)?;
        let least = sought.left + sought.right + WIDTH;
        for _ in 0..=self.options.max_restarts {
            loop {
                space.expand()?;
                self.progress.check()?;
                let is_full = space.size() >= CAPACITY;
                if space.size() < least && !is_full {
                    continue;
                }
                let ritz = space.ritz();
                let (pairs, left) = sought.converged(&ritz);
                if left > sought.left {
                    return Ok(None);
                }
                if left == sought.left && pairs.len() >= sought.left + sought.right {
                    return Ok(Some((space, ritz, pairs)));
                }
                if is_full {
                    space.restart(&ritz, SLICE + (CAPACITY - SLICE) * 3 / 8);
                    break;
                }
            }
        }
        Ok(None)
    }
}

/// What is sought around a shift.
struct Sought {
    /// Where the slice begins.
    start: f64,
    shift: f64,
    /// How many eigenvalues lie between these.
    left: usize,
    /// At least how many beyond the shift are wanted.
    right: usize,
    tolerance: f64,
}

impl Sought {
    fn eigenvalue(&self, ritz: &Ritz, i: usize) -> f64 {
        self.shift + ritz.values[i].recip()
    }

    /// Pairs within the slice that have converged, as all nearer to the shift have, by ascending eigenvalue, and how many lie below the
    /// shift.
    fn converged(&self, ritz: &Ritz) -> (Vec<usize>, usize) {
        let converged = ritz.converged(ritz.values.len(), self.tolerance);
        let mut pairs: Vec<usize> =
            (0..converged).filter(|&i| self.eigenvalue(ritz, i) > self.start).collect();
        pairs.sort_by(|&a, &b| self.eigenvalue(ritz, a).total_cmp(&self.eigenvalue(ritz, b)));
        let left = pairs.partition_point(|&i| ritz.values[i] < 0.0);
        (pairs, left)
    }
}

/// The mean distance of the last eigenvalues. Their number grows linearly with them (Weyl 1911).
fn spacing(eigenvalues: &[f64]) -> f64 {
    let last = eigenvalues.len() - 1;
    let first = last.saturating_sub(SLICE);
    (eigenvalues[last] - eigenvalues[first]) / (last - first).max(1) as f64
}
