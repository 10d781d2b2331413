//! Remeshing, decimation, marching cubes.

use std::sync::Arc;

use ndf::{OpenOptions, Parts, Progress, RepairOptions, TriangleMesh};
use ndf_core::Inside;
use ndf_mesh::FacePoint;
use ndf_mesh::repair::{Repaired, repaired};
use ndf_meshing::{DecimationOptions, IsotropicOptions, MarchingCubesOptions, remesh_isotropically};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::arrays::{Faces, Points, PyMesh, from_mesh, mesh};
use crate::errors::failure;
use crate::progress::{Raised, run};
use crate::surface::{PyField, bounding_box};

/// The manifold that a mesh means, with all of its components.
fn manifold(mesh: &TriangleMesh) -> Result<Repaired, String> {
    let options = RepairOptions { parts: Parts::All, ..OpenOptions::default().repair };
    repaired(mesh, &options).map_err(|error| format!("the mesh is {error}"))
}

/// What was repaired, in sentences.
fn sentences(repaired: &Repaired) -> Vec<String> {
    repaired.notes.iter().map(ToString::to_string).collect()
}

/// A mesh with edges of about this length, and notes.
#[pyfunction]
pub(crate) fn remesh<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    edge_length: f64,
    rounds: u32,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<(PyMesh<'py>, Vec<String>)> {
    let mesh = mesh(&vertices, &faces)?;
    let options = IsotropicOptions { rounds, ..IsotropicOptions::with_edges_of(edge_length) };
    let (found, notes) = run(py, None, observer, &Raised::default(), |progress: &dyn Progress| {
        let repaired = manifold(&mesh)?;
        let found = remesh_isotropically(&repaired.mesh, None, &options, progress);
        Ok::<_, String>((found.map_err(|error| error.to_string())?, sentences(&repaired)))
    })?
    .map_err(failure)?;
    Ok((from_mesh(py, found.into_triangle_mesh())?, notes))
}

/// The intrinsic Delaunay triangulation of a mesh, refined until its edges are no longer than this, and notes.
#[pyfunction]
pub(crate) fn remesh_intrinsically<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    edge_length: f64,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<(PyMesh<'py>, Vec<String>)> {
    let mesh = mesh(&vertices, &faces)?;
    let (found, notes) = run(py, None, observer, &Raised::default(), |progress: &dyn Progress| {
        let repaired = manifold(&mesh)?;
        let found = ndf_intrinsic::remesh_intrinsically(&repaired.mesh, edge_length, progress);
        // By the name of the argument.
        let found = found.map_err(|error| error.to_string().replace("edge length", "edge_length"))?;
        Ok::<_, String>((found, sentences(&repaired)))
    })?
    .map_err(failure)?;
    Ok((from_mesh(py, found.into_triangle_mesh())?, notes))
}

/// A mesh of about so many faces, the faces that its faces have been, and notes.
#[pyfunction]
pub(crate) fn decimate<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    count: usize,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<(PyMesh<'py>, Bound<'py, PyArray1<i64>>, Vec<String>)> {
    let mesh = mesh(&vertices, &faces)?;
    let (mesh, births, notes) = run(py, None, observer, &Raised::default(), |progress: &dyn Progress| {
        let repaired = manifold(&mesh)?;
        let notes = sentences(&repaired);
        let Repaired { mesh, origins, .. } = repaired;
        let found = ndf_meshing::decimate(&mesh, &DecimationOptions::to_faces(count), progress);
        let birth = |&face| origins.point(FacePoint::center(face)).face.index() as i64;
        Ok::<_, String>((found.mesh, found.births.iter().map(birth).collect::<Vec<_>>(), notes))
    })?
    .map_err(failure)?;
    Ok((from_mesh(py, mesh.into_triangle_mesh())?, PyArray1::from_vec(py, births), notes))
}

/// The isosurface of a field.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "Python gives them by name")]
pub(crate) fn marching_cubes<'py>(
    py: Python<'py>,
    field: Py<PyAny>,
    bounds: &Bound<'py, PyAny>,
    grid: u32,
    level: f64,
    above: bool,
    threads: Option<usize>,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyMesh<'py>> {
    let raised = Arc::new(Raised::default());
    let bounds = bounding_box(bounds)?;
    let inside = if above { Inside::Above } else { Inside::Below };
    let field = PyField { call: field, bounds, level, inside, raised: raised.clone() };
    let options = MarchingCubesOptions { grid, ..MarchingCubesOptions::default() };
    let work = |progress: &dyn Progress| ndf_meshing::marching_cubes(&field, &options, progress);
    let found = run(py, threads, observer, &raised, work)?.map_err(failure)?;
    from_mesh(py, found.mesh.into_triangle_mesh())
}
