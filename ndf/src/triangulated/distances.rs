//! Distances and paths over triangulated surfaces, told at the vertices and faces of the file.

use ndf_core::DVec3;
use ndf_geodesic::GeodesicError;
use ndf_mesh::io::VertexScalars;
use ndf_mesh::{FacePoint, NotManifold, Vertex};

use crate::Note;

/// Where distances are measured from, or a path leads to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// A vertex of the [mesh](super::Triangulated::mesh).
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
    /// Look for the nearest source of every vertex, which only exact distances tell.
    pub nearest: bool,
    /// How far distances go, if not everywhere: what is farther is infinite.
    pub max_distance: Option<f64>,
}

/// Distances over a surface, in its units.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Distances {
    /// Of every vertex of the [mesh](super::Triangulated::mesh) from the nearest source; +∞ where none reaches, and at
    /// vertices that no face uses.
    pub values: Vec<f64>,
    /// The nearest source of every vertex, as an index of those given, if asked for: the regions of a Voronoi diagram. `None` where
    /// the distance is infinite.
    pub nearest: Vec<Option<usize>>,
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
    /// The corners of the polyline, from the source on, as points of faces of the [mesh](super::Triangulated::mesh): straight
    /// in a face between each two.
    pub points: Vec<FacePoint>,
    /// Its length.
    pub length: f64,
    /// Which source it begins at, as an index of those given.
    pub source: usize,
}

/// A path that is locally shortest: straight wherever it may be.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct StraightPath {
    /// The corners of the polyline, as points of faces of the [mesh](super::Triangulated::mesh): straight in a face between each
    /// two. A loop ends where it begins.
    pub points: Vec<FacePoint>,
    /// Its length.
    pub length: f64,
    /// Whether it is straight everywhere; where a path touches itself it may be held back.
    pub is_geodesic: bool,
    /// Edges that were flipped to find it.
    pub flips: usize,
    /// What is doubtful: places far from the surface.
    pub notes: Vec<Note>,
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

impl Distances {
    /// The distances as the scalar `distance`.
    pub fn scalars(&self) -> VertexScalars {
        let values = self.values.iter().map(|&d| d as f32).collect();
        VertexScalars { name: "distance".to_owned(), values }
    }

    /// The nearest sources as the scalar `nearest`: the index of the source, -1 where none is near.
    pub fn nearest_scalars(&self) -> VertexScalars {
        let values = self.nearest.iter().map(|source| source.map_or(-1.0, |source| source as f32)).collect();
        VertexScalars { name: "nearest".to_owned(), values }
    }
}
