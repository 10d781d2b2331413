//! Geodesic distances of a mesh, compared at the vertices of another.

use std::time::Instant;

use ndf_core::{DVec3, Progress};
use ndf_geodesic::{ExactOptions, Geodesics, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleTree};
use ndf_model::Similarity;
use rayon::prelude::*;
use serde::Serialize;

use super::EvaluateError;
use crate::analysis::closest_point;

/// The places in the box whose closest points are the sources (supplement, §2.1).
pub const SOURCES: [DVec3; 2] = [DVec3::ONE, DVec3::NEG_ONE];

/// What errors are the means over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Averaging {
    /// Vertices of the truth, as in the supplement: the surface, if they lie evenly on it.
    #[default]
    Vertices,
    /// The surface: each vertex stands for the area around it.
    Area,
}

/// Where distances are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DistanceProtocol {
    /// No more vertices of the truth than about this are compared, taken at even steps of their numbers.
    pub max_targets: usize,
    /// On candidates of up to so many faces, distances inside a face are exact, from windows, which fill the memory on larger ones.
    /// Elsewhere they are interpolated between the corners, as in the supplement.
    pub max_exact_faces: usize,
    /// How the mean is taken.
    pub averaging: Averaging,
}

impl Default for DistanceProtocol {
    /// All vertices, interpolation everywhere, means over vertices.
    fn default() -> Self {
        Self { max_targets: usize::MAX, max_exact_faces: 0, averaging: Averaging::Vertices }
    }
}

/// Which point of a candidate is the source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SourceRule {
    /// The one closest to the source of the truth.
    Carried,
    /// The one closest to the corner of the box: the supplement's rule.
    Own,
}

impl SourceRule {
    /// Both, the one that methods are judged by first.
    pub const ALL: [Self; 2] = [Self::Carried, Self::Own];
}

/// Distances on the truth.
#[derive(Clone, Debug)]
pub struct DistanceTruth {
    options: DistanceProtocol,
    /// The places in the units of the mesh, and their closest points on it.
    places: [DVec3; 2],
    sources: [DVec3; 2],
    /// Vertices at which distances are compared, and where they are.
    targets: Vec<u32>,
    positions: Vec<DVec3>,
    /// How much each counts.
    weights: Vec<f64>,
    /// For each source, distances at the targets.
    distances: [Vec<f64>; 2],
}

/// The points of a candidate that are closest to the targets.
#[derive(Clone, Debug)]
pub struct Feet<'a> {
    pub(super) mesh: &'a ManifoldMesh,
    tree: TriangleTree,
    pub(super) points: Vec<SurfacePoint>,
    /// The vertices of the truth that they are closest to.
    pub(super) targets: Vec<u32>,
    /// Wall seconds of finding them and, from then on, of the values at them.
    pub(super) seconds: f64,
}

/// Distances on a candidate at the truth's targets, with lengths as they are.
#[derive(Clone, Debug)]
pub struct MeasuredDistances {
    /// Where its sources come from.
    pub rule: SourceRule,
    /// For each source, distances at the targets.
    pub distances: [Vec<f64>; 2],
    /// Wall seconds of both runs side by side; transfer is counted by [`Feet`]. None where another rule had the same sources.
    pub seconds: f64,
}

/// Errors of distances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DistanceErrors {
    /// Of each source.
    pub sources: [SourceErrors; 2],
}

/// Errors of distances from one source.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SourceErrors {
    /// Mean of |difference| (L¹), in units of length.
    pub mean: f64,
    /// The largest, in units of length.
    pub max: f64,
    /// The mean distance on the truth.
    pub mean_distance: f64,
}

impl DistanceErrors {
    /// The mean of |difference|: the L¹ errors of both sources, averaged.
    pub fn mean(&self) -> f64 {
        0.5 * self.sources.iter().map(|s| s.mean).sum::<f64>()
    }

    /// The mean of |difference| as a share of the mean distance: of both sources, averaged.
    pub fn share(&self) -> f64 {
        0.5 * self.sources.iter().map(|s| s.mean / s.mean_distance).sum::<f64>()
    }

    /// The largest difference.
    pub fn max(&self) -> f64 {
        self.sources.iter().map(|s| s.max).fold(0.0, f64::max)
    }
}

impl DistanceTruth {
    /// Distances on a mesh from the points closest to the [`SOURCES`] of the box.
    ///
    /// # Errors
    /// If there is no closest point, distances fail, or the observer asks to stop.
    pub fn new(
        mesh: &ManifoldMesh,
        similarity: &Similarity,
        options: &DistanceProtocol,
        progress: &dyn Progress,
    ) -> Result<Self, EvaluateError> {
        let tree = TriangleTree::new(mesh);
        let places = SOURCES.map(|place| similarity.to_world(place));
        let sources = closest(mesh, &tree, places)?;
        let intrinsic = IntrinsicMesh::from_mesh(mesh);
        let found = geodesics(&intrinsic, sources, &ExactOptions::default(), progress)?;
        let stride = (mesh.vertex_count() / options.max_targets).max(1);
        let targets: Vec<u32> = (0..mesh.vertex_count() as u32).step_by(stride).collect();
        let at = |v: &u32| mesh.positions()[*v as usize];
        let weights = match options.averaging {
            Averaging::Vertices => vec![1.0; targets.len()],
            Averaging::Area => {
                let areas = areas(mesh);
                targets.iter().map(|&v| areas[v as usize]).collect()
            }
        };
        Ok(Self {
            options: *options,
            places,
            sources: sources.map(|source| source.position(mesh)),
            positions: targets.iter().map(at).collect(),
            weights,
            distances: found.map(|found| targets.iter().map(|&v| found.distances()[v as usize]).collect()),
            targets,
        })
    }

    /// The vertices at which distances are compared.
    pub fn targets(&self) -> &[u32] {
        &self.targets
    }

    /// The points of the truth that distances are measured from.
    pub fn sources(&self) -> [DVec3; 2] {
        self.sources
    }

    /// Distances at the targets, for each source.
    pub fn distances(&self) -> &[Vec<f64>; 2] {
        &self.distances
    }

    /// The points of a candidate closest to the targets. O(m log n) for m targets, over all threads.
    ///
    /// # Errors
    /// If there are none.
    pub fn feet<'a>(&self, mesh: &'a ManifoldMesh) -> Result<Feet<'a>, EvaluateError> {
        let start = Instant::now();
        let tree = TriangleTree::new(mesh);
        let foot = |&p: &DVec3| closest_point(mesh, &tree, p).ok_or(EvaluateError::NoPoint);
        let points = self.positions.par_iter().map(foot).collect::<Result<_, _>>()?;
        Ok(Feet { mesh, tree, points, targets: self.targets.clone(), seconds: start.elapsed().as_secs_f64() })
    }

    /// Distances on a candidate, for each rule.
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub fn measured(
        &self,
        feet: &mut Feet<'_>,
        rules: &[SourceRule],
        progress: &dyn Progress,
    ) -> Result<Vec<MeasuredDistances>, EvaluateError> {
        let intrinsic = IntrinsicMesh::from_mesh(feet.mesh);
        let is_exact = feet.mesh.face_count() <= self.options.max_exact_faces;
        let options = if is_exact { ExactOptions::with_windows() } else { ExactOptions::default() };
        let mut all: Vec<([SurfacePoint; 2], MeasuredDistances)> = Vec::new();
        for &rule in rules {
            let places = match rule {
                SourceRule::Carried => self.sources,
                SourceRule::Own => self.places,
            };
            let sources = closest(feet.mesh, &feet.tree, places)?;
            if let Some((_, earlier)) = all.iter().find(|(theirs, _)| *theirs == sources) {
                let same = MeasuredDistances { rule, seconds: 0.0, ..earlier.clone() };
                all.push((sources, same));
                continue;
            }
            let start = Instant::now();
            let found = geodesics(&intrinsic, sources, &options, progress)?;
            let seconds = start.elapsed().as_secs_f64();
            let start = Instant::now();
            let at = |found: &Geodesics<'_>, point: &SurfacePoint| {
                if is_exact {
                    found.distance_at(*point)
                } else {
                    Ok(interpolated(feet.mesh, *point, found.distances()))
                }
            };
            let transferred = |found: Geodesics<'_>| {
                feet.points.par_iter().map(|point| at(&found, point)).collect::<Result<Vec<f64>, _>>()
            };
            let [first, second] = found.map(transferred);
            feet.seconds += start.elapsed().as_secs_f64();
            all.push((sources, MeasuredDistances { rule, distances: [first?, second?], seconds }));
        }
        Ok(all.into_iter().map(|(_, measured)| measured).collect())
    }

    /// Errors of distances that are multiplied by a factor. What no path reaches on the truth is left out. O(m).
    pub fn errors(&self, measured: &MeasuredDistances, factor: f64) -> DistanceErrors {
        let of_source = |truth: &[f64], found: &[f64]| {
            let (mut errors, mut distances, mut max, mut all) = (0.0, 0.0, 0.0_f64, 0.0);
            let pairs = truth.iter().zip(found).zip(&self.weights);
            for ((truth, found), weight) in pairs.filter(|((truth, _), _)| truth.is_finite()) {
                let error = (factor * found - truth).abs();
                errors += weight * error;
                distances += weight * truth;
                max = max.max(error);
                all += weight;
            }
            SourceErrors { mean: errors / all, max, mean_distance: distances / all }
        };
        DistanceErrors { sources: [0, 1].map(|s| of_source(&self.distances[s], &measured.distances[s])) }
    }
}

/// Distances from each of two sources, side by side.
fn geodesics<'a>(
    mesh: &'a IntrinsicMesh,
    [first, second]: [SurfacePoint; 2],
    options: &ExactOptions,
    progress: &dyn Progress,
) -> Result<[Geodesics<'a>; 2], EvaluateError> {
    let from = |source| exact_distances(mesh, &[source], options, progress);
    let (first, second) = rayon::join(|| from(first), || from(second));
    Ok([first?, second?])
}

/// A third of the area of the faces around each vertex.
fn areas(mesh: &ManifoldMesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.vertex_count()];
    for (f, face) in mesh.face_indices().zip(mesh.faces()) {
        face.iter().for_each(|&v| areas[v as usize] += mesh.face_area(f) / 3.0);
    }
    areas
}

fn closest(
    mesh: &ManifoldMesh,
    tree: &TriangleTree,
    [first, second]: [DVec3; 2],
) -> Result<[SurfacePoint; 2], EvaluateError> {
    let of = |place| closest_point(mesh, tree, place).ok_or(EvaluateError::NoPoint);
    Ok([of(first)?, of(second)?])
}

/// A piecewise linear function at a point.
pub(super) fn interpolated(mesh: &ManifoldMesh, point: SurfacePoint, values: &[f64]) -> f64 {
    let point = point.in_some_face(mesh);
    point.interpolate(mesh.faces()[point.face.index()].map(|v| values[v as usize]))
}
