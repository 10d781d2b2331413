//! Geodesics and spectra of a mesh, or of the mesh of a model, in their units.
//!
//! What is computed on is a manifold made of the triangles: borders that lie on each other are joined, faces turned, what is
//! unusable left out. What is found is told at the vertices of the file, which keep their numbers.

mod curves;
mod distances;
mod fields;
mod heat;
mod solver;

use std::collections::HashMap;
use std::path::Path;

use ndf_core::{DVec3, Progress};
use ndf_intrinsic::{ExtractionError, IntrinsicMesh};
use ndf_mesh::io::{MeshFile, VertexScalars};
use ndf_mesh::repair::{self, Irreparable, Origins, Parts, RepairNote, RepairOptions, Repaired, Usable};
use ndf_mesh::{ManifoldMesh, TriangleMesh, Vertex};
use ndf_model::{LengthFactors, Model};
use ndf_spectral::{LaplaceBeltrami, ModeOptions, Modes, OperatorOptions, SpectralError};

use crate::analysis::mode_scalars;
use crate::files::{NoMesh, NoModel, begins_as_model, read_mesh, read_model};
use crate::left_out::{LeftOut, check_left_out};
use crate::range::{OutOfRange, check_range};
use crate::{EdgeLength, ModelExt, Note};

pub use curves::{SignedDistance, SignedDistanceOptions, SurfaceCentre};
pub use distances::{
    DistanceError, DistanceMethod, DistanceOptions, Distances, HeatReport, Place, StraightPath, SurfacePath,
};
pub use fields::{Alignment, Directions, LogMap, Singularity, SurfaceFieldError, SurfaceFields, Transported};
pub use heat::{Heat, HeatOptions, InitialHeat};
pub use solver::DistanceSolver;

/// Triangles that can be computed on.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Triangulated {
    /// The triangles.
    pub triangles: Triangles,
    /// What was repaired.
    pub notes: Vec<Note>,
    /// The share of the area of the file that is left out, from 0 to 1.
    pub area_left_out: f64,
    /// By what lengths are multiplied for distances and modes: those of the metric that a model carries. `None` for
    /// meshes, and for models without one; set it so to measure lengths as they are.
    pub factors: Option<LengthFactors>,
    /// The edge length that the mesh of a model was made with, in its units. `None` for meshes.
    pub edge_length: Option<f64>,
    /// The mesh that was repaired, where it is not the triangles.
    original: Option<Original>,
}

/// A mesh as it was before it was repaired.
#[derive(Clone, Debug)]
struct Original {
    mesh: TriangleMesh,
    /// Where the triangles come from.
    origins: Origins,
    options: RepairOptions,
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
        /// Why they are no oriented manifold.
        reason: Irreparable,
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
    /// The mesh of the model could not be extracted.
    #[error("{name}: {source}")]
    Extraction {
        /// The file.
        name: String,
        /// Why.
        source: ExtractionError,
    },
    /// Its lengths cannot be computed.
    #[error("{name}: {source}")]
    Range {
        /// The file.
        name: String,
        /// How large it is.
        source: OutOfRange,
    },
    /// Too much of the mesh would be left out.
    #[error("{name}: {source}")]
    LeftOut {
        /// The file.
        name: String,
        /// How much.
        source: LeftOut,
    },
}

impl Triangulated {
    /// The triangulation in a file: a mesh, which is repaired where it is no manifold, or a model, of which a mesh is made with
    /// this edge length or the [default](EdgeLength::default). An edge length for a mesh is left out with a note.
    ///
    /// # Errors
    /// If the file cannot be read, has no faces, more than a twentieth of its area cannot be used and all of it is wanted, or the
    /// observer asks to stop.
    pub fn open(
        path: impl AsRef<Path>,
        edge_length: Option<EdgeLength>,
        options: &RepairOptions,
        progress: &dyn Progress,
    ) -> Result<Self, NoTriangulation> {
        let path = path.as_ref();
        let name = || path.display().to_string();
        if begins_as_model(path) {
            let found = Self::from_model(&read_model(path)?, edge_length.unwrap_or_default(), progress);
            return found.map_err(|source| NoTriangulation::Extraction { name: name(), source });
        }
        let mut found = Self::from_file(read_mesh(path)?, &name(), options)?;
        found.notes.extend(edge_length.map(|_| Note::EdgeLengthUnused));
        Ok(found)
    }

    /// The mesh of a file of this name, repaired as [`from_mesh`](Self::from_mesh) has it.
    ///
    /// # Errors
    /// If its lengths cannot be computed, or more than a twentieth of its area cannot be used and all of it is wanted.
    pub fn from_file(file: MeshFile, name: &str, options: &RepairOptions) -> Result<Self, NoTriangulation> {
        let name = || name.to_owned();
        let corners = |f: &[u32; 3]| f.map(|v| file.mesh.positions()[v as usize]);
        let used: Vec<DVec3> = file.mesh.faces().iter().flat_map(corners).filter(|p| p.is_finite()).collect();
        check_range(&used).map_err(|source| NoTriangulation::Range { name: name(), source })?;
        let mut found = Self::from_mesh(file.mesh, options)
            .map_err(|source| NoTriangulation::LeftOut { name: name(), source })?;
        found.notes.splice(0..0, file.notes.into_iter().map(Note::from));
        Ok(found)
    }

    /// A mesh, repaired where it is no oriented manifold or has borders that lie on each other; where that cannot be, its
    /// usable triangles.
    ///
    /// # Errors
    /// If more than a twentieth of its area cannot be used, unless the largest component is all that is wanted.
    pub fn from_mesh(mesh: TriangleMesh, options: &RepairOptions) -> Result<Self, LeftOut> {
        // Most meshes need nothing of it.
        if options.parts == Parts::All
            && let Ok(mesh) = ManifoldMesh::try_from(mesh.clone())
            && (options.keep_seams || mesh.topology().boundary_edge_count() == 0)
        {
            return Ok(mesh.into());
        }
        let (triangles, origins, notes, area_left_out) = match repair::repaired(&mesh, options) {
            Ok(Repaired { mesh, origins, notes, area_left_out }) => {
                // What is computed does not depend on sides, and what is written has the faces of the file.
                let is_of_sides = |note: &RepairNote| {
                    matches!(note, RepairNote::AllFacesTurned | RepairNote::FacesTurned { .. })
                };
                let notes = notes.into_iter().filter(|note| !is_of_sides(note)).map(Note::from).collect();
                (Triangles::Manifold(mesh), origins, notes, area_left_out)
            }
            Err(reason) => {
                let Usable { mesh, origins, area_left_out } = repair::usable_triangles(&mesh, options);
                (Triangles::Soup { mesh, reason }, origins, Vec::new(), area_left_out)
            }
        };
        check_left_out(area_left_out, options.parts)?;
        let is_same = *triangles.mesh() == mesh;
        let original = (!is_same).then_some(Original { mesh, origins, options: *options });
        Ok(Self { triangles, notes, area_left_out, factors: None, edge_length: None, original })
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
        Ok(Self::from_extracted(model, mesh, edge_length))
    }

    /// A mesh that was extracted from a model with this edge length, with the factors of the model's metric. O(n).
    pub fn from_extracted(model: &Model, mesh: ManifoldMesh, edge_length: EdgeLength) -> Self {
        let area = mesh.area() * model.similarity.scale().powi(2);
        let factors = model.metric.map(|metric| metric.factors(area));
        Self { factors, edge_length: Some(edge_length.world(model)), ..mesh.into() }
    }

    /// The mesh as it was before it was repaired. Distances and scalars have a value for each of its vertices.
    pub fn mesh(&self) -> &TriangleMesh {
        self.original.as_ref().map_or(self.triangles.mesh(), |original| &original.mesh)
    }

    /// The manifold that is computed on.
    ///
    /// # Errors
    /// If the mesh could not be repaired to be one.
    pub fn manifold(&self) -> Result<&ManifoldMesh, &Irreparable> {
        match &self.triangles {
            Triangles::Manifold(mesh) => Ok(mesh),
            Triangles::Soup { reason, .. } => Err(reason),
        }
    }

    /// Whether the vertices of the [triangles](Self::triangles) are those of the [mesh](Self::mesh): none was joined, divided or left out.
    pub fn has_vertices_of_mesh(&self) -> bool {
        self.original.is_none()
    }

    /// The vertices of the [mesh](Self::mesh) that no face uses: they have no distances and no values.
    pub fn unused_vertices(&self) -> Vec<Vertex> {
        self.original.as_ref().map_or_else(Vec::new, |original| original.origins.unused().collect())
    }

    /// The factors that are applied.
    fn applied(&self) -> LengthFactors {
        self.factors.unwrap_or(LengthFactors::ONE)
    }

    /// The eigenmodes with the smallest eigenvalues, in inverse squared units of length, at the vertices of the
    /// [triangles](Self::triangles). Where these are no oriented manifold, those of their tufted cover.
    ///
    /// # Errors
    /// If a vertex has no area, an option is out of range, the modes do not converge, or the observer asks to stop.
    pub fn modes(&self, options: &ModeOptions, progress: &dyn Progress) -> Result<Modes, SpectralError> {
        self.operator(options.operator)?.modes(options, progress)
    }

    /// The same among functions that are zero on the boundary (Dirichlet): at the vertices of edges with one face.
    ///
    /// # Errors
    /// If all vertices are on the boundary, and otherwise as [`modes`](Self::modes).
    pub fn modes_with_held_boundary(
        &self,
        options: &ModeOptions,
        progress: &dyn Progress,
    ) -> Result<Modes, SpectralError> {
        self.operator(options.operator)?.modes_holding(&self.is_on_boundary(), options, progress)
    }

    /// The Laplace–Beltrami operator at the vertices of the [triangles](Self::triangles). Where these are no oriented manifold, that of
    /// their tufted cover. O(n log n).
    ///
    /// # Errors
    /// If there is no surface, or a vertex has no area.
    pub fn operator(&self, options: OperatorOptions) -> Result<LaplaceBeltrami, SpectralError> {
        if self.triangles.mesh().face_count() == 0 {
            return Err(SpectralError::NoSurface);
        }
        match &self.triangles {
            Triangles::Manifold(mesh) => {
                let mesh = IntrinsicMesh::from_mesh(mesh).scaled(self.applied().operators);
                LaplaceBeltrami::new(&mesh, options)
            }
            Triangles::Soup { mesh, .. } => LaplaceBeltrami::from_triangle_mesh(mesh, options),
        }
    }

    /// Which vertices of the [triangles](Self::triangles) have an edge with one face. O(n).
    fn is_on_boundary(&self) -> Vec<bool> {
        let mesh = self.triangles.mesh();
        let mut faces_of_edge: HashMap<[u32; 2], u32> = HashMap::new();
        for [a, b, c] in mesh.faces().iter().copied() {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                *faces_of_edge.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        let mut is_on_boundary = vec![false; mesh.vertex_count()];
        for (edge, _) in faces_of_edge.iter().filter(|(_, faces)| **faces == 1) {
            edge.iter().for_each(|&v| is_on_boundary[v as usize] = true);
        }
        is_on_boundary
    }

    /// Values at the vertices of the [mesh](Self::mesh) from those at the vertices of the [triangles](Self::triangles): NaN at
    /// those that no face uses, and the value of one of its fans where several meet in a vertex. O(n).
    pub fn at_vertices(&self, values: &[f64]) -> Vec<f64> {
        match &self.original {
            Some(Original { origins, .. }) => origins.values(values, f64::NAN, |first, _| first),
            None => values.to_vec(),
        }
    }

    /// Modes as scalars `mode_00`, `mode_01`, … at the vertices of the [mesh](Self::mesh): NaN at those that no face uses, and
    /// the value of one of its fans where several meet in a vertex.
    pub fn mode_scalars(&self, modes: &Modes) -> Vec<VertexScalars> {
        let mut scalars = mode_scalars(modes);
        if let Some(Original { origins, .. }) = &self.original {
            for scalar in &mut scalars {
                scalar.values = origins.values(&scalar.values, f32::NAN, |first, _| first);
            }
        }
        scalars
    }
}

impl Triangles {
    /// The triangles alone.
    pub fn mesh(&self) -> &TriangleMesh {
        match self {
            Self::Manifold(mesh) => mesh,
            Self::Soup { mesh, .. } => mesh,
        }
    }
}

impl From<ManifoldMesh> for Triangulated {
    fn from(mesh: ManifoldMesh) -> Self {
        let triangles = Triangles::Manifold(mesh);
        Self {
            triangles,
            notes: Vec::new(),
            area_left_out: 0.0,
            factors: None,
            edge_length: None,
            original: None,
        }
    }
}

#[cfg(test)]
mod tests;
