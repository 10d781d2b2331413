//! Geodesics and spectra of a mesh, or of the mesh of a model, in their units.

use std::path::Path;

use ndf_core::{DVec3, Progress};
use ndf_geodesic::{ExactOptions, GeodesicError, HeatSolver, exact_distances};
use ndf_intrinsic::{ExtractionError, IntrinsicMesh};
use ndf_mesh::io::VertexScalars;
use ndf_mesh::{ManifoldMesh, NotManifold, SurfacePoint, TriangleMesh, TriangleTree, Vertex, repair};
use ndf_model::{LengthFactors, Model};
use ndf_spectral::{LaplaceBeltrami, ModeOptions, Modes, SpectralError};

use crate::analysis::closest_point;
use crate::files::{NoMesh, NoModel, begins_as_model, read_mesh, read_model};
use crate::{EdgeLength, ModelExt, Note};

/// Triangles that can be computed on.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Triangulated {
    /// The triangles.
    pub triangles: Triangles,
    /// What was repaired.
    pub notes: Vec<Note>,
    /// By what lengths are multiplied for distances and modes: those of the metric that a model carries. `None` for
    /// meshes, and for models without one; set it so to measure lengths as they are.
    pub factors: Option<LengthFactors>,
}

/// Triangles, repaired where that was needed.
#[derive(Clone, Debug)]
pub enum Triangles {
    /// An oriented manifold.
    Manifold(ManifoldMesh),
    /// Triangles of any kind, all of them usable.
    Soup {
        /// The triangles, vertices in one place merged.
        mesh: TriangleMesh,
        /// Why they are no manifold.
        reason: NotManifold,
    },
}

/// Why a file gives no triangulation.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NoTriangulation {
    /// It is no usable mesh.
    #[error(transparent)]
    Mesh(#[from] NoMesh),
    /// It is no usable model.
    #[error(transparent)]
    Model(#[from] NoModel),
    /// It is a model, and no edge length was given.
    #[error("{name} is a model, of which meshes of any size can be made")]
    NoEdgeLength {
        /// The file.
        name: String,
    },
    /// The mesh of the model could not be extracted.
    #[error("{name}: {source}")]
    Extraction {
        /// The file.
        name: String,
        /// Why.
        source: ExtractionError,
    },
}

/// Where distances are measured from, or a path leads to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// A vertex.
    Vertex(Vertex),
    /// The surface's point closest to a position.
    Near(DVec3),
    /// A point of the mesh.
    Point(SurfacePoint),
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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DistanceOptions {
    /// How.
    pub method: DistanceMethod,
    /// The time step of the heat method, in squared mean edge lengths. If none is given 1, or the least power of four
    /// with which heat reaches every vertex.
    pub time_step: Option<f64>,
    /// Where a shortest path leads from the nearest source, if one is wanted. It is exact with either method.
    pub path_to: Option<Place>,
}

/// The largest time step that is tried where none is given: heat reaches some 200,000 edges.
const MAX_TIME_STEP: f64 = 65536.0;

/// Distances over a surface, in its units.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Distances {
    /// Of every vertex from the nearest source; +∞ where none reaches.
    pub values: Vec<f64>,
    /// What the heat method took, where it was used.
    pub heat: Option<HeatReport>,
    /// The path that was asked for, or why there is none.
    pub path: Option<Result<ndf_geodesic::Path, GeodesicError>>,
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
    /// No point of the surface is closest.
    #[error("the surface has no point closest to {0}")]
    NoPoint(DVec3),
    /// The distances failed.
    #[error(transparent)]
    Geodesic(#[from] GeodesicError),
}

impl Triangulated {
    /// The triangulation in a file: a mesh, which is repaired where it is no manifold, or a model together with an edge
    /// length. An edge length for a mesh is left out with a note.
    ///
    /// # Errors
    /// If the file cannot be read, has no faces, is a model without an edge length, or the observer asks to stop.
    pub fn open(
        path: impl AsRef<Path>,
        edge_length: Option<EdgeLength>,
        progress: &dyn Progress,
    ) -> Result<Self, NoTriangulation> {
        let path = path.as_ref();
        let name = || path.display().to_string();
        if begins_as_model(path) {
            let edge_length = edge_length.ok_or_else(|| NoTriangulation::NoEdgeLength { name: name() })?;
            let found = Self::from_model(&read_model(path)?, edge_length, progress);
            return found.map_err(|source| NoTriangulation::Extraction { name: name(), source });
        }
        let file = read_mesh(path)?;
        let mut notes: Vec<Note> = file.notes.into_iter().map(Note::from).collect();
        notes.extend(edge_length.map(|_| Note::EdgeLengthUnused));
        let mut found = Self::from_mesh(file.mesh);
        found.notes.splice(0..0, notes);
        Ok(found)
    }

    /// A mesh with its vertex order where it is a manifold, otherwise repaired; where that cannot be, its usable
    /// triangles.
    pub fn from_mesh(mesh: TriangleMesh) -> Self {
        if let Ok(mesh) = ManifoldMesh::try_from(mesh.clone()) {
            return mesh.into();
        }
        match repair::repaired(&mesh) {
            Ok(repaired) => {
                let notes = repaired.notes.into_iter().map(Note::from).collect();
                Self { triangles: Triangles::Manifold(repaired.mesh), notes, factors: None }
            }
            Err(reason) => {
                let usable = repair::without_unusable_faces(&repair::welded(&mesh, 0.0));
                let mesh = repair::without_unreferenced_vertices(&usable).0;
                Self { triangles: Triangles::Soup { mesh, reason }, notes: Vec::new(), factors: None }
            }
        }
    }

    /// The mesh of a model, with the factors of its metric.
    ///
    /// # Errors
    /// See [`ModelExt::extract_with`].
    pub fn from_model(
        model: &Model,
        edge_length: EdgeLength,
        progress: &dyn Progress,
    ) -> Result<Self, ExtractionError> {
        let mesh = model.extract_with(edge_length, progress)?.mesh;
        let area = mesh.area() * model.similarity.scale().powi(2);
        let factors = model.metric.map(|metric| metric.factors(area));
        Ok(Self { factors, ..mesh.into() })
    }

    /// The triangles.
    pub fn mesh(&self) -> &TriangleMesh {
        match &self.triangles {
            Triangles::Manifold(mesh) => mesh,
            Triangles::Soup { mesh, .. } => mesh,
        }
    }

    /// The manifold.
    ///
    /// # Errors
    /// If it could not be repaired to be one.
    pub fn manifold(&self) -> Result<&ManifoldMesh, &NotManifold> {
        match &self.triangles {
            Triangles::Manifold(mesh) => Ok(mesh),
            Triangles::Soup { reason, .. } => Err(reason),
        }
    }

    /// The factors that are applied.
    fn applied(&self) -> LengthFactors {
        self.factors.unwrap_or(LengthFactors::ONE)
    }

    /// Distances of all vertices from the nearest source.
    ///
    /// # Errors
    /// If the triangles are no manifold, a source or target is not on them, or the observer asks to stop.
    pub fn distances(
        &self,
        sources: &[Place],
        options: &DistanceOptions,
        progress: &dyn Progress,
    ) -> Result<Distances, DistanceError> {
        let mesh = self.manifold().map_err(|reason| DistanceError::NotManifold(reason.clone()))?;
        let tree = TriangleTree::new(mesh);
        let point = |place: &Place| found(mesh, &tree, *place);
        let sources: Vec<SurfacePoint> = sources.iter().map(point).collect::<Result<_, _>>()?;
        let target = options.path_to.as_ref().map(point).transpose()?;
        let mesh = IntrinsicMesh::from_mesh(mesh).scaled(self.applied().distances);
        let exact = ExactOptions { keep_windows: target.is_some(), ..ExactOptions::default() };
        if options.method == DistanceMethod::Exact {
            let geodesics = exact_distances(&mesh, &sources, &exact, progress)?;
            let path = target.map(|target| geodesics.path_to(target));
            return Ok(Distances { values: geodesics.distances().to_vec(), heat: None, path });
        }
        let mut time_step = options.time_step.unwrap_or(1.0);
        let found = loop {
            let found = HeatSolver::with_time(&mesh, time_step)?.distances(&sources)?;
            if found.out_of_reach == 0 || options.time_step.is_some() || time_step >= MAX_TIME_STEP {
                break found;
            }
            progress.check().map_err(GeodesicError::from)?;
            time_step *= 4.0;
        };
        let heat = Some(HeatReport { time_step, out_of_reach: found.out_of_reach });
        // The heat method has no paths of its own; the exact one need go no farther than the target.
        let path = match target {
            Some(target) => {
                let exact = ExactOptions { targets: vec![target], ..exact };
                Some(exact_distances(&mesh, &sources, &exact, progress)?.path_to(target))
            }
            None => None,
        };
        Ok(Distances { values: found.values, heat, path })
    }

    /// The eigenmodes with the smallest eigenvalues, in inverse squared units of length. Where the triangles are no
    /// manifold, those of their tufted cover.
    ///
    /// # Errors
    /// If a vertex has no area, an option is out of range, the modes do not converge, or the observer asks to stop.
    pub fn modes(&self, options: &ModeOptions, progress: &dyn Progress) -> Result<Modes, SpectralError> {
        let operator = match &self.triangles {
            Triangles::Manifold(mesh) => {
                let mesh = IntrinsicMesh::from_mesh(mesh).scaled(self.applied().operators);
                LaplaceBeltrami::new(&mesh, options.operator)
            }
            Triangles::Soup { mesh, .. } => LaplaceBeltrami::from_triangle_mesh(mesh, options.operator),
        };
        operator?.modes(options, progress)
    }
}

impl From<ManifoldMesh> for Triangulated {
    fn from(mesh: ManifoldMesh) -> Self {
        Self { triangles: Triangles::Manifold(mesh), notes: Vec::new(), factors: None }
    }
}

impl Distances {
    /// The distances as the scalar `distance`.
    pub fn scalars(&self) -> VertexScalars {
        let values = self.values.iter().map(|&d| d as f32).collect();
        VertexScalars { name: "distance".to_owned(), values }
    }
}

/// The point of a mesh that is meant.
fn found(mesh: &ManifoldMesh, tree: &TriangleTree, place: Place) -> Result<SurfacePoint, DistanceError> {
    let vertices = mesh.vertex_count();
    match place {
        Place::Vertex(vertex) if vertex.index() >= vertices => {
            Err(DistanceError::NoVertex { vertex, vertices })
        }
        Place::Vertex(vertex) => Ok(SurfacePoint::Vertex(vertex)),
        Place::Near(position) => closest_point(mesh, tree, position).ok_or(DistanceError::NoPoint(position)),
        Place::Point(point) => Ok(point),
    }
}
