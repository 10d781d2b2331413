//! Distances and paths between many places of one surface: what they share is prepared once.

use std::borrow::Cow;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use ndf_core::{Hint, Progress};
use ndf_geodesic::{
    ExactOptions, GeodesicError, Geodesics, HeatSolver, Path, ThroughOptions, exact_distances,
    geodesic_through,
};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::repair::{Irreparable, Origins, double_cover};
use ndf_mesh::{FacePoint, ManifoldMesh, SurfacePoint, TriangleMesh, TriangleTree, Vertex};
use rayon::prelude::*;

use super::{
    DistanceError, DistanceMethod, DistanceOptions, Distances, HeatReport, Place, StraightPath, SurfacePath,
};
use super::{Original, Triangles, Triangulated};
use crate::Note;
use crate::analysis::SNAP;

/// Places farther from the surface than this share of its diagonal are noted.
const NOTABLY_OFF: f64 = 1e-3;

/// The largest time step that is tried where none is given: heat reaches some 200,000 edges.
pub(super) const MAX_TIME_STEP: f64 = 65536.0;

impl Triangulated {
    /// Distances of all vertices from the nearest source. A surface that cannot be oriented is measured on its double
    /// cover. Exact distances pass vertices in which fans of faces meet; heat does not. [`DistanceSolver`] prepares more
    /// than one such call.
    ///
    /// # Errors
    /// If an edge has three faces, a source or target is not on the surface, or the observer asks to stop.
    pub fn distances(
        &self,
        sources: &[Place],
        options: &DistanceOptions,
        progress: &dyn Progress,
    ) -> Result<Distances, DistanceError> {
        DistanceSolver::new(Cow::Borrowed(self))?.distances(sources, options, progress)
    }
}

/// A surface on which distances are measured again and again: lengths, the tree of faces and the factors of the heat
/// method are made once.
#[derive(Debug)]
pub struct DistanceSolver<'a> {
    surface: Cow<'a, Triangulated>,
    /// The double cover of what cannot be oriented.
    cover: Option<(ManifoldMesh, Origins)>,
    mesh: IntrinsicMesh,
    /// Vertices between which paths pass, since they are one in the file.
    joined: Vec<Vec<Vertex>>,
    tree: OnceLock<TriangleTree>,
    /// By time step.
    heat: Mutex<Vec<(f64, Arc<HeatSolver>)>>,
}

impl<'a> DistanceSolver<'a> {
    /// Prepares a surface. O(n).
    ///
    /// # Errors
    /// If an edge has three faces.
    pub fn new(surface: Cow<'a, Triangulated>) -> Result<Self, DistanceError> {
        let cover = match (&surface.triangles, &surface.original) {
            (Triangles::Manifold(_), _) => None,
            (Triangles::Soup { reason: Irreparable::NotManifold(reason), .. }, _) => {
                return Err(DistanceError::NotManifold(reason.clone()));
            }
            (Triangles::Soup { mesh, reason: Irreparable::OneSided }, original) => {
                let (mesh, options) = match original {
                    Some(Original { mesh, options, .. }) => (mesh, *options),
                    None => (mesh, Default::default()),
                };
                Some(double_cover(mesh, &options).map_err(DistanceError::NotManifold)?)
            }
        };
        let tree = OnceLock::new();
        let working = working(&surface, cover.as_ref(), &tree);
        let mesh = IntrinsicMesh::from_mesh(working.mesh).scaled(surface.applied().distances);
        let joined = working.joined();
        Ok(Self { surface, cover, mesh, joined, tree, heat: Mutex::default() })
    }

    /// The surface.
    pub fn surface(&self) -> &Triangulated {
        &self.surface
    }

    /// As [`Triangulated::distances`].
    ///
    /// # Errors
    /// If a source or target is not on the surface, or the observer asks to stop.
    pub fn distances(
        &self,
        sources: &[Place],
        options: &DistanceOptions,
        progress: &dyn Progress,
    ) -> Result<Distances, DistanceError> {
        let working = self.working();
        let mut notes = Vec::new();
        let (points, owners) = self.sources(sources, &mut notes)?;
        let mut targets = Vec::new();
        for &place in &options.paths_to {
            // Of several places that are one, any will do.
            targets.extend(working.points(place, &mut notes)?.first().copied());
        }
        let radius = options.max_distance.unwrap_or(f64::INFINITY);
        let exact = ExactOptions { keep_windows: !targets.is_empty(), radius, ..self.exact() };
        let paths_to = |geodesics: &Geodesics<'_>, targets: &[SurfacePoint]| {
            let path = |path: Path| working.path(path, &owners);
            targets.iter().map(|&target| geodesics.path_to(target).map(path)).collect()
        };
        if options.method == DistanceMethod::Exact {
            let geodesics = exact_distances(&self.mesh, &points, &exact, progress)?;
            let paths = paths_to(&geodesics, &targets);
            let values = working.values(geodesics.distances());
            let nearest = if options.nearest { working.nearest(&geodesics, &owners) } else { Vec::new() };
            return Ok(Distances { values, nearest, heat: None, paths, notes });
        }
        let (mut values, heat) = self.heat(&points, options.time_step, progress)?;
        values.iter_mut().filter(|d| **d > radius).for_each(|d| *d = f64::INFINITY);
        // The heat method has no paths of its own; the exact one need go no farther than the targets.
        let paths = if targets.is_empty() {
            Vec::new()
        } else {
            let exact = ExactOptions { targets: targets.clone(), ..exact };
            paths_to(&exact_distances(&self.mesh, &points, &exact, progress)?, &targets)
        };
        let values = working.values(&values);
        Ok(Distances { values, nearest: Vec::new(), heat: Some(heat), paths, notes })
    }

    /// Distances of points of faces from the nearest source: exact, or, with the heat method, linear between the corners.
    ///
    /// # Errors
    /// As for [`distances`](Self::distances), or if a point is not on the surface.
    pub fn distances_at(
        &self,
        sources: &[Place],
        points: &[FacePoint],
        options: &DistanceOptions,
        progress: &dyn Progress,
    ) -> Result<Vec<f64>, DistanceError> {
        let working = self.working();
        let (sources, _) = self.sources(sources, &mut Vec::new())?;
        let at = |point: FacePoint, of: &dyn Fn(SurfacePoint) -> Result<f64, GeodesicError>| {
            let over = working.points(Place::Point(point), &mut Vec::new())?;
            over.into_iter().try_fold(f64::INFINITY, |least, point| Ok(least.min(of(point)?)))
        };
        if options.method == DistanceMethod::Exact {
            let exact = ExactOptions { keep_windows: true, ..self.exact() };
            let geodesics = exact_distances(&self.mesh, &sources, &exact, progress)?;
            return points.iter().map(|&point| at(point, &|p| geodesics.distance_at(p))).collect();
        }
        let (values, _) = self.heat(&sources, options.time_step, progress)?;
        let between = |point: SurfacePoint| {
            let point = point.in_some_face(working.mesh);
            let corners = working.mesh.faces()[point.face.index()];
            Ok(point.interpolate(corners.map(|v| values[v as usize])))
        };
        points.iter().map(|&point| at(point, &between)).collect()
    }

    /// A shortest path from one place to another. The distances that it needs go no farther than its end.
    ///
    /// # Errors
    /// If a place is not on the surface, no path leads there, or the observer asks to stop.
    pub fn path(
        &self,
        from: Place,
        to: Place,
        progress: &dyn Progress,
    ) -> Result<SurfacePath, DistanceError> {
        let working = self.working();
        let (points, owners) = self.sources(&[from], &mut Vec::new())?;
        let targets: Vec<SurfacePoint> =
            working.points(to, &mut Vec::new())?.first().copied().into_iter().collect();
        let exact = ExactOptions { keep_windows: true, targets: targets.clone(), ..self.exact() };
        let geodesics = exact_distances(&self.mesh, &points, &exact, progress)?;
        let target = targets.first().copied().ok_or(GeodesicError::NoSource)?;
        Ok(working.path(geodesics.path_to(target)?, &owners))
    }

    /// A path through places, or one that only winds as the way through them does, made straight: see
    /// [`geodesic_through`]. Places are moved to the nearest corner of their faces. No path leads through a vertex in which fans of
    /// faces meet.
    ///
    /// # Errors
    /// If there are fewer than two places, one is not on the surface, or no path leads there; or the observer asks to stop.
    pub fn through(
        &self,
        places: &[Place],
        options: ThroughOptions,
        progress: &dyn Progress,
    ) -> Result<StraightPath, DistanceError> {
        let working = self.working();
        let mut notes = Vec::new();
        let mut vertices = Vec::new();
        for &place in places {
            vertices.extend(working.points(place, &mut notes)?.first().map(|&point| working.corner(point)));
        }
        let found = geodesic_through(working.mesh, &vertices, options, progress)?;
        let points = found.points.iter().map(|point| working.on_file(point.in_some_face(working.mesh)));
        Ok(StraightPath {
            points: points.collect(),
            length: self.surface.applied().distances * found.length,
            is_geodesic: found.is_geodesic,
            flips: found.flips,
            notes,
        })
    }

    /// Exact distances between all pairs of vertices of the [mesh](Triangulated::mesh), k × k, row by row: symmetric, and
    /// zero on the diagonal. Every row is computed once for the vertices after it, the rows in parallel; +∞ where no path
    /// leads.
    ///
    /// # Errors
    /// If there is no such vertex, or the observer asks to stop.
    pub fn matrix(&self, vertices: &[Vertex], progress: &dyn Progress) -> Result<Vec<f64>, DistanceError> {
        let working = self.working();
        let places = |&vertex: &Vertex| working.points(Place::Vertex(vertex), &mut Vec::new());
        let places = vertices.iter().map(places).collect::<Result<Vec<_>, _>>()?;
        let count = vertices.len();
        let row = |i: usize| -> Result<Vec<f64>, DistanceError> {
            let targets: Vec<SurfacePoint> = places[i + 1..].iter().flatten().copied().collect();
            if targets.is_empty() {
                return Ok(Vec::new());
            }
            let exact = ExactOptions { targets, ..self.exact() };
            let geodesics = exact_distances(&self.mesh, &places[i], &exact, progress)?;
            let distance = |place: &Vec<SurfacePoint>| {
                let at = |&point: &SurfacePoint| geodesics.distance_at(point);
                place.iter().map(at).try_fold(f64::INFINITY, |least, d| Ok(least.min(d?)))
            };
            places[i + 1..].iter().map(distance).collect()
        };
        let rows = (0..count).into_par_iter().map(row).collect::<Result<Vec<_>, _>>()?;
        let mut matrix = vec![0.0; count * count];
        for (i, row) in rows.iter().enumerate() {
            for (j, &distance) in (i + 1..).zip(row) {
                matrix[i * count + j] = distance;
                matrix[j * count + i] = distance;
            }
        }
        Ok(matrix)
    }

    fn working(&self) -> Working<'_> {
        working(&self.surface, self.cover.as_ref(), &self.tree)
    }

    fn exact(&self) -> ExactOptions {
        ExactOptions { joined: self.joined.clone(), ..ExactOptions::default() }
    }

    /// The points of the working mesh that sources mean, and the number of the source of each.
    fn sources(
        &self,
        sources: &[Place],
        notes: &mut Vec<Note>,
    ) -> Result<(Vec<SurfacePoint>, Vec<usize>), DistanceError> {
        let working = self.working();
        let (mut points, mut owners) = (Vec::new(), Vec::new());
        for (number, &place) in sources.iter().enumerate() {
            let found = working.points(place, notes)?;
            owners.extend(found.iter().map(|_| number));
            points.extend(found);
        }
        Ok((points, owners))
    }

    /// Distances at the vertices of the working mesh by the heat method.
    fn heat(
        &self,
        sources: &[SurfacePoint],
        asked: Option<f64>,
        progress: &dyn Progress,
    ) -> Result<(Vec<f64>, HeatReport), DistanceError> {
        let mut time_step = asked.unwrap_or(1.0);
        loop {
            let found = self.heat_solver(time_step, progress)?.distances(sources)?;
            if found.out_of_reach == 0 || asked.is_some() || time_step >= MAX_TIME_STEP {
                let report = HeatReport { time_step, out_of_reach: found.out_of_reach };
                return Ok((found.values, report));
            }
            progress.check().map_err(GeodesicError::from)?;
            time_step *= 4.0;
        }
    }

    fn heat_solver(&self, time_step: f64, progress: &dyn Progress) -> Result<Arc<HeatSolver>, GeodesicError> {
        let known = || self.heat.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, solver)) = known().iter().find(|(time, _)| *time == time_step) {
            return Ok(solver.clone());
        }
        let solver = Arc::new(HeatSolver::with_time(&self.mesh, time_step, progress)?);
        known().push((time_step, solver.clone()));
        Ok(solver)
    }
}

/// What distances on a surface are computed on.
pub(super) fn working<'a>(
    surface: &'a Triangulated,
    cover: Option<&'a (ManifoldMesh, Origins)>,
    tree: &'a OnceLock<TriangleTree>,
) -> Working<'a> {
    match (&surface.triangles, cover, &surface.original) {
        (_, Some((mesh, origins)), original) => {
            let file = original.as_ref().map_or(surface.triangles.mesh(), |original| &original.mesh);
            Working { mesh, tree, original: Some((file, origins)), sheets: 2 }
        }
        (Triangles::Manifold(mesh), None, original) => {
            let original = original.as_ref().map(|original| (&original.mesh, &original.origins));
            Working { mesh, tree, original, sheets: 1 }
        }
        (Triangles::Soup { .. }, None, _) => unreachable!("what is no manifold has a cover, or no distances"),
    }
}

/// What distances are computed on.
pub(super) struct Working<'a> {
    mesh: &'a ManifoldMesh,
    /// Made when a place is to be found on it.
    tree: &'a OnceLock<TriangleTree>,
    /// The mesh of the file and where the working mesh comes from, where they are not the same.
    original: Option<(&'a TriangleMesh, &'a Origins)>,
    /// How many points of the working mesh lie over one of the surface.
    sheets: usize,
}

impl Working<'_> {
    /// The points of the working mesh that a place means.
    pub(super) fn points(
        &self,
        place: Place,
        notes: &mut Vec<Note>,
    ) -> Result<Vec<SurfacePoint>, DistanceError> {
        let file = self.original.map_or(&**self.mesh, |(mesh, _)| mesh);
        match (place, self.original) {
            (Place::Vertex(vertex), _) if vertex.index() >= file.vertex_count() => {
                Err(DistanceError::NoVertex { vertex, vertices: file.vertex_count() })
            }
            (Place::Vertex(vertex), None) => Ok(vec![SurfacePoint::Vertex(vertex)]),
            (Place::Vertex(vertex), Some((_, origins))) => match origins.of_vertex(vertex) {
                [] => Err(DistanceError::Unused { vertex }),
                all => Ok(all.iter().copied().map(SurfacePoint::Vertex).collect()),
            },
            (Place::Near(position), _) => {
                let tree = self.tree.get_or_init(|| TriangleTree::new(self.mesh));
                let no_point = || DistanceError::NoPoint(position);
                let foot = tree.closest_point(position, Hint::NONE).ok_or_else(no_point)?;
                let distance = foot.distance_squared.sqrt();
                if distance > NOTABLY_OFF * tree.bounds().diagonal() {
                    notes.push(Note::PlaceOff { place: position.to_array(), distance });
                }
                match self.sheets {
                    1 => Ok(vec![SurfacePoint::snapped(self.mesh, foot.at, SNAP)]),
                    _ => Ok(self.over(self.on_file(foot.at))),
                }
            }
            (Place::Point(point), _) => match self.over(point) {
                none if none.is_empty() => Err(DistanceError::NoFace(point)),
                all => Ok(all),
            },
        }
    }

    /// The points of the working mesh over one of the file's mesh.
    fn over(&self, point: FacePoint) -> Vec<SurfacePoint> {
        let faces = match self.original {
            Some((_, origins)) => origins.over(point),
            None => Vec::from_iter((point.face.index() < self.mesh.face_count()).then_some(point)),
        };
        faces.into_iter().map(|point| SurfacePoint::snapped(self.mesh, point, SNAP)).collect()
    }

    /// A point of the working mesh as one of the file's.
    pub(super) fn on_file(&self, point: FacePoint) -> FacePoint {
        self.original.map_or(point, |(_, origins)| origins.point(point))
    }

    /// Vertices between which paths pass, since they are one in the file.
    fn joined(&self) -> Vec<Vec<Vertex>> {
        let Some((_, origins)) = self.original else { return Vec::new() };
        origins.separated().filter(|group| group.len() > self.sheets).map(<[Vertex]>::to_vec).collect()
    }

    /// Distances at the file's vertices.
    fn values(&self, values: &[f64]) -> Vec<f64> {
        match self.original {
            Some((_, origins)) => origins.values(values, f64::INFINITY, f64::min),
            None => values.to_vec(),
        }
    }

    /// The nearest sources of the file's vertices.
    fn nearest(&self, geodesics: &Geodesics<'_>, owners: &[usize]) -> Vec<Option<usize>> {
        let nearest =
            geodesics.nearest_sources().into_iter().map(|source| source.map(|source| owners[source]));
        let nearest: Vec<Option<usize>> = nearest.collect();
        let Some((_, origins)) = self.original else { return nearest };
        let both: Vec<_> = geodesics.distances().iter().copied().zip(nearest).collect();
        let nearer = |a: (f64, Option<usize>), b: (f64, Option<usize>)| if b.0 < a.0 { b } else { a };
        origins.values(&both, (f64::INFINITY, None), nearer).into_iter().map(|(_, source)| source).collect()
    }

    /// The vertex closest to a point, as its face has it.
    pub(super) fn corner(&self, point: SurfacePoint) -> Vertex {
        if let SurfacePoint::Vertex(vertex) = point {
            return vertex;
        }
        let FacePoint { face, barycentric } = point.in_some_face(self.mesh);
        let largest = (0..3).max_by(|&a, &b| barycentric[a].total_cmp(&barycentric[b]));
        Vertex(self.mesh.faces()[face.index()][largest.unwrap_or(0)])
    }

    /// A path from a source on the file's faces.
    fn path(&self, path: Path, owners: &[usize]) -> SurfacePath {
        let point = |point: &SurfacePoint| self.on_file(point.in_some_face(self.mesh));
        let points = path.points.iter().rev().map(point).collect();
        SurfacePath { points, length: path.length, source: owners[path.source] }
    }
}
