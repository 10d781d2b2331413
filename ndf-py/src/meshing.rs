//! Remeshing, decimation, marching cubes.

use std::sync::Arc;

use ndf::{OpenOptions, Parts, Progress, RepairOptions, TriangleMesh};
use ndf_core::Inside;
use ndf_intrinsic::{IntrinsicTriangulation, RefinementOptions};
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

/// A mesh with edges of about this length.
#[pyfunction]
pub(crate) fn remesh<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    edge_length: f64,
    rounds: u32,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyMesh<'py>> {
    let mesh = mesh(&vertices, &faces)?;
    let options = IsotropicOptions { rounds, ..IsotropicOptions::with_edges_of(edge_length) };
    let found = run(py, None, observer, &Raised::default(), |progress: &dyn Progress| {
        let repaired = manifold(&mesh)?;
        remesh_isotropically(&repaired.mesh, None, &options, progress).map_err(|error| error.to_string())
    })?;
    from_mesh(py, found.map_err(failure)?.into_triangle_mesh())
}

/// The intrinsic Delaunay triangulation of a mesh, refined until its edges are no longer than this.
#[pyfunction]
pub(crate) fn remesh_intrinsically<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    edge_length: f64,
) -> PyResult<PyMesh<'py>> {
    let mesh = mesh(&vertices, &faces)?;
    if !(edge_length.is_finite() && edge_length > 0.0) {
        return Err(failure(format!("the edge length must be a positive number, not {edge_length}")));
    }
    let found = run(py, None, None, &Raised::default(), |_| {
        let input = manifold(&mesh)?.mesh;
        let mut triangulation = IntrinsicTriangulation::new(&input);
        // That of an equilateral triangle.
        let max_circumradius = edge_length / 3.0_f64.sqrt();
        let report = triangulation
            .refine_delaunay(&RefinementOptions { max_circumradius, ..RefinementOptions::default() });
        if report.reached_cap {
            return Err(
                "this edge length needs more than ten million vertices; choose a longer one".to_owned()
            );
        }
        let embedded = triangulation.embedded();
        embedded.ok_or_else(|| "edges of this length join vertices twice; choose a shorter one".to_owned())
    })?;
    from_mesh(py, found.map_err(failure)?.into_triangle_mesh())
}

/// A mesh of about so many faces, and the faces that its faces have been.
#[pyfunction]
pub(crate) fn decimate<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    count: usize,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<(PyMesh<'py>, Bound<'py, PyArray1<i64>>)> {
    let mesh = mesh(&vertices, &faces)?;
    let (mesh, births) = run(py, None, observer, &Raised::default(), |progress: &dyn Progress| {
        let Repaired { mesh, origins, .. } = manifold(&mesh)?;
        let found = ndf_meshing::decimate(&mesh, &DecimationOptions::to_faces(count), progress);
        let birth = |&face| origins.point(FacePoint::center(face)).face.index() as i64;
        Ok::<_, String>((found.mesh, found.births.iter().map(birth).collect::<Vec<_>>()))
    })?
    .map_err(failure)?;
    Ok((from_mesh(py, mesh.into_triangle_mesh())?, PyArray1::from_vec(py, births)))
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
