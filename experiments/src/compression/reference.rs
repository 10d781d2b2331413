//! How far a mesh is from the one it stands for: distances, geodesics, eigenvalues.

use ndf::analysis::closest_point;
use ndf_core::{DVec3, NoProgress};
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::metrics::{MeasureOptions, measure};
use ndf_mesh::subdivision::{Refinement, Side};
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleMesh, TriangleTree};
use ndf_model::Similarity;
use ndf_spectral::{ModeOptions, modes};
use rayon::prelude::*;

/// Vertices to which distances are compared.
const TARGETS: usize = 4_000;
/// The reference's own eigenvalues are those of a mesh of at least so many faces: of the same surface, its faces parted.
const SPECTRAL_FACES: usize = 200_000;
/// On meshes of more faces, whose windows would fill the memory, distances inside a face are taken from those at its
/// corners, linearly.
const MOST_FACES_WITH_WINDOWS: usize = 100_000;
/// The places, in the box of side 3, whose closest points distances are measured from (supplement, §2.1).
const SOURCES: [DVec3; 2] = [DVec3::ONE, DVec3::NEG_ONE];

/// How far a mesh is from the reference.
pub(super) struct Errors {
    /// Of the diagonal: the larger of the means of both ways.
    pub(super) mean: f64,
    /// Of the diagonal: the largest distance of both ways.
    pub(super) max: f64,
    /// Of geodesic distances: the mean error, of the mean distance (L¹).
    pub(super) geodesic: f64,
    /// Mean relative error of the 20 smallest eigenvalues, the zero aside.
    pub(super) eigenvalues: f64,
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
    pub(super) fn new(mesh: TriangleMesh) -> Result<Self, String> {
        let mesh = ManifoldMesh::try_from(mesh).map_err(|e| e.to_string())?;
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
        let mut fine = mesh.clone();
        while fine.face_count() < SPECTRAL_FACES {
            fine = parted(&fine)?;
        }
        let eigenvalues = eigenvalues(&IntrinsicMesh::from_mesh(&fine))?;
        Ok(Self { mesh, distances, eigenvalues })
    }

    /// How far another mesh is.
    pub(super) fn errors(&self, mesh: &ManifoldMesh) -> Result<Errors, String> {
        let there = measure(&self.mesh, mesh, &MeasureOptions::default()).map_err(|e| e.to_string())?;
        let intrinsic = IntrinsicMesh::from_mesh(mesh);
        let (eigenvalues, geodesic) =
            rayon::join(|| eigenvalues(&intrinsic), || self.geodesic_error(mesh, &intrinsic));
        let eigenvalues = eigenvalues?;
        let pairs = self.eigenvalues.iter().zip(&eigenvalues).skip(1);
        let relative: Vec<f64> = pairs.map(|(truth, found)| (found - truth).abs() / truth).collect();
        Ok(Errors {
            mean: there.mesh_to_reference.mean.max(there.reference_to_mesh.mean) / there.diagonal,
            max: there.hausdorff / there.diagonal,
            geodesic: geodesic?,
            eigenvalues: relative.iter().sum::<f64>() / relative.len() as f64,
        })
    }

    fn geodesic_error(&self, mesh: &ManifoldMesh, intrinsic: &IntrinsicMesh) -> Result<f64, String> {
        let tree = TriangleTree::new(mesh);
        let closest = |p: DVec3| closest_point(mesh, &tree, p).ok_or("no point is closest");
        let is_fine = mesh.face_count() > MOST_FACES_WITH_WINDOWS;
        let options = if is_fine { ExactOptions::default() } else { ExactOptions::with_windows() };
        // Sums of errors and of distances.
        let sums = |Distances { source, targets }: &Distances| -> Result<(f64, f64), String> {
            let found = exact_distances(intrinsic, &[closest(*source)?], &options, &NoProgress)
                .map_err(|e| e.to_string())?;
            let distance_at = |point: SurfacePoint| {
                if is_fine {
                    let point = point.in_some_face(mesh);
                    let corners = mesh.faces()[point.face.index()].map(|v| found.distances()[v as usize]);
                    return Ok(point.interpolate(corners));
                }
                found.distance_at(point).map_err(|e| e.to_string())
            };
            let mut sums = (0.0, 0.0);
            for &(target, truth) in targets {
                sums.0 += (distance_at(closest(target)?)? - truth).abs();
                sums.1 += truth;
            }
            Ok(sums)
        };
        let sums: Vec<(f64, f64)> = self.distances.par_iter().map(sums).collect::<Result<_, _>>()?;
        let (error, whole) = sums.iter().fold((0.0, 0.0), |sum, s| (sum.0 + s.0, sum.1 + s.1));
        Ok(error / whole)
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

fn eigenvalues(mesh: &IntrinsicMesh) -> Result<Vec<f64>, String> {
    let modes = modes(mesh, &ModeOptions::default(), &NoProgress).map_err(|e| e.to_string())?;
    Ok(modes.eigenvalues)
}
