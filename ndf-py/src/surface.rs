//! Surfaces and fields that are written in Python. They are called in batches, from Rust's threads, with the interpreter's
//! lock.

use std::sync::Arc;

use ndf::{DVec3, Surface};
use ndf_core::{Answer, BoundingBox, Foot, Hint, ImplicitField, Inside, Miss, Query};
use numpy::PyReadonlyArray1;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{Points, from_points, points};
use crate::errors::failure;
use crate::progress::Raised;

/// The points of a batch, as many as there are at once; more come in pieces, so that other threads have their turn.
const BATCH: usize = 16_384;

/// A scalar field: a callable from `(k, 3)` to `(k,)`.
pub(crate) struct PyField {
    pub(crate) call: Py<PyAny>,
    pub(crate) bounds: BoundingBox,
    pub(crate) level: f64,
    pub(crate) inside: Inside,
    pub(crate) raised: Arc<Raised>,
}

impl ImplicitField for PyField {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        for (points, values) in points.chunks(BATCH).zip(values.chunks_mut(BATCH)) {
            let found =
                (!self.raised.is_raised()).then(|| Python::attach(|py| called(py, &self.call, points)));
            match found {
                Some(Ok(found)) => values.copy_from_slice(&found),
                failed => {
                    values.fill(f64::NAN);
                    failed.and_then(Result::err).into_iter().for_each(|error| self.raised.raise(error));
                }
            }
        }
    }

    fn batch(&self) -> usize {
        BATCH
    }

    fn bounds(&self) -> BoundingBox {
        self.bounds
    }

    fn level(&self) -> f64 {
        self.level
    }

    fn inside(&self) -> Inside {
        self.inside
    }
}

/// Values of a callable at points.
fn called(py: Python<'_>, call: &Py<PyAny>, points: &[DVec3]) -> PyResult<Vec<f64>> {
    let array = from_points(py, points.to_vec())?;
    let values = call.bind(py).call1((array,))?;
    let values = as_array(&values, &[points.len()], "a field must return one value for each of its points")?;
    let values: PyReadonlyArray1<'_, f64> = values.extract()?;
    Ok(values.as_slice().map_err(failure)?.to_vec())
}

/// What Python code returned, as a contiguous array of float64 of this shape.
fn as_array<'py>(value: &Bound<'py, PyAny>, shape: &[usize], otherwise: &str) -> PyResult<Bound<'py, PyAny>> {
    let py = value.py();
    let numpy = py.import("numpy")?;
    let no_numbers = |error: PyErr| {
        let is_of_numpy = error.is_instance_of::<PyTypeError>(py) || error.is_instance_of::<PyValueError>(py);
        if is_of_numpy { failure(format!("{otherwise}: {}", error.value(py))) } else { error }
    };
    let given = numpy.call_method1("asarray", (value,)).map_err(no_numbers)?;
    if given.getattr("dtype")?.getattr("kind")?.extract::<&str>()? == "c" {
        return Err(failure(format!("{otherwise}: real numbers were expected, not complex ones")));
    }
    let array = numpy.call_method1("require", (given, "float64", "CA")).map_err(no_numbers)?;
    let found = array.getattr("shape")?;
    let shape = PyTuple::new(py, shape)?;
    if !found.eq(&shape)? {
        return Err(failure(format!("{otherwise}: an array of shape {shape} was expected, not {found}")));
    }
    Ok(array)
}

/// A surface: an object with `bounds()`, `project(points, normals)` and, where it has one, `field(points)`.
pub(crate) struct PySurface {
    object: Py<PyAny>,
    bounds: BoundingBox,
    field: Option<PyField>,
    raised: Arc<Raised>,
}

impl PySurface {
    /// Asks the object for its bounds and whether it has a field.
    pub(crate) fn new(object: &Bound<'_, PyAny>, raised: Arc<Raised>) -> PyResult<Self> {
        let bounds = bounding_box(&object.call_method0("bounds")?)?;
        object.getattr("project")?;
        let field = object.getattr_opt("field")?.filter(|field| !field.is_none()).map(|field| PyField {
            call: field.unbind(),
            bounds,
            level: 0.0,
            inside: Inside::Below,
            raised: raised.clone(),
        });
        Ok(Self { object: object.clone().unbind(), bounds, field, raised })
    }

    fn called(&self, py: Python<'_>, queries: &[Query]) -> PyResult<Vec<Answer>> {
        let count = queries.len();
        let at = from_points(py, queries.iter().map(|query| query.point).collect())?;
        let normals = queries.iter().map(|query| query.normal.unwrap_or(DVec3::ZERO)).collect();
        let answer = self.object.bind(py).call_method1("project", (at, from_points(py, normals)?))?;
        let rule = "project must return feet and normals, (k, 3), and ok, (k,)";
        let three = answer.extract();
        let (feet, normals, ok): (Bound<'_, PyAny>, Bound<'_, PyAny>, Bound<'_, PyAny>) =
            three.map_err(|_: PyErr| failure(rule))?;
        let rows = |value| -> PyResult<Vec<DVec3>> {
            let array = as_array(value, &[count, 3], rule)?;
            points(&array.extract::<Points<'_>>()?)
        };
        let (feet, normals) = (rows(&feet)?, rows(&normals)?);
        let ok: PyReadonlyArray1<'_, f64> = as_array(&ok, &[count], rule)?.extract()?;
        let ok = ok.as_slice().map_err(failure)?;
        let answer = |((point, normal), ok): ((DVec3, DVec3), &f64)| {
            let normal = normal.try_normalize().filter(|_| *ok != 0.0 && point.is_finite());
            normal.map(|normal| Foot { point, normal, hint: Hint::NONE }).ok_or(Miss::OutOfReach)
        };
        Ok(feet.into_iter().zip(normals).zip(ok).map(answer).collect())
    }
}

impl Surface for PySurface {
    fn bounds(&self) -> BoundingBox {
        self.bounds
    }

    fn batch(&self) -> usize {
        BATCH
    }

    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        for (queries, feet) in queries.chunks(BATCH).zip(feet.chunks_mut(BATCH)) {
            let found = (!self.raised.is_raised()).then(|| Python::attach(|py| self.called(py, queries)));
            match found {
                Some(Ok(found)) => feet.copy_from_slice(&found),
                failed => {
                    feet.fill(Err(Miss::OutOfReach));
                    failed.and_then(Result::err).into_iter().for_each(|error| self.raised.raise(error));
                }
            }
            // What is not finite has no foot, whatever was answered.
            let queries = queries.iter().zip(feet);
            queries
                .filter(|(query, _)| !query.point.is_finite())
                .for_each(|(_, foot)| *foot = Err(Miss::NotFinite));
        }
    }

    fn as_field(&self) -> Option<&dyn ImplicitField> {
        self.field.as_ref().map(|field| field as &dyn ImplicitField)
    }
}

/// A box of its two corners.
pub(crate) fn bounding_box(corners: &Bound<'_, PyAny>) -> PyResult<BoundingBox> {
    let array = as_array(corners, &[2, 3], "bounds are two corners, (lo, hi)")?;
    let corners = points(&array.extract::<Points<'_>>()?)?;
    let bounds = BoundingBox { min: corners[0], max: corners[1] };
    let is_box = bounds.min.is_finite() && bounds.max.is_finite() && bounds.extent().min_element() > 0.0;
    let [lo, hi] = [bounds.min, bounds.max];
    let sentence = || failure(format!("bounds must be finite with lo below hi, not {lo} and {hi}"));
    is_box.then_some(bounds).ok_or_else(sentence)
}
