//! A model or a mesh, and what is computed on it.

use std::borrow::Cow;
use std::path::Path as FilePath;

use ndf::figures::ExtractionFigures;
use ndf::{
    DistanceOptions, DistanceSolver, EdgeLength, ExtractionError, MAX_FACES, Model, ModelExt, NoProgress,
    Place, RepairOptions, TriangleMesh, Triangulated, Vertex, stored_scalars,
};
use ndf_mesh::io::gltf::{GlbOptions, to_glb};
use ndf_mesh::io::{Positions, VertexScalars, parse_mesh, to_ply};
use ndf_spectral::{ModeOptions, Modes};
use serde_json::Value;

use crate::description::{Description, Range, lengths};
use crate::error::SurfaceError;

/// More values of modes at vertices than this are refused: with what it takes to find them, they would fill the memory of
/// WebAssembly.
const MAX_MODE_VALUES: usize = 1 << 26;

/// A model or a mesh that was opened, and the mesh that is computed on: that of the file, or the one that was last extracted.
pub struct Surface {
    name: String,
    bytes: usize,
    model: Option<Model>,
    mesh: Shown,
}

/// The mesh that is computed on.
struct Shown {
    triangulated: Triangulated,
    /// Its scalars.
    scalars: Vec<VertexScalars>,
    /// What an extraction promised of it.
    report: Option<ndf::ExtractionReport>,
    /// About the shortest edges that can be had, in the units of the file.
    min_edge_length: Option<f64>,
    /// Made for the first distances.
    solver: Option<DistanceSolver<'static>>,
    /// The modes that were found last.
    modes: Option<Modes>,
}

/// A shortest path.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Its corners, x, y and z of each.
    pub points: Vec<f64>,
    /// Its length.
    pub length: f64,
}

impl Shown {
    fn new(triangulated: Triangulated, scalars: Vec<VertexScalars>) -> Self {
        Self { triangulated, scalars, report: None, min_edge_length: None, solver: None, modes: None }
    }

    /// A mesh of a model, with the model's scalars.
    fn of(model: &Model, length: EdgeLength) -> Result<Self, ExtractionError> {
        let found = model.extract_with(length, &NoProgress)?;
        let scalars = stored_scalars(model, &found);
        let min_edge_length = Some(found.min_edge_length(MAX_FACES));
        let triangulated = Triangulated::from_extracted(model, found.mesh, length);
        Ok(Self { report: Some(found.report), min_edge_length, ..Self::new(triangulated, scalars) })
    }
}

impl Surface {
    /// Opens a model, of which a mesh is extracted with the [default](EdgeLength::default) edge length, or a mesh: OBJ, PLY,
    /// STL, OFF or glTF. The content decides; the name stands in messages.
    ///
    /// # Errors
    /// If it is damaged, or neither.
    pub fn open(bytes: &[u8], name: &str) -> Result<Self, SurfaceError> {
        Self::open_with(bytes, name, EdgeLength::default())
    }

    /// As [`open`](Self::open), with another edge length of a model's first mesh.
    ///
    /// # Errors
    /// As [`open`](Self::open), and as [`extract`](Self::extract).
    pub fn open_with(bytes: &[u8], name: &str, first: EdgeLength) -> Result<Self, SurfaceError> {
        let (name, count) = (name.to_owned(), bytes.len());
        if Model::is_model(bytes) {
            let model = Model::from_bytes(bytes)
                .map_err(|source| SurfaceError::Model { name: name.clone(), source })?;
            let mesh = Shown::of(&model, first)?;
            return Ok(Self { name, bytes: count, model: Some(model), mesh });
        }
        let mut file = parse_mesh(bytes, FilePath::new(&name))?;
        if file.mesh.face_count() == 0 {
            return Err(SurfaceError::NoFaces { name });
        }
        let scalars = std::mem::take(&mut file.scalars);
        let triangulated = Triangulated::from_file(file, &name, &RepairOptions::default())?;
        Ok(Self { name, bytes: count, model: None, mesh: Shown::new(triangulated, scalars) })
    }

    /// What was opened. O(n).
    pub fn describe(&self) -> Description {
        let lengths = self.model.as_ref().map(lengths);
        let Shown { triangulated, scalars, min_edge_length, .. } = &self.mesh;
        Description {
            name: self.name.clone(),
            kind: if self.model.is_some() { "model" } else { "mesh" },
            bytes: self.bytes,
            default_edge_length: lengths.map(|[default, ..]| default),
            base_edge_length: lengths.map(|[_, base, _]| base),
            min_edge_length: *min_edge_length,
            scale: lengths.map(|[.., scale]| scale),
            distance_factor: triangulated.factors.map(|factors| factors.distances),
            scalars: scalars.iter().map(Range::of).filter(|range| range.min <= range.max).collect(),
            notes: triangulated.notes.iter().map(ToString::to_string).collect(),
        }
    }

    /// Extracts another mesh of the model. O(n log n) for n faces.
    ///
    /// # Errors
    /// If this is a mesh, or the length is not positive or asks for too many faces; then the mesh stays as it was.
    pub fn extract(&mut self, length: EdgeLength) -> Result<(), SurfaceError> {
        let no_model = || SurfaceError::NoModel { name: self.name.clone() };
        let model = self.model.as_ref().ok_or_else(no_model)?;
        self.mesh = Shown::of(model, length).map_err(|error| match (error, self.mesh.min_edge_length) {
            (ExtractionError::TooManyFaces(max_faces), Some(shortest)) => {
                let in_box = matches!(length, EdgeLength::Relative(_));
                let unit = if in_box { model.similarity.length_to_world(1.0) } else { 1.0 };
                SurfaceError::TooFine { max_faces, shortest: shortest / unit }
            }
            (error, _) => error.into(),
        })?;
        Ok(())
    }

    /// The mesh that is computed on, in the units of the file.
    pub fn mesh(&self) -> &TriangleMesh {
        self.mesh.triangulated.mesh()
    }

    /// The figures of the mesh, as `ndf extract --json` has them, seconds apart; of a mesh that is no manifold only how many
    /// vertices and faces there are. O(n log n).
    pub fn report(&self) -> Value {
        let Shown { triangulated, report, .. } = &self.mesh;
        let mesh = self.mesh();
        let mut figures = match triangulated.manifold() {
            Ok(manifold) => {
                let figures = ExtractionFigures::of(manifold, report.as_ref(), &NoProgress);
                let figures = figures.expect("nothing asks to stop");
                serde_json::to_value(figures).expect("figures are numbers")
            }
            Err(_) => serde_json::json!({"vertices": mesh.vertex_count(), "faces": mesh.face_count()}),
        };
        if let Some(length) = triangulated.edge_length {
            figures["target_edge_length"] = length.into();
        }
        figures
    }

    /// Exact distances of all vertices from one, as `ndf geodesic` has them: +∞ where it does not reach.
    ///
    /// # Errors
    /// If there is no such vertex, or the mesh is no manifold.
    pub fn distances(&mut self, vertex: u32) -> Result<Vec<f32>, SurfaceError> {
        let source = Place::Vertex(Vertex(vertex));
        let found = self.solver()?.distances(&[source], &DistanceOptions::default(), &NoProgress)?;
        Ok(found.scalars().values)
    }

    /// The shortest path between two vertices.
    ///
    /// # Errors
    /// If there is no such vertex, or no path.
    pub fn path(&mut self, from: u32, to: u32) -> Result<Path, SurfaceError> {
        let [from, to] = [from, to].map(|vertex| Place::Vertex(Vertex(vertex)));
        let path = self.solver()?.path(from, to, &NoProgress)?;
        let mesh = self.mesh();
        let points = path.points.iter().flat_map(|point| point.position(mesh).to_array()).collect();
        Ok(Path { points, length: path.length })
    }

    /// The solver of the mesh, which keeps what distances share.
    fn solver(&mut self) -> Result<&DistanceSolver<'static>, SurfaceError> {
        let Shown { triangulated, solver, .. } = &mut self.mesh;
        match solver {
            Some(solver) => Ok(solver),
            none => Ok(none.insert(DistanceSolver::new(Cow::Owned(triangulated.clone()))?)),
        }
    }

    /// The eigenvalues of the first `count` modes of the Laplacian, and the modes at the vertices, one after the other, as
    /// `ndf spectrum` has them.
    ///
    /// # Errors
    /// If there are not as many vertices, memory does not hold the modes, or they do not converge.
    pub fn modes(&mut self, count: usize) -> Result<(Vec<f64>, Vec<f32>), SurfaceError> {
        let Shown { triangulated, modes, .. } = &mut self.mesh;
        let vertices = triangulated.mesh().vertex_count();
        let most = MAX_MODE_VALUES / vertices.max(1);
        if count <= vertices && count > most {
            return Err(SurfaceError::TooManyModes { asked: count, vertices, most });
        }
        let found = match modes.take() {
            Some(found) if found.len() == count => found,
            _ => triangulated.modes(&ModeOptions { count, ..ModeOptions::default() }, &NoProgress)?,
        };
        let found = modes.insert(found);
        let functions = triangulated.mode_scalars(found).into_iter().flat_map(|mode| mode.values).collect();
        Ok((found.eigenvalues.clone(), functions))
    }

    /// The values of a stored scalar at the vertices.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn scalar(&self, name: &str) -> Result<&[f32], SurfaceError> {
        let scalars = &self.mesh.scalars;
        let found = scalars.iter().find(|scalar| scalar.name == name);
        found.map(|scalar| &scalar.values[..]).ok_or_else(|| {
            let names: Vec<&str> = scalars.iter().map(|scalar| scalar.name.as_str()).collect();
            SurfaceError::NoScalar { name: name.to_owned(), names: names.join(", ") }
        })
    }

    /// The mesh and its scalars as PLY, with further scalars.
    ///
    /// # Errors
    /// If a scalar does not fit the mesh.
    pub fn to_ply(&self, further: Vec<VertexScalars>) -> Result<Vec<u8>, SurfaceError> {
        Ok(to_ply(self.mesh(), &self.with_further(further), Positions::default())?)
    }

    /// The mesh and its scalars as binary glTF, with further scalars, the first of which colours it; without, the first of its
    /// own does.
    ///
    /// # Errors
    /// If a position is not finite, a scalar does not fit the mesh, or the file would be larger than the format allows.
    pub fn to_glb(&self, further: Vec<VertexScalars>) -> Result<Vec<u8>, SurfaceError> {
        let count = further.len();
        let scalars = self.with_further(further);
        let first = if count == 0 { 0 } else { scalars.len() - count };
        let options = GlbOptions { coloured_by: Some(first) };
        Ok(to_glb(self.mesh(), &scalars, &options)?)
    }

    /// The scalars of the mesh, and further ones after them, which take the place of those of their names.
    fn with_further(&self, further: Vec<VertexScalars>) -> Vec<VertexScalars> {
        let is_replaced = |own: &VertexScalars| further.iter().any(|scalar| scalar.name == own.name);
        let kept: Vec<VertexScalars> =
            self.mesh.scalars.iter().filter(|own| !is_replaced(own)).cloned().collect();
        kept.into_iter().chain(further).collect()
    }
}
