//! Pages that show a model or a mesh.

use ndf::ModelExt;
use ndf_cli::render::{Up, upright};
use ndf_mesh::io::{Positions, property_names, to_ply};
use ndf_viewer::Input;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

use crate::arrays::{Faces, Points, mesh, scalars};
use crate::errors::failure;
use crate::model::Model;
use crate::progress::{Raised, run};

/// The page of a model.
#[pyfunction]
pub(crate) fn model_page(
    py: Python<'_>,
    model: &Model,
    name: &str,
    scalar: Option<&str>,
    source: Option<[f64; 3]>,
    edge_length: Option<f64>,
) -> PyResult<String> {
    let model = model.get();
    run(py, None, None, &Raised::default(), |_| {
        let bytes = model.to_bytes();
        let up = upright(&model.base_in_world(), Up::Y).name();
        Input { scalar, source, edge_length, up: Some(up), ..Input::new(name, &bytes) }.to_html()
    })
}

/// The page of a mesh with scalars, values of one row a scalar.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "Python gives them by name")]
pub(crate) fn mesh_page(
    py: Python<'_>,
    vertices: Points<'_>,
    faces: Faces<'_>,
    names: Vec<String>,
    values: PyReadonlyArray2<'_, f64>,
    name: &str,
    scalar: Option<&str>,
    source: Option<[f64; 3]>,
) -> PyResult<String> {
    let mesh = mesh(&vertices, &faces)?;
    let in_page = property_names(&names.iter().map(String::as_str).collect::<Vec<_>>());
    let number = scalar.and_then(|scalar| names.iter().position(|name| name == scalar));
    let scalar = number.map(|number| in_page[number].as_str());
    let mut scalars = scalars(names, &values, mesh.vertex_count())?;
    scalars.iter_mut().zip(&in_page).for_each(|(scalar, name)| scalar.name.clone_from(name));
    let page = run(py, None, None, &Raised::default(), |_| {
        let bytes = to_ply(&mesh, &scalars, Positions::Exact)?;
        let up = upright(&mesh, Up::Y).name();
        Ok::<_, ndf_mesh::io::WriteError>(
            Input { scalar, source, up: Some(up), ..Input::new(name, &bytes) }.to_html(),
        )
    })?;
    page.map_err(failure)
}
