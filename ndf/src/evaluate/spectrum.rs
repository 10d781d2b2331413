//! Eigenvalues and modes of a mesh, compared with those of another.

use std::ops::Range;
use std::time::Instant;

use nalgebra::DMatrix;
use ndf_core::Progress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::ManifoldMesh;
use ndf_model::Similarity;
use ndf_spectral::{LaplaceBeltrami, ModeOptions, Modes};
use rayon::prelude::*;
use serde::Serialize;

use super::distances::{Feet, interpolated};
use super::{Candidate, EvaluateError, ProtocolOptions};

/// Eigenvalues that differ by less than this share are of one cluster: their modes mix under small changes of the surface.
pub const CLUSTER_GAP: f64 = 0.02;

/// Modes of the truth.
#[derive(Clone, Debug)]
pub struct SpectralTruth {
    options: ModeOptions,
    mollification: f64,
    modes: Modes,
    /// The area around each vertex.
    areas: Vec<f64>,
}

/// Modes of a candidate, with lengths as they are.
#[derive(Clone, Debug)]
pub struct MeasuredSpectrum {
    /// Its eigenvalues, ascending.
    pub eigenvalues: Vec<f64>,
    /// Its modes at the vertices of the truth that are compared, and which these are.
    functions: Vec<Vec<f64>>,
    targets: Vec<u32>,
    /// Wall seconds of assembly, factorisation and modes; transfer is counted by [`Feet`].
    pub seconds: f64,
}

/// Relative errors of eigenvalues, without the first, which is zero.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EigenvalueErrors {
    /// The mean.
    pub mean: f64,
    /// The largest.
    pub max: f64,
}

/// Errors of modes: for each cluster of eigenvalues of the truth, its modes U less the candidate's modes V of the same numbers,
/// turned within their span by the orthogonal matrix that brings them nearest (for a single mode: a sign), in the root of the
/// mean square over the truth, each mode with the norm 1. So 0 is right and √2 is unrelated. The last cluster is left out,
/// since it may be cut off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ModeErrors {
    /// The mean over all modes.
    pub mean: f64,
    /// The largest of all clusters.
    pub max: f64,
}

/// The relative errors of eigenvalues, with all lengths multiplied by a factor: eigenvalues fall by its square.
pub fn eigenvalue_errors(truth: &[f64], found: &[f64], factor: f64) -> EigenvalueErrors {
    let relative = |(truth, found): (&f64, &f64)| (found / factor.powi(2) - truth).abs() / truth;
    let errors = || truth.iter().zip(found).skip(1).map(relative);
    EigenvalueErrors {
        mean: errors().sum::<f64>() / (truth.len() - 1) as f64,
        max: errors().fold(0.0, f64::max),
    }
}

impl SpectralTruth {
    /// Modes of a mesh.
    ///
    /// # Errors
    /// If they fail, or the observer asks to stop.
    pub fn new(
        mesh: &ManifoldMesh,
        similarity: &Similarity,
        protocol: &ProtocolOptions,
        progress: &dyn Progress,
    ) -> Result<Self, EvaluateError> {
        let shift = protocol.modes.shift * similarity.length_to_normalised(1.0).powi(2);
        let options = ModeOptions { shift, ..protocol.modes };
        let operator = operator(&IntrinsicMesh::from_mesh(mesh), &options, protocol.mollification)?;
        let modes = operator.modes(&options, progress)?;
        let areas = (0..mesh.vertex_count()).map(|v| operator.mass().get(v, v).unwrap_or(0.0)).collect();
        Ok(Self { options, mollification: protocol.mollification, modes, areas })
    }

    /// Its modes.
    pub fn modes(&self) -> &Modes {
        &self.modes
    }

    /// Modes of a candidate.
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub fn measured(
        &self,
        candidate: &Candidate<'_>,
        feet: &mut Feet<'_>,
        progress: &dyn Progress,
    ) -> Result<MeasuredSpectrum, EvaluateError> {
        let start = Instant::now();
        let made;
        let intrinsic = match candidate.operators_on {
            Some(intrinsic) => intrinsic,
            None => {
                made = IntrinsicMesh::from_mesh(candidate.mesh);
                &made
            }
        };
        let modes = operator(intrinsic, &self.options, self.mollification)?.modes(&self.options, progress)?;
        let seconds = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let at_feet = |function: &[f64]| -> Vec<f64> {
            feet.points.par_iter().map(|&point| interpolated(feet.mesh, point, function)).collect()
        };
        let functions = modes.functions.iter().map(at_feet).collect();
        feet.seconds += start.elapsed().as_secs_f64();
        Ok(MeasuredSpectrum {
            eigenvalues: modes.eigenvalues,
            functions,
            targets: feet.targets.clone(),
            seconds,
        })
    }

    /// Errors of the modes of a candidate. O(nk²) for k modes.
    pub fn mode_errors(&self, found: &MeasuredSpectrum) -> ModeErrors {
        let at_targets = |values: &[f64]| found.targets.iter().map(|&v| values[v as usize]).collect();
        let truth: Vec<Vec<f64>> = self.modes.functions.iter().map(at_targets).collect();
        mode_errors(&self.modes.eigenvalues, &truth, &found.functions, &at_targets(&self.areas))
    }
}

/// Errors of modes that are given at the same points, with the area around each.
pub fn mode_errors(eigenvalues: &[f64], truth: &[Vec<f64>], found: &[Vec<f64>], areas: &[f64]) -> ModeErrors {
    let matrix = |functions: &[Vec<f64>]| {
        let scaled = |function: &Vec<f64>| {
            let column: Vec<f64> =
                function.iter().zip(areas).map(|(value, area)| value * area.sqrt()).collect();
            let norm = column.iter().map(|x| x * x).sum::<f64>().sqrt();
            column.into_iter().map(move |x| x / norm)
        };
        DMatrix::from_iterator(areas.len(), functions.len(), functions.iter().flat_map(scaled))
    };
    let (mut sum, mut count, mut max) = (0.0, 0, 0.0_f64);
    for cluster in clusters(eigenvalues) {
        let (u, v) = (matrix(&truth[cluster.clone()]), matrix(&found[cluster.clone()]));
        let svd = (v.transpose() * &u).svd(true, true);
        let (Some(left), Some(right)) = (svd.u, svd.v_t) else { continue };
        let error = (u - v * (left * right)).norm() / (cluster.len() as f64).sqrt();
        sum += cluster.len() as f64 * error;
        count += cluster.len();
        max = max.max(error);
    }
    ModeErrors { mean: sum / f64::max(count as f64, 1.0), max }
}

/// The clusters of eigenvalues, without the first eigenvalue, which is zero, and the last cluster.
fn clusters(eigenvalues: &[f64]) -> Vec<Range<usize>> {
    let mut clusters = Vec::new();
    let mut start = 1;
    for k in 1..eigenvalues.len().saturating_sub(1) {
        if eigenvalues[k + 1] - eigenvalues[k] > CLUSTER_GAP * eigenvalues[k + 1] {
            clusters.push(start..k + 1);
            start = k + 1;
        }
    }
    clusters
}

fn operator(
    mesh: &IntrinsicMesh,
    options: &ModeOptions,
    mollification: f64,
) -> Result<LaplaceBeltrami, EvaluateError> {
    let mut mesh = mesh.clone();
    mesh.mollify(mollification);
    Ok(LaplaceBeltrami::new(&mesh, options.operator)?)
}
