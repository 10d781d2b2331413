//! Centres of points of a surface: Karcher's mean and the geometric median (Sharp, Soliman and Crane 2019, §8.4; Karcher 1977; Weiszfeld
//! 1937).
//!
//! The mean of the logarithms of the points leads from a place to a better one. Heat finds the vertex to begin at, and the shortest paths
//! themselves give the logarithms, so that the centre is exact on the triangles and may lie anywhere in a face.

use ndf_core::Progress;
use ndf_geodesic::{ExactOptions, GeodesicError, HeatSolver, Path, exact_distances, straightest_geodesic};
use ndf_intrinsic::{IntrinsicMesh, triangle};
use ndf_mesh::{FacePoint, SurfacePoint, Vertex};
use num_complex::Complex64;

use crate::error::FieldError;
use crate::faces::Layout;
use crate::points::in_faces;

/// Steps shorter than this part of the mean edge length end the search.
const TOLERANCE: f64 = 1e-6;

/// A centre at a vertex is sought this far from it in barycentric coordinates, where directions are those of a face.
const OFF_VERTEX: f64 = 1e-9;

/// Which centre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CentreKind {
    /// The mean: the sum of squared distances is least.
    #[default]
    Mean,
    /// The geometric median: the sum of distances is least.
    Median,
}

/// A centre of points.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Centre {
    /// Where it is.
    pub point: FacePoint,
    /// The weighted mean of the squared distances from the points.
    pub variance: f64,
    /// The weighted mean of the distances.
    pub mean_distance: f64,
    /// The distance of the farthest point.
    pub max_distance: f64,
    /// Steps that were taken.
    pub iterations: usize,
    /// Whether the last step was short enough, or no step led to a better place; otherwise the search was given up.
    pub has_converged: bool,
}

/// A centre of weighted points. It is a local one, found from the vertex that is best by the heat method: points that lie far from each
/// other, as those around a torus or all over a sphere do, may have several, and one of them is told. Shortest paths on triangles shun
/// vertices at which the surface bends outwards; where it is curved, the centre is therefore a part of an edge off that of the smooth
/// surface.
///
/// Cost: distances by heat from each point, and exact distances as far as the points for every step, some ten.
///
/// # Errors
/// If there is no point, one is not on the mesh, a weight is not positive, no paths lead from one of the points to all others, a matrix
/// is not positive definite to double precision, or the observer asks to stop.
pub fn geodesic_centre(
    mesh: &IntrinsicMesh,
    points: &[(SurfacePoint, f64)],
    kind: CentreKind,
    max_iterations: usize,
    progress: &dyn Progress,
) -> Result<Centre, FieldError> {
    if let Some(&(_, value)) = points.iter().find(|(_, weight)| !(*weight > 0.0 && weight.is_finite())) {
        return Err(FieldError::NotPositive { name: "a weight", value });
    }
    let search = Search { mesh, points, kind };
    let mean = mesh.lengths().iter().sum::<f64>() / mesh.edge_count().max(1) as f64;
    let tolerance = TOLERANCE * mean;
    let mut place = search.place(search.start(progress)?, progress)?;
    for iteration in 0..max_iterations {
        progress.report("centre", iteration as f64 / max_iterations as f64);
        let mut step = place.step(&search);
        let better = loop {
            if step.norm() <= tolerance {
                break None;
            }
            let next = straightest_geodesic(mesh, place.point, [step.re, step.im])?.end;
            let next = search.place(next, progress)?;
            if next.energy(&search) < place.energy(&search) {
                break Some(next);
            }
            step *= 0.5;
        };
        match better {
            Some(next) => place = next,
            None => return Ok(place.told(&search, iteration, true)),
        }
    }
    Ok(place.told(&search, max_iterations, false))
}

/// What is sought.
struct Search<'a> {
    mesh: &'a IntrinsicMesh,
    points: &'a [(SurfacePoint, f64)],
    kind: CentreKind,
}

impl Search<'_> {
    fn weight(&self) -> f64 {
        self.points.iter().map(|(_, weight)| weight).sum()
    }

    fn cost(&self, distance: f64) -> f64 {
        match self.kind {
            CentreKind::Mean => distance * distance,
            CentreKind::Median => distance,
        }
    }

    /// The vertex that is best by the heat method.
    fn start(&self, progress: &dyn Progress) -> Result<FacePoint, FieldError> {
        let solver = HeatSolver::with_time(self.mesh, 1.0, progress)?;
        let mut energies = vec![0.0; self.mesh.vertex_count()];
        for (number, &(point, weight)) in self.points.iter().enumerate() {
            progress.check()?;
            progress.report("distances", number as f64 / self.points.len() as f64);
            let distances = solver.distances(&[point])?.values;
            energies.iter_mut().zip(&distances).for_each(|(sum, &d)| *sum += weight * self.cost(d));
        }
        let best = (0..energies.len()).min_by(|&a, &b| energies[a].total_cmp(&energies[b]));
        match (self.points.first(), best) {
            (Some(_), Some(v)) if energies[v].is_finite() => {
                Ok(FacePoint::at_corner(self.mesh.vertex_halfedge(Vertex::new(v))))
            }
            (Some(&(point, _)), _) => Err(GeodesicError::Unreached { point }.into()),
            (None, _) => Err(FieldError::NoSource),
        }
    }

    /// A point with the logarithms of all points there, in the layout of its face.
    fn place(&self, point: FacePoint, progress: &dyn Progress) -> Result<PlaceOnWay, FieldError> {
        let barycentric = point.barycentric.map(|b| (b + OFF_VERTEX) / (1.0 + 3.0 * OFF_VERTEX));
        let point = FacePoint { barycentric, ..point };
        let at = SurfacePoint::Face(point);
        let targets = self.points.iter().map(|(target, _)| *target).collect();
        let options = ExactOptions { targets, ..ExactOptions::with_windows() };
        let geodesics = exact_distances(self.mesh, &[at], &options, progress)?;
        let log = |&(target, _): &(SurfacePoint, f64)| {
            let path = geodesics.path_to(target)?;
            if path.length == 0.0 {
                return Ok(Complex64::default());
            }
            let direction =
                departure(self.mesh, point, &path)?.ok_or(GeodesicError::PathLost { point: at })?;
            Ok(Complex64::from_polar(path.length, direction))
        };
        let logs = self.points.iter().map(log).collect::<Result<_, FieldError>>()?;
        Ok(PlaceOnWay { point, logs })
    }
}

/// A place that the search has come to.
struct PlaceOnWay {
    point: FacePoint,
    logs: Vec<Complex64>,
}

impl PlaceOnWay {
    fn mean(&self, search: &Search<'_>, of: impl Fn(f64) -> f64) -> f64 {
        let terms = self.logs.iter().zip(search.points).map(|(z, (_, weight))| weight * of(z.norm()));
        terms.sum::<f64>() / search.weight()
    }

    fn energy(&self, search: &Search<'_>) -> f64 {
        self.mean(search, |d| search.cost(d))
    }

    /// The step to a better place: the mean of the logarithms, or Weiszfeld's, with what Vardi and Zhang (2000) say of places that are
    /// one of the points.
    fn step(&self, search: &Search<'_>) -> Complex64 {
        let weighted = || self.logs.iter().zip(search.points.iter().map(|(_, weight)| *weight));
        match search.kind {
            CentreKind::Mean => weighted().map(|(z, weight)| z * weight).sum::<Complex64>() / search.weight(),
            CentreKind::Median => {
                let is_here =
                    |z: &Complex64| z.norm() <= 10.0 * OFF_VERTEX * search.mesh.sides(self.point.face)[0];
                let held: f64 = weighted().filter(|(z, _)| is_here(z)).map(|(_, weight)| weight).sum();
                let others = || weighted().filter(|(z, _)| !is_here(z));
                let pull: Complex64 = others().map(|(z, weight)| z / z.norm() * weight).sum();
                let inverse: f64 = others().map(|(z, weight)| weight / z.norm()).sum();
                let free = pull.norm() - held;
                if free > 0.0 { pull / pull.norm() * (free / inverse) } else { Complex64::default() }
            }
        }
    }

    fn told(&self, search: &Search<'_>, iterations: usize, has_converged: bool) -> Centre {
        Centre {
            point: self.point,
            variance: self.mean(search, |d| d * d),
            mean_distance: self.mean(search, |d| d),
            max_distance: self.logs.iter().map(|z| z.norm()).fold(0.0, f64::max),
            iterations,
            has_converged,
        }
    }
}

/// The direction, in the layout of its face, in which a path leaves the point where it ends, which is its source.
fn departure(mesh: &IntrinsicMesh, from: FacePoint, path: &Path) -> Result<Option<f64>, FieldError> {
    let Some(&next) = path.points.iter().rev().nth(1) else { return Ok(None) };
    let corners = Layout::of(mesh, from.face).corners();
    let at = from.interpolate(corners);
    let places = in_faces(mesh, next)?;
    if let Some(place) = places.iter().find(|place| place.face == from.face) {
        return Ok(Some((place.interpolate(corners) - at).arg()));
    }
    // The point is on the rim, and the path leaves over it: the face beyond is laid out beside.
    let beyond = |c: usize| {
        let twin = mesh.twin(from.face.halfedge(c))?;
        let place = places.iter().find(|place| place.face == twin.face())?;
        let (tail, tip) = (corners[(c + 1) % 3], corners[c]);
        let along = tip - tail;
        let [x, y] = triangle::apex(mesh.sides_from(twin));
        let apex = tail + along / along.norm() * Complex64::new(x, y);
        let [a, b, o] = [0, 1, 2].map(|i| place.barycentric[(twin.corner() + i) % 3]);
        Some((tail * a + tip * b + apex * o - at).arg())
    };
    Ok((0..3).find_map(beyond))
}
