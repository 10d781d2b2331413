//! How far a mesh is from the one it stands for: distances, geodesics, eigenvalues.

use std::borrow::Cow;

use ndf::analysis::closest_point;
use ndf_core::{DVec3, NoProgress};
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::metrics::{MeasureOptions, measure};
use ndf_mesh::subdivision::{Refinement, Side};
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleMesh, TriangleTree};
use ndf_model::{LengthFactors, Similarity};
use ndf_spectral::{ModeOptions, modes};
use rayon::prelude::*;

/// Vertices to which distances are compared.
const TARGETS: usize = 4_000;
/// Meshes of fewer faces have their eigenvalues extrapolated.
const FINE: usize = 200_000;
/// Where coarse meshes are parted to at least so many faces for that.
const PARTED: usize = 30_000;
/// On a grid some faces lose their area: this share of the mean length is then added to all edges. That of `ndf-spectral` is
/// too small for some meshes.
const MOLLIFICATION: f64 = 1e-6;
/// On meshes of more faces, whose windows would fill the memory, distances inside a face are taken from those at its
/// corners, linearly.
const MAX_FACES_WITH_WINDOWS: usize = 100_000;
/// The places, in the box of side 3, whose closest points distances are measured from (supplement, §2.1).
const SOURCES: [DVec3; 2] = [DVec3::ONE, DVec3::NEG_ONE];

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

/// A point and its distances from some others.
struct Distances {
    source: DVec3,
    targets: Vec<(DVec3, f64)>,
}

/// A mesh with what others are compared to.
pub(super) struct Reference {
    pub(super) mesh: ManifoldMesh,
    distances: Vec<Distances>,
    eigenvalues: Vec<f64>,
}

impl Reference {
    pub(super) fn new(mesh: ManifoldMesh) -> Result<Self, String> {
        let intrinsic = IntrinsicMesh::from_mesh(&mesh);
        let tree = TriangleTree::new(&mesh);
        let similarity = Similarity::from_bounds(&mesh.bounds());
        let distances = |place: DVec3| -> Result<Distances, String> {
            let source =
                closest_point(&mesh, &tree, similarity.to_world(place)).ok_or("no point is closest")?;
            let found = exact_distances(&intrinsic, &[source], &ExactOptions::default(), &NoProgress);
            let found = found.map_err(|e| e.to_string())?;
            let stride = (mesh.vertex_count() / TARGETS).max(1);
            let targets = mesh.positions().iter().copied().zip(found.distances().iter().copied());
            let targets = targets.step_by(stride).filter(|(_, d)| d.is_finite()).collect();
            Ok(Distances { source: source.position(&mesh), targets })
        };
        let distances = SOURCES.into_iter().map(distances).collect::<Result<_, _>>()?;
        let eigenvalues = eigenvalues(&mesh, FINE)?;
        Ok(Self { mesh, distances, eigenvalues })
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
        let error = |factor: f64| {
            let pairs = self.eigenvalues.iter().zip(&eigenvalues).skip(1);
            let relative = pairs.map(|(truth, found)| (found / factor.powi(2) - truth).abs() / truth);
            relative.sum::<f64>() / (self.eigenvalues.len() - 1) as f64
        };
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

    /// The error of distances as they are, and of those multiplied by a factor.
    fn geodesic_error(&self, mesh: &ManifoldMesh, factor: f64) -> Result<[f64; 2], String> {
        let intrinsic = IntrinsicMesh::from_mesh(mesh);
        let tree = TriangleTree::new(mesh);
        let closest = |p: DVec3| closest_point(mesh, &tree, p).ok_or("no point is closest");
        let is_fine = mesh.face_count() > MAX_FACES_WITH_WINDOWS;
        let options = if is_fine { ExactOptions::default() } else { ExactOptions::with_windows() };
        // Sums of both errors and of distances.
        let sums = |Distances { source, targets }: &Distances| -> Result<[f64; 3], String> {
            let found = exact_distances(&intrinsic, &[closest(*source)?], &options, &NoProgress)
                .map_err(|e| e.to_string())?;
            let distance_at = |point: SurfacePoint| {
                if is_fine {
                    let point = point.in_some_face(mesh);
                    let corners = mesh.faces()[point.face.index()].map(|v| found.distances()[v as usize]);
                    return Ok(point.interpolate(corners));
                }
                found.distance_at(point).map_err(|e| e.to_string())
            };
            let mut sums = [0.0; 3];
            for &(target, truth) in targets {
                let found = distance_at(closest(target)?)?;
                let terms = [(found - truth).abs(), (factor * found - truth).abs(), truth];
                sums = [0, 1, 2].map(|k| sums[k] + terms[k]);
            }
            Ok(sums)
        };
        let sums: Vec<[f64; 3]> = self.distances.par_iter().map(sums).collect::<Result<_, _>>()?;
        let [plain, corrected, whole] = [0, 1, 2].map(|k| sums.iter().map(|s| s[k]).sum::<f64>());
        Ok([plain / whole, corrected / whole])
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
