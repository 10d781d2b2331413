//! Distances and paths.

use std::borrow::Cow;

use ndf::{
    DistanceMethod, DistanceOptions, DistanceSolver, Place, Progress, RepairOptions, Triangulated, Vertex,
};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays::{Faces, Points, face_point, face_points, from_face_points, from_points, matrix, mesh};
use crate::errors::failure;
use crate::progress::{Raised, run};

/// A mesh that is prepared for distances.
#[pyclass(frozen, module = "ndf._native")]
pub(crate) struct GeodesicSolver(DistanceSolver<'static>);

/// A vertex, or a face and barycentric coordinates.
type PyPlace = (i64, Option<[f64; 3]>);

/// Points, faces, barycentric coordinates, length.
type PyPath<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f64>>, f64);

impl GeodesicSolver {
    fn place(&self, (index, barycentric): PyPlace) -> PyResult<Place> {
        let mesh = self.0.surface().mesh();
        match barycentric {
            Some(barycentric) => Ok(Place::Point(face_point(index, barycentric, mesh.face_count())?)),
            None => Ok(Place::Vertex(self.vertex(index)?)),
        }
    }

    fn vertex(&self, index: i64) -> PyResult<Vertex> {
        let count = self.0.surface().mesh().vertex_count();
        let vertex = usize::try_from(index).ok().filter(|&vertex| vertex < count).map(Vertex::new);
        let sentence = || format!("there is no vertex {index}; the vertices are 0 to {}", count as i64 - 1);
        vertex.ok_or_else(|| failure(sentence()))
    }

    fn places(&self, sources: Vec<PyPlace>) -> PyResult<Vec<Place>> {
        sources.into_iter().map(|source| self.place(source)).collect()
    }
}

fn options(heat: bool, time_step: Option<f64>) -> DistanceOptions {
    let method = if heat { DistanceMethod::Heat } else { DistanceMethod::Exact };
    DistanceOptions { method, time_step, ..DistanceOptions::default() }
}

#[pymethods]
impl GeodesicSolver {
    #[new]
    fn new(py: Python<'_>, vertices: Points<'_>, faces: Faces<'_>) -> PyResult<Self> {
        let mesh = mesh(&vertices, &faces)?;
        run(py, None, None, &Raised::default(), |_| {
            let finite: Vec<_> = mesh.positions().iter().copied().filter(|p| p.is_finite()).collect();
            ndf::range::check_range(&finite).map_err(failure)?;
            let surface = Triangulated::from_mesh(mesh, &RepairOptions::default()).map_err(failure)?;
            DistanceSolver::new(Cow::Owned(surface)).map(Self).map_err(failure)
        })?
    }

    /// What was repaired, in sentences.
    fn notes(&self) -> Vec<String> {
        self.0.surface().notes.iter().map(ToString::to_string).collect()
    }

    fn distance<'py>(
        &self,
        py: Python<'py>,
        sources: Vec<PyPlace>,
        heat: bool,
        time_step: Option<f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let sources = self.places(sources)?;
        let work = |progress: &dyn Progress| self.0.distances(&sources, &options(heat, time_step), progress);
        let mut values = run(py, None, None, &Raised::default(), work)?.map_err(failure)?.values;
        // Nowhere is no distance away.
        for (value, position) in values.iter_mut().zip(self.0.surface().mesh().positions()) {
            if !position.is_finite() {
                *value = f64::NAN;
            }
        }
        Ok(PyArray1::from_vec(py, values))
    }

    fn distance_at<'py>(
        &self,
        py: Python<'py>,
        sources: Vec<PyPlace>,
        face: PyReadonlyArray1<'py, i64>,
        bary: PyReadonlyArray2<'py, f64>,
        heat: bool,
        time_step: Option<f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let sources = self.places(sources)?;
        let points = face_points(&face, &bary, self.0.surface().mesh().face_count())?;
        let options = options(heat, time_step);
        let work = |progress: &dyn Progress| self.0.distances_at(&sources, &points, &options, progress);
        Ok(PyArray1::from_vec(py, run(py, None, None, &Raised::default(), work)?.map_err(failure)?))
    }

    fn path<'py>(&self, py: Python<'py>, from: PyPlace, to: PyPlace) -> PyResult<PyPath<'py>> {
        let (from, to) = (self.place(from)?, self.place(to)?);
        let work = |progress: &dyn Progress| self.0.path(from, to, progress);
        let path = run(py, None, None, &Raised::default(), work)?.map_err(failure)?;
        let mesh = self.0.surface().mesh();
        let positions = path.points.iter().map(|point| point.position(mesh)).collect();
        let (faces, barycentric) = from_face_points(py, &path.points)?;
        Ok((from_points(py, positions)?, faces, barycentric, path.length))
    }

    fn matrix<'py>(
        &self,
        py: Python<'py>,
        vertices: Vec<i64>,
        threads: Option<usize>,
        observer: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let vertices = vertices.into_iter().map(|v| self.vertex(v)).collect::<PyResult<Vec<_>>>()?;
        let work = |progress: &dyn Progress| self.0.matrix(&vertices, progress);
        let found = run(py, threads, observer, &Raised::default(), work)?.map_err(failure)?;
        matrix(py, found, [vertices.len(); 2])
    }
}
