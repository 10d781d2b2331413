//! Figures of meshes, winding numbers, closest points.

use ndf::describe::MeshDescription;
use ndf::figures::MeasureFigures;
use ndf_core::{DVec3, Hint};
use ndf_mesh::metrics::MeasureOptions;
use ndf_mesh::{FacePoint, TriangleTree};
use ndf_surfaces::winding_number::WindingNumber;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{Faces, Points, from_points, json, mesh, points};
use crate::errors::failure;
use crate::progress::{Raised, run};

/// Feet, faces, barycentric coordinates.
type PyFeet<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f64>>);

/// How far two meshes are from each other, as JSON.
#[pyfunction]
pub(crate) fn measure(
    py: Python<'_>,
    vertices: Points<'_>,
    faces: Faces<'_>,
    other_vertices: Points<'_>,
    other_faces: Faces<'_>,
    samples: usize,
    seed: u64,
) -> PyResult<String> {
    let (reference, other) = (mesh(&vertices, &faces)?, mesh(&other_vertices, &other_faces)?);
    let options = MeasureOptions { samples, seed };
    let found =
        run(py, None, None, &Raised::default(), |_| MeasureFigures::of(&reference, &other, &options))?;
    json(&found.map_err(failure)?)
}

/// Counts and defects of a mesh, as JSON.
#[pyfunction]
pub(crate) fn info(py: Python<'_>, vertices: Points<'_>, faces: Faces<'_>) -> PyResult<String> {
    let mesh = mesh(&vertices, &faces)?;
    json(&run(py, None, None, &Raised::default(), |_| MeshDescription::of_mesh(&mesh))?)
}

/// Winding numbers at points.
#[pyfunction]
pub(crate) fn winding_number<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    queries: Points<'py>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (mesh, queries) = (mesh(&vertices, &faces)?, points(&queries)?);
    let found = run(py, None, None, &Raised::default(), |_| {
        let field = WindingNumber::new(&mesh);
        let at = |&q: &DVec3| if q.is_finite() { field.at(q) } else { f64::NAN };
        queries.par_iter().map(at).collect()
    })?;
    Ok(PyArray1::from_vec(py, found))
}

/// The points of a mesh closest to points.
#[pyfunction]
pub(crate) fn closest_point<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    queries: Points<'py>,
) -> PyResult<PyFeet<'py>> {
    let (mesh, queries) = (mesh(&vertices, &faces)?, points(&queries)?);
    let found: Vec<Option<(DVec3, FacePoint)>> = run(py, None, None, &Raised::default(), |_| {
        let tree = TriangleTree::new(&mesh);
        let closest = |&q: &DVec3| tree.closest_point(q, Hint::NONE).map(|foot| (foot.point, foot.at));
        queries.par_iter().map(closest).collect()
    })?;
    let nowhere = DVec3::splat(f64::NAN);
    let feet = found.iter().map(|foot| foot.map_or(nowhere, |(point, _)| point)).collect();
    let faces = found.iter().map(|foot| foot.map_or(-1, |(_, at)| at.face.index() as i64)).collect();
    let barycentric =
        found.iter().map(|foot| foot.map_or(nowhere, |(_, at)| at.barycentric.into())).collect();
    Ok((from_points(py, feet)?, PyArray1::from_vec(py, faces), from_points(py, barycentric)?))
}
