//! Distances and paths over triangulated surfaces, told at the vertices and faces of the file.

use ndf_core::{DVec3, Hint, Progress};
use ndf_geodesic::{ExactOptions, GeodesicError, Geodesics, HeatSolver, Path, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::io::VertexScalars;
use ndf_mesh::repair::{Irreparable, Origins, double_cover};
use ndf_mesh::{FacePoint, ManifoldMesh, NotManifold, SurfacePoint, TriangleMesh, TriangleTree, Vertex};

use super::{Original, Triangles, Triangulated};
use crate::Note;
use crate::analysis::SNAP;

/// Places farther from the surface than this share of its diagonal are noted.
const NOTABLY_OFF: f64 = 1e-3;

/// Where distances are measured from, or a path leads to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// A vertex of the [mesh](Triangulated::mesh).
    Vertex(Vertex),
    /// The surface's point closest to a position.
    Near(DVec3),
    /// A point of a face of the mesh.
    Point(FacePoint),
}

/// How distances are measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DistanceMethod {
    /// Exact distances on the triangles.
    #[default]
    Exact,
    /// The heat method: smooth, about one per cent off on fine, even meshes.
    Heat,
}

/// What is measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DistanceOptions {
    /// How.
    pub method: DistanceMethod,
    /// The time step of the heat method, in squared mean edge lengths. If none is given 1, or the least power of four
    /// with which heat reaches every vertex.
    pub time_step: Option<f64>,
    /// Where shortest paths lead from the nearest source. They are exact with either method.
    pub paths_to: Vec<Place>,
}

/// The largest time step that is tried where none is given: heat reaches some 200,000 edges.
const MAX_TIME_STEP: f64 = 65536.0;

/// Distances over a surface, in its units.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Distances {
    /// Of every vertex of the [mesh](Triangulated::mesh) from the nearest source; +∞ where none reaches, and at vertices
    /// that no face uses.
    pub values: Vec<f64>,
    /// What the heat method took, where it was used.
    pub heat: Option<HeatReport>,
    /// The paths that were asked for, in order, or why there is none.
    pub paths: Vec<Result<SurfacePath, GeodesicError>>,
    /// What is doubtful: places far from the surface.
    pub notes: Vec<Note>,
}

/// A shortest path.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfacePath {
    /// The corners of the polyline, from the source on, as points of faces of the [mesh](Triangulated::mesh): straight in a face
    /// between each two.
    pub points: Vec<FacePoint>,
    /// Its length.
    pub length: f64,
    /// Which source it begins at, as an index of those given.
    pub source: usize,
}

/// How the heat method went.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct HeatReport {
    /// The time step, in squared mean edge lengths.
    pub time_step: f64,
    /// Vertices of components with a source that heat does not reach: their distances are too short.
    pub out_of_reach: usize,
}

/// Why there are no distances.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DistanceError {
    /// The triangles are no manifold.
    #[error(transparent)]
    NotManifold(NotManifold),
    /// There is no such vertex.
    #[error("there is no vertex {vertex} among the {vertices}")]
    NoVertex {
        /// Its number.
        vertex: Vertex,
        /// How many vertices there are.
        vertices: usize,
    },
    /// No face that is used has this vertex.
    #[error("vertex {vertex} is on no face that is used, so that nothing is measured from it")]
    Unused {
        /// Its number.
        vertex: Vertex,
    },
    /// There is no such face, or it is not used.
    #[error("there is no usable face {}", .0.face)]
    NoFace(FacePoint),
    /// No point of the surface is closest.
    #[error("the surface has no point closest to {0}")]
    NoPoint(DVec3),
    /// The distances failed.
    #[error(transparent)]
    Geodesic(#[from] GeodesicError),
}

impl Triangulated {
    /// Distances of all vertices from the nearest source. A surface that cannot be oriented is measured on its double
    /// cover. Exact distances pass vertices in which fans of faces meet; heat does not.
    ///
    /// # Errors
    /// If an edge has three faces, a source or target is not on the surface, or the observer asks to stop.
    pub fn distances(
        &self,
        sources: &[Place],
        options: &DistanceOptions,
        progress: &dyn Progress,
    ) -> Result<Distances, DistanceError> {
        let covered;
        let surface = match (&self.triangles, &self.original) {
            (Triangles::Manifold(mesh), original) => {
                Working { mesh, original: original.as_ref().map(|o| (&o.mesh, &o.origins)), sheets: 1 }
            }
            (Triangles::Soup { reason: Irreparable::NotManifold(reason), .. }, _) => {
                return Err(DistanceError::NotManifold(reason.clone()));
            }
            (Triangles::Soup { mesh, reason: Irreparable::OneSided }, original) => {
                let (mesh, options) = match original {
                    Some(Original { mesh, options, .. }) => (mesh, *options),
                    None => (mesh, Default::default()),
                };
                covered = double_cover(mesh, &options).map_err(DistanceError::NotManifold)?;
                Working { mesh: &covered.0, original: Some((mesh, &covered.1)), sheets: 2 }
            }
        };
        let mut notes = Vec::new();
        let tree = TriangleTree::new(surface.mesh);
        let mut points = Vec::new();
        let mut owners = Vec::new();
        for (number, &place) in sources.iter().enumerate() {
            let found = surface.points(place, &tree, &mut notes)?;
            owners.extend(found.iter().map(|_| number));
            points.extend(found);
        }
        let mut targets = Vec::new();
        for &place in &options.paths_to {
            // Of several places that are one, any will do.
            targets.extend(surface.points(place, &tree, &mut notes)?.first().copied());
        }
        let (mesh, joined) = (IntrinsicMesh::from_mesh(surface.mesh), surface.joined());
        let mesh = mesh.scaled(self.applied().distances);
        let exact = ExactOptions { keep_windows: !targets.is_empty(), joined, ..ExactOptions::default() };
        let paths_to = |geodesics: &Geodesics<'_>, targets: &[SurfacePoint]| {
            let path = |path: Path| surface.path(path, &owners);
            targets.iter().map(|&target| geodesics.path_to(target).map(path)).collect()
        };
        if options.method == DistanceMethod::Exact {
            let geodesics = exact_distances(&mesh, &points, &exact, progress)?;
            let paths = paths_to(&geodesics, &targets);
            let values = surface.values(geodesics.distances());
            return Ok(Distances { values, heat: None, paths, notes });
        }
        let mut time_step = options.time_step.unwrap_or(1.0);
        let found = loop {
            let found = HeatSolver::with_time(&mesh, time_step)?.distances(&points)?;
            if found.out_of_reach == 0 || options.time_step.is_some() || time_step >= MAX_TIME_STEP {
                break found;
            }
            progress.check().map_err(GeodesicError::from)?;
            time_step *= 4.0;
        };
        let heat = Some(HeatReport { time_step, out_of_reach: found.out_of_reach });
        // The heat method has no paths of its own; the exact one need go no farther than the targets.
        let paths = if targets.is_empty() {
            Vec::new()
        } else {
            let exact = ExactOptions { targets: targets.clone(), ..exact };
            paths_to(&exact_distances(&mesh, &points, &exact, progress)?, &targets)
        };
        Ok(Distances { values: surface.values(&found.values), heat, paths, notes })
    }
}

/// What distances are computed on.
struct Working<'a> {
    mesh: &'a ManifoldMesh,
    /// The mesh of the file and where the working mesh comes from, where they are not the same.
    original: Option<(&'a TriangleMesh, &'a Origins)>,
    /// How many points of the working mesh lie over one of the surface.
    sheets: usize,
}

impl Working<'_> {
    /// The points of the working mesh that a place means.
    fn points(
        &self,
        place: Place,
        tree: &TriangleTree,
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
    fn on_file(&self, point: FacePoint) -> FacePoint {
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

    /// A path from a source on the file's faces.
    fn path(&self, path: Path, owners: &[usize]) -> SurfacePath {
        let point = |point: &SurfacePoint| self.on_file(point.in_some_face(self.mesh));
        let points = path.points.iter().rev().map(point).collect();
        SurfacePath { points, length: path.length, source: owners[path.source] }
    }
}

impl Distances {
    /// The distances as the scalar `distance`.
    pub fn scalars(&self) -> VertexScalars {
        let values = self.values.iter().map(|&d| d as f32).collect();
        VertexScalars { name: "distance".to_owned(), values }
    }
}
