//! Eigenmodes of the Laplace–Beltrami operator: the smallest solutions of L φ = λ M φ.

use ndf_core::progress::Progress;
use ndf_intrinsic::IntrinsicMesh;

use crate::error::SpectralError;
use crate::laplace_beltrami::{LaplaceBeltrami, OperatorOptions};
use crate::solver::Solver;
use crate::vertex_functions::VertexFunctions;

/// How `L + σM` is inverted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Inversion {
    /// By a Cholesky factorisation: fast; some 70 numbers a vertex for a million vertices, and more for more.
    #[default]
    Factorisation,
    /// By conjugate gradients with algebraic multigrid: some ten times slower, in memory proportional to the mesh, two thirds of
    /// the other's at 800,000 vertices. All modes are found in one space, and the inertia, which a factorisation tells, is not checked.
    Multigrid,
}

/// What modes to compute, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeOptions {
    /// How many modes, from the smallest eigenvalue on.
    pub count: usize,
    /// The shift σ > 0, in inverse squared units of length: L + σM is factored. Eigenvalues do not depend on it. It is
    /// kept between 1e-6 and 1 times 4π/area, about the first eigenvalue that is not zero, beyond which it would cost
    /// digits or iterations on meshes in very small or large units.
    pub shift: f64,
    /// How L + σM is inverted.
    pub inversion: Inversion,
    /// How the operator is built from a mesh.
    pub operator: OperatorOptions,
    /// Residuals at which modes count as converged, relative to the eigenvalue. Errors of eigenvalues are about the
    /// square of this.
    pub tolerance: f64,
    /// Whether to check by Sylvester's law of inertia that no eigenvalue is missing; costs one more factorisation. Not done without
    /// factorisations.
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
            inversion: Inversion::default(),
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
    /// Eigenvalues λ, ascending, in inverse squared units of length; as many zeros as there are components without held vertices.
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
    /// The smallest modes, by shift-invert block Lanczos; many of them slice by slice of the spectrum (Grimes, Lewis and Simon
    /// 1994). `options.operator` plays no part here.
    ///
    /// Cost: a factorisation, about O(n^1.5); then for 20 modes about 90 solves, four at a time, and up to 80 functions
    /// beside the factor. Beyond 128 modes there are two factorisations and about 200 solves for every 80, and 200 functions beside the
    /// factor and the modes: time is linear in their number.
    ///
    /// # Errors
    /// If an option is out of range, the modes do not converge, or the observer asks to stop.
    pub fn modes(&self, options: &ModeOptions, progress: &dyn Progress) -> Result<Modes, SpectralError> {
        options.check(self.vertex_count())?;
        Solver { operator: self, factored: None, options, progress }.run()
    }

    /// The smallest modes among functions that are zero at held vertices (Dirichlet); boundaries that are not held are insulated
    /// (Neumann). Functions are given at all vertices. Cost as [`modes`](Self::modes).
    ///
    /// # Errors
    /// If all vertices are held, and otherwise as [`modes`](Self::modes).
    ///
    /// # Panics
    /// If there is not one mark for every vertex.
    pub fn modes_holding(
        &self,
        held: &[bool],
        options: &ModeOptions,
        progress: &dyn Progress,
    ) -> Result<Modes, SpectralError> {
        assert_eq!(held.len(), self.vertex_count());
        if !held.contains(&true) {
            return self.modes(options, progress);
        }
        if !held.contains(&false) {
            return Err(SpectralError::AllHeld);
        }
        let modes = self.holding(held).modes(options, progress)?;
        let mut functions = VertexFunctions::with_capacity(held.len(), modes.len());
        for function in modes.functions.iter() {
            let free = functions.push().iter_mut().zip(held).filter(|(_, held)| !**held);
            free.zip(function).for_each(|((x, _), value)| *x = *value);
        }
        Ok(Modes { functions, ..modes })
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
}
