//! The one exception.

use std::fmt::Display;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

pyo3::create_exception!(
    ndf,
    NdfError,
    PyValueError,
    "Why something failed: one sentence that says what is wrong and what to try."
);

/// The exception with this sentence.
pub(crate) fn failure(sentence: impl Display) -> PyErr {
    NdfError::new_err(sentence.to_string())
}
