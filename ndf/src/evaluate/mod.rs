//! How far computations on one mesh are from those on another: the error protocol of the paper's supplement (§2.1).
//!
//! The *truth* is a fine mesh of the surface. Computed on it once, and on every *candidate* in the same way:
//!
//! - exact geodesic distances from two sources, the points closest to (1, 1, 1) and (−1, −1, −1) of the box [-1.5, 1.5]³
//!   that the truth fills;
//! - the 20 smallest eigenvalues of the Laplace–Beltrami operator, with their modes. L + σM is factored, σ = 10⁻³ in the box.
//!
//! At every vertex of the truth the candidate's closest point is found, and values on the candidate are interpolated there.
//! Reported are the mean of |difference| of distances (L¹), its share of the mean distance, and the largest; the mean
//! relative error of the eigenvalues but the first, which is zero; and the errors of modes after [matching](ModeErrors).
//!
//! The supplement takes as source on each mesh that mesh's own closest point ([`SourceRule::Own`]). This point jumps from limb to
//! limb where two are almost equally near to the corner of the box, and such a jump then counts as an error of distances. So
//! both rules are there: the truth's source carried over by the closest point ([`SourceRule::Carried`]) is what methods are
//! judged by.
//!
//! Everything is in the units of the meshes, which must be the same; errors that are shares do not depend on them. Seconds of
//! solving and of transfer are apart, since the second is not the method's.
//!
//! ```
//! use ndf::evaluate::{Candidate, ProtocolOptions, SourceRule, Truth};
//! use ndf::{LengthFactors, ManifoldMesh, NoProgress};
//! use ndf_mesh::shapes::icosphere;
//!
//! let truth = Truth::new(ManifoldMesh::try_from(icosphere(4))?, &ProtocolOptions::default(), &NoProgress)?;
//! let coarse = ManifoldMesh::try_from(icosphere(3))?;
//! let solved = truth.solve(&Candidate::of_mesh(&coarse), &SourceRule::ALL, &NoProgress)?;
//! let errors = truth.errors(&solved, LengthFactors::ONE);
//! assert!(errors.distances_carried.unwrap().share() < 0.01 && errors.eigenvalues.mean < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod distances;
mod spectrum;
#[cfg(test)]
mod tests;

use ndf_core::{Cancelled, Progress};
use ndf_geodesic::GeodesicError;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::ManifoldMesh;
use ndf_model::{LengthFactors, Similarity};
use ndf_spectral::{ModeOptions, OperatorOptions, SpectralError};
use serde::Serialize;

pub use distances::{
    Averaging, DistanceErrors, DistanceProtocol, DistanceTruth, Feet, MeasuredDistances, SOURCES,
    SourceErrors, SourceRule,
};
pub use spectrum::{
    CLUSTER_GAP, EigenvalueErrors, MeasuredSpectrum, ModeErrors, SpectralTruth, eigenvalue_errors,
    mode_errors,
};

/// What is computed and compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProtocolOptions {
    /// Of distances.
    pub distances: DistanceProtocol,
    /// Of modes. The shift is in the box.
    pub modes: ModeOptions,
    /// Faces flatter than this share of the mean length are [mollified](IntrinsicMesh::mollify) before operators are made.
    pub mollification: f64,
}

impl Default for ProtocolOptions {
    /// The supplement's: all vertices of the truth, linear interpolation, 20 modes of the triangles as they are (neither
    /// flipped nor refined), σ = 10⁻³. Mollification by 10⁻⁶ is ours, for meshes with faces without area.
    fn default() -> Self {
        let operator = OperatorOptions { delaunay: false, ..OperatorOptions::default() };
        let modes = ModeOptions { operator, ..ModeOptions::default() };
        Self { distances: DistanceProtocol::default(), modes, mollification: 1e-6 }
    }
}

/// Why there are no errors.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluateError {
    /// A mesh has no faces with an area.
    #[error("the mesh has no closest point")]
    NoPoint,
    /// Distances failed.
    #[error(transparent)]
    Geodesic(#[from] GeodesicError),
    /// Modes failed.
    #[error(transparent)]
    Spectral(#[from] SpectralError),
    /// The observer asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A mesh that others are compared with, and what was computed on it.
#[derive(Clone, Debug)]
pub struct Truth {
    mesh: ManifoldMesh,
    distances: DistanceTruth,
    spectrum: SpectralTruth,
}

/// A mesh that is compared.
#[derive(Clone, Copy, Debug)]
pub struct Candidate<'a> {
    /// The mesh, in the units of the truth.
    pub mesh: &'a ManifoldMesh,
    /// Another triangulation of the same surface for operators, such as one refined to be Delaunay: its first vertices are those of
    /// the mesh. Exact distances do not depend on the triangulation.
    pub operators_on: Option<&'a IntrinsicMesh>,
}

impl<'a> Candidate<'a> {
    /// A mesh with operators on its own triangles.
    pub fn of_mesh(mesh: &'a ManifoldMesh) -> Self {
        Self { mesh, operators_on: None }
    }
}

/// What was computed on a candidate, with lengths as they are.
#[derive(Clone, Debug)]
pub struct Solved {
    /// Distances, by each rule that was asked for.
    pub distances: Vec<MeasuredDistances>,
    /// Eigenvalues and modes.
    pub spectrum: MeasuredSpectrum,
    /// How long it took.
    pub seconds: SolveSeconds,
}

/// Wall seconds of the stages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SolveSeconds {
    /// Distances from both sources, side by side, by the first rule that was asked for.
    pub distances: f64,
    /// Assembly, factorisation, and modes.
    pub spectrum: f64,
    /// Closest points of the truth's vertices, and values there.
    pub transfer: f64,
}

/// Errors of a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Errors {
    /// Of distances from the truth's sources, if asked for.
    pub distances_carried: Option<DistanceErrors>,
    /// Of distances from the sources that the candidate itself is closest with, if asked for.
    pub distances_own: Option<DistanceErrors>,
    /// Of eigenvalues.
    pub eigenvalues: EigenvalueErrors,
    /// Of modes.
    pub modes: ModeErrors,
}

impl Truth {
    /// Computes on a mesh what others are compared with: distances from two sources and modes. Some 10 s for a million faces.
    ///
    /// # Errors
    /// If either fails, or the observer asks to stop.
    pub fn new(
        mesh: ManifoldMesh,
        options: &ProtocolOptions,
        progress: &dyn Progress,
    ) -> Result<Self, EvaluateError> {
        let similarity = Similarity::from_bounds(&mesh.bounds());
        let distances = DistanceTruth::new(&mesh, &similarity, &options.distances, progress)?;
        let spectrum = SpectralTruth::new(&mesh, &similarity, options, progress)?;
        Ok(Self { mesh, distances, spectrum })
    }

    /// The mesh.
    pub fn mesh(&self) -> &ManifoldMesh {
        &self.mesh
    }

    /// The distances on it.
    pub fn distances(&self) -> &DistanceTruth {
        &self.distances
    }

    /// The modes of it.
    pub fn spectrum(&self) -> &SpectralTruth {
        &self.spectrum
    }

    /// Computes the same on another mesh. Distances are computed once for both rules where the sources are the same.
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub fn solve(
        &self,
        candidate: &Candidate<'_>,
        rules: &[SourceRule],
        progress: &dyn Progress,
    ) -> Result<Solved, EvaluateError> {
        let mut feet = self.distances.feet(candidate.mesh)?;
        let distances = self.distances.measured(&mut feet, rules, progress)?;
        let spectrum = self.spectrum.measured(candidate, &mut feet, progress)?;
        let seconds = SolveSeconds {
            distances: distances.first().map_or(0.0, |first| first.seconds),
            spectrum: spectrum.seconds,
            transfer: feet.seconds,
        };
        Ok(Solved { distances, spectrum, seconds })
    }

    /// Errors of what was computed, with lengths multiplied by these factors: those of a model's metric, or
    /// [`LengthFactors::ONE`]. O(n).
    pub fn errors(&self, solved: &Solved, factors: LengthFactors) -> Errors {
        let by = |rule: SourceRule| {
            let found = solved.distances.iter().find(|found| found.rule == rule)?;
            Some(self.distances.errors(found, factors.distances))
        };
        let eigenvalues = &self.spectrum.modes().eigenvalues;
        Errors {
            distances_carried: by(SourceRule::Carried),
            distances_own: by(SourceRule::Own),
            eigenvalues: eigenvalue_errors(eigenvalues, &solved.spectrum.eigenvalues, factors.operators),
            modes: self.spectrum.mode_errors(&solved.spectrum),
        }
    }
}
