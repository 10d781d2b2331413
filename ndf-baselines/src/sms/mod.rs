//! Spectral mesh simplification (Lescoat, Liu, Thiery, Jacobson, Boubekeur and Ovsjanikov 2020): edges are collapsed so
//! that the smallest eigenvalues and eigenfunctions of the Laplacian stay what they are.
//!
//! The cost of a collapse is the change of the energy of the vertices around it. The merged vertex goes to one of both ends,
//! the middle, or where the parabola through the costs of those three is lowest. Collapses wait in a heap.
//!
//! What is ours: the link condition keeps the topology, as in our decimation, and no face may turn over; vertices of the
//! boundary stay on it. All costs that a collapse changes are computed anew at once.
//!
//! The energy is what the paper's norms measure ([`SpectralFidelity`]): functions of many modes, each at its vertices. It
//! weighs eigenvalues by their squares, and vertices on edges between others shrink a surface, so that the first few
//! eigenvalues of a coarse result can be further off than after decimation by quadrics.

mod energy;
mod fidelity;
#[cfg(test)]
mod tests;

use ndf_core::{Cancelled, Progress};
use ndf_mesh::{Halfedge, ManifoldMesh};
use ndf_meshing::EditableMesh;
use ndf_spectral::{SpectralError, VertexFunctions};

use crate::greedy::{Collapses, Greedy};
use energy::Energy;
pub use fidelity::SpectralFidelity;
use fidelity::plain_modes;

/// How far to simplify, and what to keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmsOptions {
    /// Number of faces to reach.
    pub faces: usize,
    /// Number of eigenfunctions to keep, the smallest eigenvalues first.
    pub modes: usize,
}

impl SmsOptions {
    /// So many faces, and 20 modes as in the supplement of the paper on neural displacement fields.
    pub fn to_faces(faces: usize) -> Self {
        Self { faces, modes: 20 }
    }
}

/// A simplified mesh.
#[derive(Clone, Debug)]
pub struct SpectrallySimplified {
    /// The mesh: the same topology with fewer faces.
    pub mesh: ManifoldMesh,
    /// Whether it has no more faces than asked for; otherwise no further edge could be collapsed.
    pub reached: bool,
    /// Number of edges collapsed.
    pub collapses: usize,
    /// The energy at the end: a sum over vertices of squared errors of Laplacians, weighted by area.
    pub energy: f64,
}

/// Why a mesh was not simplified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SmsError {
    /// The mesh has no modes.
    #[error(transparent)]
    Spectral(#[from] SpectralError),
    /// The observer asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Simplifies a mesh. Deterministic, over all threads; about half a millisecond a collapse with 20 modes.
///
/// # Errors
/// If the modes cannot be computed, or the observer asks to stop.
pub fn spectral_simplification(
    mesh: &ManifoldMesh,
    options: &SmsOptions,
    progress: &dyn Progress,
) -> Result<SpectrallySimplified, SmsError> {
    Ok(SpectralSimplification::new(mesh, options.modes, progress)?.to_faces(options.faces, progress)?)
}

/// A mesh that is simplified step by step: what it is at fewer faces follows from what it was at more, so that meshes of many
/// sizes take no longer than the coarsest alone.
pub struct SpectralSimplification(Greedy<Energy>);

impl SpectralSimplification {
    /// The mesh as it is, with so many modes to keep.
    ///
    /// # Errors
    /// If the modes cannot be computed, or the observer asks to stop.
    pub fn new(mesh: &ManifoldMesh, modes: usize, progress: &dyn Progress) -> Result<Self, SmsError> {
        let kept = plain_modes(mesh, modes, progress)?.1;
        // M⁻¹ L φ = λ φ.
        let functions = by_vertex(&kept.functions, |_| 1.0);
        let images = by_vertex(&kept.functions, |k| kept.eigenvalues[k]);
        Ok(Self(Greedy::new(Energy::new(EditableMesh::new(mesh), modes, functions, images))))
    }

    /// The mesh at so many faces, or as it is if it has fewer: equal to what [`spectral_simplification`] makes at once.
    ///
    /// # Errors
    /// If the observer asks to stop.
    pub fn to_faces(
        &mut self,
        faces: usize,
        progress: &dyn Progress,
    ) -> Result<SpectrallySimplified, Cancelled> {
        let Self(greedy) = self;
        greedy.run(faces, "spectral simplification", progress)?;
        Ok(SpectrallySimplified {
            reached: greedy.state.mesh.face_count() <= faces,
            collapses: greedy.collapses,
            energy: greedy.state.total(),
            mesh: greedy.state.mesh.clone().into_manifold(),
        })
    }
}

/// Functions as a row of values for each vertex, each function times a factor.
fn by_vertex(functions: &VertexFunctions, factor: impl Fn(usize) -> f64) -> Vec<f64> {
    let row = |v: usize| functions.at_vertex(v).enumerate().map(|(k, value)| factor(k) * value);
    (0..functions.vertex_count()).flat_map(row).collect()
}

impl Collapses for Energy {
    /// The share of the way from the tail to the tip.
    type Place = f64;

    fn mesh(&self) -> &EditableMesh {
        &self.mesh
    }

    fn cheapest(&self, h: Halfedge) -> Option<(f64, f64)> {
        best_place(self, h)
    }

    fn collapse(&mut self, h: Halfedge, share: f64) -> Option<Vec<Halfedge>> {
        let ring = self.collapse_at(h, share)?;
        // Terms have changed around the ring, hence costs of edges with an end beside it.
        let beside = ring.iter().flat_map(|&v| self.mesh.ring(v));
        Some(beside.flat_map(|w| self.mesh.edges_at(w)).collect())
    }
}

/// The cheapest place at which an edge may be collapsed, with its cost; none if there is none.
fn best_place(energy: &Energy, h: Halfedge) -> Option<(f64, f64)> {
    let mesh = &energy.mesh;
    let around = energy.surroundings(h);
    let cost = |share: f64| (energy.cost(&around, share), share);
    let mut tried = match [mesh.tail(h), mesh.tip(h)].map(|v| mesh.is_boundary_vertex(v)) {
        [true, false] => vec![cost(0.0)],
        [false, true] => vec![cost(1.0)],
        _ => [0.0, 0.5, 1.0].map(cost).to_vec(),
    };
    if let [(start, _), (middle, _), (end, _)] = tried[..] {
        let bend = 2.0 * (start - 2.0 * middle + end);
        let lowest = (3.0 * start - 4.0 * middle + end) / (2.0 * bend);
        if bend > 0.0 && lowest > 0.0 && lowest < 1.0 {
            tried.push(cost(lowest));
        }
    }
    let best = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    best.0.is_finite().then_some(best)
}
