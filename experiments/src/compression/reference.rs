//! How far a mesh is from the one it stands for: distances, geodesics, eigenvalues.
//!
//! Geodesics are those of the error protocol, [`ndf::evaluate`], with the truth's sources carried over. Eigenvalues are of the
//! surface and not of its triangles, since models and coarse meshes of few bytes are compared here and not triangulations: hence
//! the extrapolation, which the protocol does not have.

use std::borrow::Cow;

use ndf::evaluate::{
    Averaging, DistanceErrors, DistanceProtocol, DistanceTruth, SourceRule, eigenvalue_errors,
};
use ndf_core::NoProgress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::metrics::{MeasureOptions, measure};
use ndf_mesh::subdivision::{Refinement, Side};
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_model::{LengthFactors, Similarity};
use ndf_spectral::{ModeOptions, modes};

/// Up to 4,000 vertices to which distances are compared, inside of faces of meshes of up to 100,000.
const DISTANCES: DistanceProtocol =
    DistanceProtocol { max_targets: 4_000, max_exact_faces: 100_000, averaging: Averaging::Vertices };
/// Meshes of fewer faces have their eigenvalues extrapolated.
const FINE: usize = 200_000;
/// Where coarse meshes are parted to at least so many faces for that.
const PARTED: usize = 30_000;
/// On a grid some faces lose their area: this share of the mean length is then added to all edges. That of `ndf-spectral` is
/// too small for some meshes.
const MOLLIFICATION: f64 = 1e-6;

/// How far a mesh is from the reference. Of a pair of errors, the second is that with lengths corrected.
pub(super) struct Errors {
    /// Of the diagonal: the larger of the means of both ways.
    pub(super) mean: f64,
    /// Of the diagonal: the largest distance of both ways.
    pub(super) max: f64,
    /// The mean angle between normals, in degrees.
    pub(super) normal_degrees: f64,
    /// The area, of that of the reference.
    pub(super) area: f64,
    /// Share of the area that faces the other way.
    pub(super) flipped: f64,
    /// Of geodesic distances: the mean error, of the mean distance (L¹).
    pub(super) geodesic: [f64; 2],
    /// Mean relative error of the 20 smallest eigenvalues, the zero aside.
    pub(super) eigenvalues: [f64; 2],
}

/// A mesh with what others are compared to.
pub(super) struct Reference {
    pub(super) mesh: ManifoldMesh,
    distances: DistanceTruth,
    eigenvalues: Vec<f64>,
}

impl Reference {
    pub(super) fn new(mesh: ManifoldMesh) -> Result<Self, String> {
        let similarity = Similarity::from_bounds(&mesh.bounds());
        let distances = DistanceTruth::new(&mesh, &similarity, &DISTANCES, &NoProgress);
        let eigenvalues = eigenvalues(&mesh, FINE)?;
        Ok(Self { distances: distances.map_err(|e| e.to_string())?, eigenvalues, mesh })
    }

    /// By what lengths on another mesh are multiplied so that its area is that of the reference.
    pub(super) fn factors(&self, mesh: &TriangleMesh) -> LengthFactors {
        let factor = (self.mesh.area() / mesh.area()).sqrt();
        LengthFactors { operators: factor, distances: factor }
    }

    /// How far another mesh is, as it is and with its lengths multiplied by `factors`.
    pub(super) fn errors(&self, mesh: &ManifoldMesh, factors: LengthFactors) -> Result<Errors, String> {
        let there = measure(&self.mesh, mesh, &MeasureOptions::default()).map_err(|e| e.to_string())?;
        let (eigenvalues, geodesic) =
            rayon::join(|| eigenvalues(mesh, PARTED), || self.geodesic_error(mesh, factors.distances));
        let eigenvalues = eigenvalues?;
        let error = |factor| eigenvalue_errors(&self.eigenvalues, &eigenvalues, factor).mean;
        Ok(Errors {
            mean: there.mesh_to_reference.mean.max(there.reference_to_mesh.mean) / there.diagonal,
            max: there.hausdorff / there.diagonal,
            normal_degrees: there.normal_angle_mean.to_degrees(),
            area: mesh.area() / self.mesh.area(),
            flipped: there.flipped_fraction,
            geodesic: geodesic?,
            eigenvalues: [1.0, factors.operators].map(error),
        })
    }

    /// The error of distances as they are, and of those multiplied by a factor: of both sources together, as a share of all
    /// distances.
    fn geodesic_error(&self, mesh: &ManifoldMesh, factor: f64) -> Result<[f64; 2], String> {
        let mut feet = self.distances.feet(mesh).map_err(|e| e.to_string())?;
        let found = self.distances.measured(&mut feet, &[SourceRule::Carried], &NoProgress);
        let found = found.map_err(|e| e.to_string())?;
        let share = |factor| {
            let DistanceErrors { sources: [a, b] } = self.distances.errors(&found[0], factor);
            (a.mean + b.mean) / (a.mean_distance + b.mean_distance)
        };
        Ok([1.0, factor].map(share))
    }
}

/// The same surface, every face parted into four.
fn parted(mesh: &ManifoldMesh) -> Result<ManifoldMesh, String> {
    let refinement = Refinement::from_mesh(mesh);
    let middle = |side: &Side| {
        let [a, b] = side.ends.map(|v| mesh.positions()[v as usize]);
        0.5 * (a + b)
    };
    let positions = mesh.positions().iter().copied().chain(refinement.edges().iter().map(middle)).collect();
    let faces = refinement.refined().faces().to_vec();
    let mesh = TriangleMesh::new(positions, faces).map_err(|e| e.to_string())?;
    ManifoldMesh::try_from(mesh).map_err(|e| e.to_string())
}

/// The smallest eigenvalues of the surface itself. Those of its triangles are off by the square of their edges, so that
/// two meshes of it, one with the faces of the other parted, tell how far (Richardson). Fine meshes are taken as they are;
/// others are parted at least once, and to at least so many faces.
fn eigenvalues(mesh: &ManifoldMesh, min_faces: usize) -> Result<Vec<f64>, String> {
    let of_triangles = |mesh: &ManifoldMesh| {
        let mut intrinsic = IntrinsicMesh::from_mesh(mesh);
        intrinsic.mollify(MOLLIFICATION);
        let modes = modes(&intrinsic, &ModeOptions::default(), &NoProgress);
        Ok::<_, String>(modes.map_err(|e| e.to_string())?.eigenvalues)
    };
    if mesh.face_count() >= FINE {
        return of_triangles(mesh);
    }
    let (mut coarse, mut fine) = (Cow::Borrowed(mesh), parted(mesh)?);
    while fine.face_count() < min_faces {
        let finer = parted(&fine)?;
        coarse = Cow::Owned(std::mem::replace(&mut fine, finer));
    }
    let (coarse, fine) = (of_triangles(&coarse)?, of_triangles(&fine)?);
    Ok(coarse.iter().zip(&fine).map(|(coarse, fine)| fine + (fine - coarse) / 3.0).collect())
}
