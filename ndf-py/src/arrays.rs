//! Arrays as meshes and points, and back. Results are handed over: NumPy takes the memory that Rust filled.

use ndf::{DVec3, TriangleMesh};
use ndf_mesh::io::VertexScalars;
use ndf_mesh::{Face, FacePoint};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use serde::Serialize;

use crate::errors::failure;

/// Points, `(n, 3)`, contiguous.
pub(crate) type Points<'py> = PyReadonlyArray2<'py, f64>;
/// Indices, `(m, 3)`, contiguous.
pub(crate) type Faces<'py> = PyReadonlyArray2<'py, i64>;
/// Vertices and faces that go to Python.
pub(crate) type PyMesh<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<i64>>);

/// Faces and barycentric coordinates that go to Python.
pub(crate) type PyFacePoints<'py> = (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f64>>);

/// Rows of three.
fn triples<T: Copy + numpy::Element>(array: &PyReadonlyArray2<'_, T>) -> PyResult<Vec<[T; 3]>> {
    let values = array.as_slice().map_err(failure)?;
    Ok(values.as_chunks::<3>().0.to_vec())
}

/// Points of an array.
pub(crate) fn points(array: &Points<'_>) -> PyResult<Vec<DVec3>> {
    Ok(triples(array)?.into_iter().map(DVec3::from_array).collect())
}

/// A mesh of arrays, with any defects they have.
pub(crate) fn mesh(vertices: &Points<'_>, faces: &Faces<'_>) -> PyResult<TriangleMesh> {
    let positions = points(vertices)?;
    let count = positions.len();
    let corner = |face: usize, v: i64| match u32::try_from(v) {
        Ok(vertex) if (vertex as usize) < count => Ok(vertex),
        _ => Err(failure(format!(
            "face {face} has the vertex {v}, but the vertices are 0 to {}",
            count as i64 - 1
        ))),
    };
    let corners = |(face, [a, b, c]): (usize, [i64; 3])| {
        Ok::<_, PyErr>([corner(face, a)?, corner(face, b)?, corner(face, c)?])
    };
    let faces = triples(faces)?.into_iter().enumerate().map(corners).collect::<PyResult<Vec<_>>>()?;
    TriangleMesh::new(positions, faces).map_err(failure)
}

/// The share of the range of a scalar that its values may be off in single precision.
const MAX_ROUNDING: f64 = 1e-3;

/// The values of a scalar in single precision, unless that changes them too much.
fn in_single_precision(name: &str, row: &[f64]) -> PyResult<Vec<f32>> {
    let single: Vec<f32> = row.iter().map(|&x| x as f32).collect();
    let finite = || row.iter().zip(&single).filter(|(x, _)| x.is_finite());
    let (low, high) =
        finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (&x, _)| (a.min(x), b.max(x)));
    // Of a constant, its size.
    let range = if low < high { high - low } else { low.abs() };
    let far = finite().find(|&(x, &y)| (x - f64::from(y)).abs() > MAX_ROUNDING * range);
    match far {
        None => Ok(single),
        Some((x, y)) => Err(failure(format!(
            "scalar {name} is stored in single precision, in which {x:e} is {y:e}; scale its values, or subtract their mean"
        ))),
    }
}

/// Values at so many vertices, one row a scalar.
pub(crate) fn scalars(
    names: Vec<String>,
    values: &PyReadonlyArray2<'_, f64>,
    vertices: usize,
) -> PyResult<Vec<VertexScalars>> {
    let rows = values.as_slice().map_err(failure)?.chunks(vertices.max(1));
    let scalar = |(name, row): (String, &[f64])| {
        let values = in_single_precision(&name, row)?;
        Ok(VertexScalars { name, values })
    };
    names.into_iter().zip(rows).map(scalar).collect()
}

/// Points of faces, of as many faces as there are.
pub(crate) fn face_points(
    faces: &PyReadonlyArray1<'_, i64>,
    barycentric: &Points<'_>,
    count: usize,
) -> PyResult<Vec<FacePoint>> {
    let faces = faces.as_slice().map_err(failure)?;
    let rows = triples(barycentric)?;
    faces.iter().zip(rows).map(|(&face, barycentric)| face_point(face, barycentric, count)).collect()
}

/// A point of one of so many faces.
pub(crate) fn face_point(face: i64, barycentric: [f64; 3], count: usize) -> PyResult<FacePoint> {
    let index = usize::try_from(face).ok().filter(|&face| face < count).ok_or_else(|| {
        failure(format!("there is no face {face}; the faces are 0 to {}", count as i64 - 1))
    })?;
    let [a, b, c] = barycentric;
    let is_inside = barycentric.iter().all(|x| *x >= -1e-9) && (a + b + c - 1.0).abs() <= 1e-6;
    if !is_inside {
        let sentence = "barycentric coordinates must add up to one, and none may be negative";
        return Err(failure(format!("[{a}, {b}, {c}] is no point of face {face}: {sentence}")));
    }
    let clamped = barycentric.map(|x| x.max(0.0));
    let sum: f64 = clamped.iter().sum();
    Ok(FacePoint { face: Face::new(index), barycentric: clamped.map(|x| x / sum) })
}

/// Rows of a table.
fn rows<T: numpy::Element>(py: Python<'_>, rows: Vec<[T; 3]>) -> PyResult<Bound<'_, PyArray2<T>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, 3])
}

/// Points as an array.
pub(crate) fn from_points(py: Python<'_>, points: Vec<DVec3>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    rows(py, points.into_iter().map(|p| p.to_array()).collect())
}

/// Values as an array of this many columns.
pub(crate) fn matrix(
    py: Python<'_>,
    values: Vec<f64>,
    shape: [usize; 2],
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    PyArray1::from_vec(py, values).reshape(shape)
}

/// A mesh as arrays.
pub(crate) fn from_mesh(py: Python<'_>, mesh: TriangleMesh) -> PyResult<PyMesh<'_>> {
    let (positions, faces) = mesh.into_parts();
    let faces = faces.into_iter().map(|face| face.map(i64::from)).collect();
    Ok((from_points(py, positions)?, rows(py, faces)?))
}

/// Points of faces as arrays: faces, and barycentric coordinates.
pub(crate) fn from_face_points<'py>(py: Python<'py>, points: &[FacePoint]) -> PyResult<PyFacePoints<'py>> {
    let faces = points.iter().map(|point| point.face.index() as i64).collect();
    Ok((PyArray1::from_vec(py, faces), rows(py, points.iter().map(|point| point.barycentric).collect())?))
}

/// Figures as JSON, which Python reads.
pub(crate) fn json(figures: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(figures).map_err(failure)
}
