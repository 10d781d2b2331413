//! Models.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use ndf::figures::ExtractionFigures;
use ndf::{EdgeLength, ModelExt, Progress};
use ndf_mesh::FacePoint;
use ndf_mesh::io::atomic_write;
use ndf_train::scalars::{ScalarBudget, ScalarLevelOptions};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::{Map, Value, json};

use crate::arrays::{
    Faces, Points, PyFacePoints, PyMesh, face_points, from_face_points, from_mesh, from_points, json, mesh,
    scalars,
};
use crate::errors::failure;
use crate::progress::{Raised, run};

type PyExtracted<'py> = (PyMesh<'py>, PyFacePoints<'py>, Option<String>);

/// A model. Methods see it as it is when they are called.
#[pyclass(frozen, module = "ndf._native")]
pub(crate) struct Model(Mutex<Arc<ndf::Model>>);

impl Model {
    pub(crate) fn new(model: ndf::Model) -> Self {
        Self(Mutex::new(Arc::new(model)))
    }

    pub(crate) fn get(&self) -> Arc<ndf::Model> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn points(&self, face: &PyReadonlyArray1<'_, i64>, bary: &Points<'_>) -> PyResult<Vec<FacePoint>> {
        face_points(face, bary, self.get().field.base().face_count())
    }
}

#[pymethods]
impl Model {
    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<Self> {
        run(py, None, None, &Raised::default(), |_| ndf::Model::from_bytes(bytes))?
            .map(Self::new)
            .map_err(failure)
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let model = self.get();
        let bytes = run(py, None, None, &Raised::default(), move |_| model.to_bytes())?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let model = self.get();
        let written = run(py, None, None, &Raised::default(), |_| {
            let bytes = model.to_bytes();
            atomic_write(&path, |out| out.write_all(&bytes))
        })?;
        written.map_err(|error| failure(format!("cannot write {}: {error}", path.display())))
    }

    fn base<'py>(&self, py: Python<'py>) -> PyResult<PyMesh<'py>> {
        from_mesh(py, self.get().base_in_world().into_triangle_mesh())
    }

    /// A mesh, where over the base mesh its vertices are, and what is true of it as JSON.
    fn extract<'py>(
        &self,
        py: Python<'py>,
        edge_length: Option<f64>,
        relative_edge_length: Option<f64>,
        reported: bool,
        observer: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyExtracted<'py>> {
        let length = match (edge_length, relative_edge_length) {
            (Some(_), Some(_)) => return Err(failure("give edge_length or relative_edge_length, not both")),
            (Some(length), None) => EdgeLength::World(length),
            (None, Some(length)) => EdgeLength::Relative(length),
            (None, None) => EdgeLength::default(),
        };
        let model = self.get();
        let work = |progress: &dyn Progress| {
            let started = Instant::now();
            let found = model.extract_with(length, progress).map_err(|error| error.to_string())?;
            let seconds = started.elapsed().as_secs_f64();
            let figures = reported
                .then(|| ExtractionFigures::of(&found.mesh, Some(&found.report), progress))
                .transpose()
                .map_err(|error| error.to_string())?;
            let figures = figures.map(serde_json::to_value).transpose();
            let mut figures = figures.map_err(|error| error.to_string())?;
            if let Some(figures) = &mut figures {
                figures["seconds"] = seconds.into();
                figures["target_edge_length"] = length.world(&model).into();
            }
            Ok::<_, String>((found, figures.map(|figures| figures.to_string())))
        };
        let (found, figures) = run(py, None, observer, &Raised::default(), work)?.map_err(failure)?;
        let places = from_face_points(py, &found.origins)?;
        Ok((from_mesh(py, found.mesh.into_triangle_mesh())?, places, figures))
    }

    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        face: PyReadonlyArray1<'py, i64>,
        bary: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (model, points) = (self.get(), self.points(&face, &bary)?);
        let places = run(py, None, None, &Raised::default(), |_| {
            let mapped = model.field.map(&points);
            mapped.into_iter().map(|p| model.similarity.to_world(p)).collect()
        })?;
        from_points(py, places)
    }

    fn normals<'py>(
        &self,
        py: Python<'py>,
        face: PyReadonlyArray1<'py, i64>,
        bary: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (model, points) = (self.get(), self.points(&face, &bary)?);
        let normals = run(py, None, None, &Raised::default(), |_| {
            model.field.map_with_tangents(&points).iter().map(ndf_model::Mapped::normal).collect()
        })?;
        from_points(py, normals)
    }

    /// Names of scalars and their ranges, as JSON.
    fn scalars(&self) -> String {
        let model = self.get();
        let channels = model.scalars.iter().flat_map(ndf_model::SurfaceScalars::channels);
        let named = channels.map(|channel| {
            let [min, max] = channel.range;
            (channel.name.clone(), json!({"min": min, "max": max}))
        });
        Value::Object(named.collect::<Map<_, _>>()).to_string()
    }

    /// Learns scalars at the vertices of a mesh; figures as JSON. Values are one row a scalar.
    #[expect(clippy::too_many_arguments, reason = "Python gives them by name")]
    fn add_scalars(
        &self,
        py: Python<'_>,
        names: Vec<String>,
        values: PyReadonlyArray2<'_, f64>,
        vertices: Points<'_>,
        faces: Faces<'_>,
        size: Option<usize>,
        error: Option<f64>,
        seed: u64,
        observer: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<String> {
        let mesh = mesh(&vertices, &faces)?;
        let scalars = scalars(names, &values, mesh.vertex_count())?;
        let budget = match (size, error) {
            (Some(_), Some(_)) => return Err(failure("give size or error, not both")),
            (Some(bytes), None) => ScalarBudget::Bytes(bytes),
            (None, Some(error)) => ScalarBudget::Error(error),
            (None, None) => ScalarLevelOptions::default().budget,
        };
        let options = ScalarLevelOptions { budget, seed, ..ScalarLevelOptions::default() };
        let before = self.get();
        let mut model = ndf::Model::clone(&before);
        let (model, figures) = run(py, None, observer, &Raised::default(), move |progress| {
            let figures = ndf::store_scalars_on_levels(&mut model, &mesh, &scalars, &options, progress);
            figures.map(|figures| (model, figures))
        })?
        .map_err(failure)?;
        let mut current = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if !Arc::ptr_eq(&current, &before) {
            return Err(failure(
                "the model was given other scalars meanwhile; store them one after the other",
            ));
        }
        *current = Arc::new(model);
        drop(current);
        json(&figures)
    }

    fn eval_scalars<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        face: PyReadonlyArray1<'py, i64>,
        bary: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (model, points) = (self.get(), self.points(&face, &bary)?);
        let has_name = |fields: &&ndf_model::SurfaceScalars| fields.channels().iter().any(|c| c.name == name);
        let names = || -> Vec<&str> {
            model
                .scalars
                .iter()
                .flat_map(ndf_model::SurfaceScalars::channels)
                .map(|c| c.name.as_str())
                .collect()
        };
        let fields = model.scalars.iter().find(has_name).ok_or_else(|| {
            failure(format!("the model has no scalar {name}; its scalars: [{}]", names().join(", ")))
        })?;
        let columns =
            run(py, None, None, &Raised::default(), |_| fields.columns(model.field.base(), &points))?;
        let column = columns.into_iter().find(|column| column.name == name);
        let values = column.map_or_else(Vec::new, |column| column.values);
        Ok(PyArray1::from_vec(py, values.into_iter().map(f64::from).collect()))
    }
}
