//! Figures of meshes, winding numbers, closest points.

use ndf::describe::MeshDescription;
use ndf::figures::MeasureFigures;
use ndf_core::{Cancelled, DVec3, Hint, Progress};
use ndf_mesh::metrics::MeasureOptions;
use ndf_mesh::{FacePoint, TriangleMesh, TriangleTree};
use ndf_surfaces::winding_number::WindingNumber;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{Faces, Points, from_points, json, mesh, points};
use crate::errors::failure;
use crate::progress::{Raised, run};

/// Feet, faces, barycentric coordinates.
type PyFeet<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f64>>);

/// Points that are answered before it is asked again whether to stop.
const ASKED: usize = 256;

/// An answer for every query, over all threads.
fn answered<T: Send>(
    queries: &[DVec3],
    progress: &dyn Progress,
    answer: impl Fn(DVec3) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let of_part = |part: &[DVec3]| {
        progress.check()?;
        Ok(part.iter().map(|&query| answer(query)).collect())
    };
    let parts: Vec<Vec<T>> = queries.par_chunks(ASKED).map(of_part).collect::<Result<_, Cancelled>>()?;
    Ok(parts.into_iter().flatten().collect())
}

/// What is said of faces that are left out since they are not finite.
fn notes(mesh: &TriangleMesh) -> Vec<String> {
    let is_finite = |face: &&[u32; 3]| face.iter().all(|&v| mesh.positions()[v as usize].is_finite());
    match mesh.faces().iter().filter(|face| !is_finite(face)).count() {
        0 => Vec::new(),
        1 => vec!["1 face with corners that are not finite is left out".to_owned()],
        faces => vec![format!("{faces} faces with corners that are not finite are left out")],
    }
}

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
    let work = |progress: &dyn Progress| MeasureFigures::of(&reference, &other, &options, progress);
    json(&run(py, None, None, &Raised::default(), work)?.map_err(failure)?)
}

/// Counts and defects of a mesh, as JSON.
#[pyfunction]
pub(crate) fn info(py: Python<'_>, vertices: Points<'_>, faces: Faces<'_>) -> PyResult<String> {
    let mesh = mesh(&vertices, &faces)?;
    let work = |progress: &dyn Progress| MeshDescription::of_mesh(&mesh, progress);
    json(&run(py, None, None, &Raised::default(), work)?.map_err(failure)?)
}

/// Winding numbers at points, and notes.
#[pyfunction]
pub(crate) fn winding_number<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    queries: Points<'py>,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Vec<String>)> {
    let (mesh, queries) = (mesh(&vertices, &faces)?, points(&queries)?);
    let work = |progress: &dyn Progress| {
        let field = WindingNumber::new(&mesh);
        answered(&queries, progress, |q| if q.is_finite() { field.at(q) } else { f64::NAN })
    };
    let found = run(py, None, None, &Raised::default(), work)?.map_err(failure)?;
    Ok((PyArray1::from_vec(py, found), notes(&mesh)))
}

/// The points of a mesh closest to points, and notes.
#[pyfunction]
pub(crate) fn closest_point<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    faces: Faces<'py>,
    queries: Points<'py>,
) -> PyResult<(PyFeet<'py>, Vec<String>)> {
    let (mesh, queries) = (mesh(&vertices, &faces)?, points(&queries)?);
    let work = |progress: &dyn Progress| {
        let tree = TriangleTree::new(&mesh);
        answered(&queries, progress, |q| tree.closest_point(q, Hint::NONE).map(|foot| (foot.point, foot.at)))
    };
    let found: Vec<Option<(DVec3, FacePoint)>> =
        run(py, None, None, &Raised::default(), work)?.map_err(failure)?;
    let nowhere = DVec3::splat(f64::NAN);
    let feet = found.iter().map(|foot| foot.map_or(nowhere, |(point, _)| point)).collect();
    let faces = found.iter().map(|foot| foot.map_or(-1, |(_, at)| at.face.index() as i64)).collect();
    let barycentric =
        found.iter().map(|foot| foot.map_or(nowhere, |(_, at)| at.barycentric.into())).collect();
    let feet = (from_points(py, feet)?, PyArray1::from_vec(py, faces), from_points(py, barycentric)?);
    Ok((feet, notes(&mesh)))
}
