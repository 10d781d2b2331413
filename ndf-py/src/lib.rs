//! The native part of the Python package `ndf`: thin bindings of the crate `ndf`, which does the same as the program.
//!
//! The modules of `python/ndf` give it arrays in one layout and document what users call; here arrays become meshes and
//! back, work runs without the interpreter's lock, and errors become `ndf.NdfError`. Vertices are `(n, 3)` float64, faces
//! `(m, 3)` int64, both contiguous.

mod arrays;
mod errors;
mod fit;
mod geodesics;
mod measures;
mod meshing;
mod model;
mod progress;
mod spectra;
mod surface;
mod viewer;

use pyo3::prelude::*;
use pyo3::types::PyList;

/// Runs the program with these arguments, the first of which is its name; its exit code. `itself` is the command line that
/// starts it, for what it runs in processes of their own.
#[pyfunction]
fn run_program(py: Python<'_>, arguments: &Bound<'_, PyList>, itself: &Bound<'_, PyList>) -> PyResult<u8> {
    let arguments: Vec<std::ffi::OsString> = arguments.extract()?;
    ndf_cli::itself::starts_with(itself.extract()?);
    Ok(py.detach(|| ndf_cli::run(arguments)))
}

/// What is written in Rust.
#[pymodule(gil_used = false)]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    ndf_formats::point_cloud::silence_damaged_laz();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("NdfError", module.py().get_type::<errors::NdfError>())?;
    module.add_class::<geodesics::GeodesicSolver>()?;
    module.add_class::<model::Model>()?;
    module.add_function(wrap_pyfunction!(run_program, module)?)?;
    module.add_function(wrap_pyfunction!(fit::fit_mesh, module)?)?;
    module.add_function(wrap_pyfunction!(fit::fit_points, module)?)?;
    module.add_function(wrap_pyfunction!(fit::fit_file, module)?)?;
    module.add_function(wrap_pyfunction!(fit::fit_surface, module)?)?;
    module.add_function(wrap_pyfunction!(spectra::laplacian, module)?)?;
    module.add_function(wrap_pyfunction!(spectra::spectrum, module)?)?;
    module.add_function(wrap_pyfunction!(spectra::heat_kernel_signature, module)?)?;
    module.add_function(wrap_pyfunction!(spectra::wave_kernel_signature, module)?)?;
    module.add_function(wrap_pyfunction!(meshing::remesh, module)?)?;
    module.add_function(wrap_pyfunction!(meshing::remesh_intrinsically, module)?)?;
    module.add_function(wrap_pyfunction!(meshing::decimate, module)?)?;
    module.add_function(wrap_pyfunction!(meshing::marching_cubes, module)?)?;
    module.add_function(wrap_pyfunction!(viewer::model_page, module)?)?;
    module.add_function(wrap_pyfunction!(viewer::mesh_page, module)?)?;
    module.add_function(wrap_pyfunction!(measures::measure, module)?)?;
    module.add_function(wrap_pyfunction!(measures::info, module)?)?;
    module.add_function(wrap_pyfunction!(measures::winding_number, module)?)?;
    module.add_function(wrap_pyfunction!(measures::closest_point, module)?)
}
