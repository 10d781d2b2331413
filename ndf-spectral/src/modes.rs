//! Eigenmodes of the Laplace–Beltrami operator: the smallest solutions of L φ = λ M φ.

use ndf_core::progress::Progress;
use ndf_intrinsic::IntrinsicMesh;

use crate::dense;
use crate::error::SpectralError;
use crate::factorisation::Cholesky;
use crate::krylov::{KrylovSpace, Ritz};
use crate::laplace_beltrami::{LaplaceBeltrami, OperatorOptions};
use crate::panel::{Panel, Row, WIDTH, multiply};
use crate::screened_poisson::ScreenedPoisson;
use crate::vertex_functions::VertexFunctions;

/// What modes to compute, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeOptions {
    /// How many modes, from the smallest eigenvalue on.
    pub count: usize,
    /// The shift σ > 0, in inverse squared units of length: L + σM is factored. Eigenvalues do not depend on it. It is
    /// kept between 1e-6 and 1 times 4π/area, about the first eigenvalue that is not zero, beyond which it would cost
    /// digits or iterations on meshes in very small or large units.
    pub shift: f64,
    /// How the operator is built from a mesh.
    pub operator: OperatorOptions,
    /// Residuals at which modes count as converged, relative to the eigenvalue. Errors of eigenvalues are about the
    /// square of this.
    pub tolerance: f64,
    /// Whether to check by Sylvester's law of inertia that no eigenvalue is missing; costs one more factorisation.
    pub verify: bool,
    /// Restarts before giving up.
    pub max_restarts: usize,
}

impl Default for ModeOptions {
    /// 20 modes, shift 1e-3, intrinsic Delaunay with barycentric mass, tolerance 3e-9, verified.
    fn default() -> Self {
        Self {
            count: 20,
            shift: 1e-3,
            operator: OperatorOptions::default(),
            tolerance: 3e-9,
            verify: true,
            max_restarts: 100,
        }
    }
}

/// Eigenvalues and eigenfunctions.
///
/// Of each function, the entry of largest magnitude is positive (of those within 1e-6 of it, the first).
#[derive(Clone, Debug, PartialEq)]
pub struct Modes {
    /// Eigenvalues λ, ascending, in inverse squared units of length; as many zeros as there are components.
    pub eigenvalues: Vec<f64>,
    /// Eigenfunctions, orthonormal in the mass matrix.
    pub functions: VertexFunctions,
    /// `|Lφ − λMφ| / (λ |Mφ|)` of every mode, where a zero λ is replaced by 4π/area.
    pub residuals: Vec<f64>,
    /// Whether the inertia confirmed that no smaller eigenvalue is missing.
    pub verified: bool,
}

impl Modes {
    /// How many modes.
    pub fn len(&self) -> usize {
        self.eigenvalues.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.eigenvalues.is_empty()
    }

    /// The eigenfunction of `eigenvalues[i]`: its values at the vertices.
    ///
    /// # Panics
    /// If there is no such mode.
    pub fn mode(&self, i: usize) -> &[f64] {
        &self.functions[i]
    }

    /// The largest residual.
    pub fn max_residual(&self) -> f64 {
        self.residuals.iter().copied().fold(0.0, f64::max)
    }
}

/// Modes of an intrinsic mesh: [`LaplaceBeltrami::new`] and [`LaplaceBeltrami::modes`].
///
/// # Errors
/// If a vertex has no area, an option is out of range, the modes do not converge, or the observer asks to stop.
pub fn modes(
    mesh: &IntrinsicMesh,
    options: &ModeOptions,
    progress: &dyn Progress,
) -> Result<Modes, SpectralError> {
    LaplaceBeltrami::new(mesh, options.operator)?.modes(options, progress)
}

impl LaplaceBeltrami {
    /// The smallest modes, by shift-invert block Lanczos. `options.operator` plays no part here.
    ///
    /// Cost: a factorisation, about O(n^1.5); then for 20 modes about 90 solves, four at a time. Up to 80 functions
    /// are held beside the factor.
    ///
    /// # Errors
    /// If an option is out of range, the modes do not converge, or the observer asks to stop.
    pub fn modes(&self, options: &ModeOptions, progress: &dyn Progress) -> Result<Modes, SpectralError> {
        options.check(self.vertex_count())?;
        Solver { operator: self, factored: None, options, progress }.run()
    }

    /// 4π/area: about the first eigenvalue that is not zero, by Weyl's law.
    pub fn typical_eigenvalue(&self) -> f64 {
        4.0 * std::f64::consts::PI / self.area()
    }
}

impl ModeOptions {
    /// The shift that is used for an operator: [`shift`](Self::shift) within its bounds.
    pub fn shift_for(&self, operator: &LaplaceBeltrami) -> f64 {
        let typical = operator.typical_eigenvalue();
        self.shift.clamp(1e-6 * typical, typical)
    }

    pub(crate) fn check(&self, vertices: usize) -> Result<(), SpectralError> {
        if self.count > vertices {
            return Err(SpectralError::TooManyModes { asked: self.count, vertices });
        }
        if !(self.shift > 0.0 && self.shift.is_finite()) {
            return Err(SpectralError::Shift(self.shift));
        }
        if self.tolerance.is_nan() || self.tolerance <= 0.0 {
            return Err(SpectralError::NotPositive { name: "the tolerance", value: self.tolerance });
        }
        Ok(())
    }

    /// Dimension of the space at which it is restarted.
    fn capacity(&self, wanted: usize) -> usize {
        (wanted + wanted.max(48)).next_multiple_of(WIDTH)
    }
}

/// Below so many vertices all modes are found at once by dense matrices.
const DENSE: usize = 300;

/// A computation of modes.
pub(crate) struct Solver<'a> {
    pub(crate) operator: &'a LaplaceBeltrami,
    /// The factorisation to use, if there is one already.
    pub(crate) factored: Option<&'a ScreenedPoisson<'a>>,
    pub(crate) options: &'a ModeOptions,
    pub(crate) progress: &'a dyn Progress,
}

impl Solver<'_> {
    pub(crate) fn run(&self) -> Result<Modes, SpectralError> {
        // From inside the pool, or every product of panels would wake it anew.
        rayon::scope(|_| self.run_in_pool())
    }

    fn run_in_pool(&self) -> Result<Modes, SpectralError> {
        let kernel = self.options.count.min(self.operator.components().count());
        let wanted = self.options.count - kernel;
        let vertices = self.operator.vertex_count();
        if wanted == 0 {
            return Ok(self.assemble(kernel, &[], |_, _| (), true));
        }
        let capacity = self.options.capacity(wanted);
        if vertices - self.operator.components().count() < DENSE.max(2 * capacity) {
            let (values, functions) = dense::modes(self.operator, self.options.count)?;
            let write = |k: usize, target: &mut [f64]| {
                let function = functions.col(kernel + k);
                target.iter_mut().zip(function.iter()).for_each(|(x, value)| *x = *value);
            };
            return Ok(self.assemble(kernel, &values[kernel..], write, true));
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
        let (inverse, shift) = (factored.cholesky(), factored.shift());
        self.progress.check()?;
        let mut space = KrylovSpace::new(self.operator, inverse)?;
        let eigenvalue = |theta: f64| theta.recip() - shift;
        let finish = |space: KrylovSpace<'_>, ritz: &Ritz, found: usize, verified: bool| {
            let values: Vec<f64> = ritz.values[..found].iter().copied().map(eigenvalue).collect();
            let functions = if found > 0 { space.into_functions(ritz, found) } else { Vec::new() };
            let write = |k: usize, target: &mut [f64]| {
                let panel = &functions[k / WIDTH];
                target.iter_mut().zip(panel).for_each(|(x, row)| *x = row.0[k % WIDTH]);
            };
            self.assemble(kernel, &values, write, verified)
        };
        let mut applications = 0;
        for round in 0..=self.options.max_restarts {
            let ritz = self.converge(&mut space, wanted, capacity, &mut applications)?;
            let converged = ritz.converged(wanted, self.options.tolerance);
            if converged < wanted {
                if round == self.options.max_restarts {
                    let found = Box::new(finish(space, &ritz, converged, false));
                    return Err(SpectralError::NotConverged {
                        found,
                        asked: self.options.count,
                        applications,
                    });
                }
                space.restart(&ritz, wanted + (capacity - wanted) * 3 / 8);
                continue;
            }
            let missing = match self.options.verify {
                true => self.missing(inverse, kernel, wanted, &ritz, &eigenvalue)?,
                false => None,
            };
            if missing.is_none_or(|missing| missing == 0) || round == self.options.max_restarts {
                return Ok(finish(space, &ritz, wanted, missing == Some(0)));
            }
            space.restart(&ritz, wanted);
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
        applications: &mut usize,
    ) -> Result<Ritz, SpectralError> {
        loop {
            space.expand()?;
            *applications += WIDTH;
            self.progress.check()?;
            if space.size() >= wanted + WIDTH || space.size() >= capacity {
                let ritz = space.ritz();
                let converged = ritz.converged(wanted, self.options.tolerance);
                self.progress.report("modes", converged as f64 / wanted as f64);
                if converged == wanted || space.size() >= capacity {
                    return Ok(ritz);
                }
            }
        }
    }

    /// How many eigenvalues below the largest found the pairs lack; `None` where that cannot be told.
    fn missing(
        &self,
        inverse: &Cholesky,
        kernel: usize,
        wanted: usize,
        ritz: &Ritz,
        eigenvalue: &dyn Fn(f64) -> f64,
    ) -> Result<Option<usize>, SpectralError> {
        self.progress.report("verifying", 0.0);
        // Count below a gap: inside a cluster, that may be cut by the number of modes, counts mean nothing.
        let value = |i: usize| ritz.values.get(i).map_or(f64::INFINITY, |&theta| eigenvalue(theta));
        let wide = |i: &usize| value(*i) - value(i - 1) > 1e-5 * value(i - 1);
        let Some(below) = (1..=wanted).rev().find(wide) else { return Ok(None) };
        let bound = value(below - 1) + 0.5 * (value(below) - value(below - 1)).min(1e-3 * value(below - 1));
        let shifted = self.operator.laplacian().plus(-bound, self.operator.mass());
        let negative = inverse.symbolic().negative_eigenvalues(&shifted)?;
        Ok(negative.and_then(|negative| negative.checked_sub(kernel + below)))
    }

    /// Modes of the kernel and of the pairs found, which `write` puts into columns, with signs and residuals.
    fn assemble(
        &self,
        kernel: usize,
        values: &[f64],
        write: impl Fn(usize, &mut [f64]),
        verified: bool,
    ) -> Modes {
        let components = self.operator.components();
        let count = kernel + values.len();
        let mut functions = VertexFunctions::zeros(self.operator.vertex_count(), count);
        for k in 0..kernel {
            for (x, &component) in functions.function_mut(k).iter_mut().zip(components.labels()) {
                if component as usize == k {
                    *x = components.height(k);
                }
            }
        }
        for k in 0..values.len() {
            let function = functions.function_mut(kernel + k);
            write(k, function);
            let sign = sign(function);
            function.iter_mut().for_each(|x| *x *= sign);
        }
        let eigenvalues = std::iter::repeat_n(0.0, kernel).chain(values.iter().copied()).collect::<Vec<_>>();
        let residuals = self.residuals(&eigenvalues, &functions);
        Modes { eigenvalues, functions, residuals, verified }
    }

    /// Relative residuals: see [`Modes::residuals`].
    fn residuals(&self, eigenvalues: &[f64], functions: &VertexFunctions) -> Vec<f64> {
        let typical = self.operator.typical_eigenvalue();
        let mut residuals = vec![0.0; eigenvalues.len()];
        let mut panel = vec![Row::default(); self.operator.vertex_count()];
        let (mut stiffened, mut massed) = (Panel::new(), Panel::new());
        for first in (0..eigenvalues.len()).step_by(WIDTH) {
            let columns = WIDTH.min(eigenvalues.len() - first);
            for c in 0..columns {
                panel.iter_mut().zip(&functions[first + c]).for_each(|(row, x)| row.0[c] = *x);
            }
            multiply(self.operator.laplacian(), &panel, &mut stiffened);
            multiply(self.operator.mass(), &panel, &mut massed);
            for c in 0..columns {
                let lambda = eigenvalues[first + c];
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
