//! How well a simplified mesh keeps eigenfunctions: the norms of the paper.

use ndf_core::{Hint, Progress};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{FacePoint, ManifoldMesh, TriangleTree};
use ndf_spectral::{LaplaceBeltrami, Mass, ModeOptions, Modes, OperatorOptions, SpectralError};

/// Norms of the functional map C from the modes of a mesh to those of a simplified one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralFidelity {
    /// ‖C Λ − Λ̃ C‖² / ‖C‖²: how far C is from keeping eigenvalues, in units of inverse length to the fourth.
    pub commutativity: f64,
    /// ‖CᵀC − I‖²: how far C is from keeping angles and lengths of functions.
    pub orthogonality: f64,
}

impl SpectralFidelity {
    /// The norms for so many modes of both meshes with plain cotangent Laplacians. Functions come to a vertex of the
    /// simplified mesh from the point of the input closest to it.
    ///
    /// # Errors
    /// If the modes of a mesh cannot be computed, or the observer asks to stop.
    pub fn of(
        input: &ManifoldMesh,
        simplified: &ManifoldMesh,
        modes: usize,
        progress: &dyn Progress,
    ) -> Result<Self, SpectralError> {
        let all = plain_modes(input, modes, progress)?.1;
        let (operator, own) = plain_modes(simplified, modes, progress)?;
        let tree = TriangleTree::new(input);
        let nearest = |&p| tree.closest_point(p, Hint::NONE).map(|closest| closest.at);
        let places: Vec<Option<FacePoint>> = simplified.positions().iter().map(nearest).collect();
        // C = Φ̃ᵀ M̃ P Φ, a column for each function of the input.
        let column = |k: usize| -> Vec<f64> {
            let values = all.mode(k);
            let at = |place: &Option<FacePoint>| {
                place
                    .map_or(0.0, |p| p.interpolate(input.faces()[p.face.index()].map(|v| values[v as usize])))
            };
            let masses = operator.mass().values();
            let weighted: Vec<f64> =
                places.iter().zip(masses).map(|(place, mass)| mass * at(place)).collect();
            (0..modes).map(|i| own.mode(i).iter().zip(&weighted).map(|(f, w)| f * w).sum()).collect()
        };
        let columns: Vec<Vec<f64>> = (0..modes).map(column).collect();
        let (mut change, mut size, mut skew) = (0.0, 0.0, 0.0);
        for k in 0..modes {
            for i in 0..modes {
                let entry = columns[k][i];
                change += (entry * (all.eigenvalues[k] - own.eigenvalues[i])).powi(2);
                size += entry * entry;
                let product: f64 = columns[k].iter().zip(&columns[i]).map(|(a, b)| a * b).sum();
                skew += (product - f64::from(u8::from(i == k))).powi(2);
            }
        }
        Ok(Self { commutativity: change / size, orthogonality: skew })
    }
}

/// The plain cotangent Laplacian with lumped barycentric mass, and its modes.
pub(crate) fn plain_modes(
    mesh: &ManifoldMesh,
    count: usize,
    progress: &dyn Progress,
) -> Result<(LaplaceBeltrami, Modes), SpectralError> {
    let options = OperatorOptions { mass: Mass::Barycentric, delaunay: false };
    let operator = LaplaceBeltrami::new(&IntrinsicMesh::from_mesh(mesh), options)?;
    let modes = operator.modes(&ModeOptions { count, ..ModeOptions::default() }, progress)?;
    Ok((operator, modes))
}
