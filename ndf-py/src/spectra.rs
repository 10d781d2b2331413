//! Laplacians, modes and signatures.

use ndf::{Progress, RepairOptions, Triangulated};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_spectral::{
    CsrMatrix, Inversion, LaplaceBeltrami, Mass, ModeOptions, Modes, OperatorOptions, SpectralError,
    VertexFunctions,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::arrays::{Faces, Points, matrix, mesh};
use crate::errors::failure;
use crate::progress::{Raised, run};

/// Values, columns, offsets of rows: what `scipy.sparse.csr_matrix` takes.
type PyCsr<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<i64>>);

/// Eigenvalues, and modes: one row each.
type PyModes<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

fn operator_options(mass: &str, delaunay: bool) -> PyResult<OperatorOptions> {
    let mass = match mass {
        "lumped" => Mass::Barycentric,
        "voronoi" => Mass::MixedVoronoi,
        "consistent" => Mass::Consistent,
        other => return Err(failure(format!("mass must be lumped, voronoi or consistent, not {other}"))),
    };
    Ok(OperatorOptions { mass, delaunay })
}

/// The operator at the vertices that faces use, and which these are.
fn operator(
    mesh: &TriangleMesh,
    options: OperatorOptions,
) -> Result<(LaplaceBeltrami, Vec<u32>), SpectralError> {
    let mut number = vec![u32::MAX; mesh.vertex_count()];
    mesh.faces().iter().flatten().for_each(|&v| number[v as usize] = 0);
    let used: Vec<u32> = (0..).zip(&number).filter(|(_, n)| **n == 0).map(|(v, _)| v).collect();
    (0..).zip(&used).for_each(|(new, &v)| number[v as usize] = new);
    let positions = used.iter().map(|&v| mesh.positions()[v as usize]).collect();
    let faces = mesh.faces().iter().map(|face| face.map(|v| number[v as usize])).collect();
    let mesh = TriangleMesh::new(positions, faces).expect("vertices that faces use have numbers");
    let operator = match ManifoldMesh::try_from(mesh.clone()) {
        Ok(mesh) => LaplaceBeltrami::new(&IntrinsicMesh::from_mesh(&mesh), options),
        Err(_) => LaplaceBeltrami::from_triangle_mesh(&mesh, options),
    };
    Ok((operator?, used))
}

/// A matrix with rows and columns of zeros for the vertices that no face uses.
fn csr<'py>(py: Python<'py>, matrix: &CsrMatrix, used: &[u32], vertices: usize) -> PyCsr<'py> {
    let mut offsets = vec![0; vertices + 1];
    for (row, &vertex) in used.iter().enumerate() {
        offsets[vertex as usize + 1] = (matrix.offsets()[row + 1] - matrix.offsets()[row]) as i64;
    }
    (0..vertices).for_each(|v| offsets[v + 1] += offsets[v]);
    let columns = matrix.columns().iter().map(|&column| i64::from(used[column])).collect();
    (
        PyArray1::from_vec(py, matrix.values().to_vec()),
        PyArray1::from_vec(py, columns),
        PyArray1::from_vec(py, offsets),
    )
}

/// The Laplacian and the mass matrix.
#[pyfunction]
pub(crate) fn laplacian<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    mass: &str,
    delaunay: bool,
) -> PyResult<(PyCsr<'py>, PyCsr<'py>)> {
    let (mesh, options) = (mesh(&vertices, &faces)?, operator_options(mass, delaunay)?);
    let count = mesh.vertex_count();
    let (operator, used) =
        run(py, None, None, &Raised::default(), |_| operator(&mesh, options))?.map_err(failure)?;
    Ok((csr(py, operator.laplacian(), &used, count), csr(py, operator.mass(), &used, count)))
}

/// Modes, at the vertices of the working mesh.
fn modes(
    py: Python<'_>,
    surface: &Triangulated,
    options: &ModeOptions,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<Modes> {
    let count = surface.mesh().vertex_count();
    let options = ModeOptions { count: options.count.min(count), ..*options };
    run(py, None, observer, &Raised::default(), |progress: &dyn Progress| surface.modes(&options, progress))?
        .map_err(failure)
}

/// Functions at the vertices of the mesh, one row each.
fn functions<'py>(
    py: Python<'py>,
    surface: &Triangulated,
    functions: &VertexFunctions,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let values: Vec<f64> = functions.iter().flat_map(|function| surface.at_vertices(function)).collect();
    matrix(py, values, [functions.len(), surface.mesh().vertex_count()])
}

fn surface(py: Python<'_>, vertices: &Points<'_>, faces: &Faces<'_>) -> PyResult<Triangulated> {
    let mesh = mesh(vertices, faces)?;
    run(py, None, None, &Raised::default(), |_| Triangulated::from_mesh(mesh, &RepairOptions::default()))?
        .map_err(failure)
}

/// What was repaired, in sentences.
fn sentences(surface: &Triangulated) -> Vec<String> {
    surface.notes.iter().map(ToString::to_string).collect()
}

/// Eigenvalues and modes, one row each, and notes.
#[pyfunction]
pub(crate) fn spectrum<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    k: usize,
    operator: (String, bool),
    held_multigrid: (bool, bool),
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<(PyModes<'py>, Vec<String>)> {
    let (held, multigrid) = held_multigrid;
    let surface = surface(py, &vertices, &faces)?;
    let vertices = surface.mesh().vertex_count();
    if k == 0 || k > vertices {
        return Err(failure(format!("{k} modes requested, but the surface has {vertices} vertices")));
    }
    let operator = operator_options(&operator.0, operator.1)?;
    let inversion = if multigrid { Inversion::Multigrid } else { Inversion::Factorisation };
    let options = ModeOptions { count: k, inversion, operator, ..ModeOptions::default() };
    let work = |progress: &dyn Progress| match held {
        true => surface.modes_with_held_boundary(&options, progress),
        false => surface.modes(&options, progress),
    };
    let found = run(py, None, observer, &Raised::default(), work)?.map_err(failure)?;
    let rows = functions(py, &surface, &found.functions)?;
    Ok(((PyArray1::from_vec(py, found.eigenvalues), rows), sentences(&surface)))
}

/// Signatures, a row for each time, and notes.
#[pyfunction]
pub(crate) fn heat_kernel_signature<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    times: Vec<f64>,
    k: usize,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Bound<'py, PyArray2<f64>>, Vec<String>)> {
    let surface = surface(py, &vertices, &faces)?;
    let options = ModeOptions { count: k, ..ModeOptions::default() };
    let found = modes(py, &surface, &options, observer)?;
    Ok((functions(py, &surface, &found.heat_kernel_signatures(&times))?, sentences(&surface)))
}

/// Signatures, a row for each energy, and notes.
#[pyfunction]
pub(crate) fn wave_kernel_signature<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    count: usize,
    k: usize,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Bound<'py, PyArray2<f64>>, Vec<String>)> {
    let surface = surface(py, &vertices, &faces)?;
    let options = ModeOptions { count: k, ..ModeOptions::default() };
    let found = modes(py, &surface, &options, observer)?;
    Ok((functions(py, &surface, &found.wave_kernel_signatures(count))?, sentences(&surface)))
}
