//! Learning: `fit`, `fit_points`, `fit_file`, `fit_surface`.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use ndf::open::cloud_notes;
use ndf::presets::levels_of_size;
use ndf::{Field, Fit, Kind, ManifoldMesh, OpenOptions, Opened, Parts, Preset, Progress, RepairOptions};
use ndf::{Settings, TriangleMesh};
use ndf_formats::point_cloud::{CloudFile, CloudFormat, PointCloud, RawCloud};
use ndf_train::levels::LevelOptions;
use pyo3::prelude::*;

use crate::arrays::{Faces, Points, mesh, points};
use crate::errors::failure;
use crate::model::Model;
use crate::progress::{Raised, run};
use crate::surface::PySurface;

/// How to learn, with the names that Python has for it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct FitOptions {
    base_faces: Option<usize>,
    features: Option<usize>,
    paper: bool,
    epochs: Option<usize>,
    samples: Option<usize>,
    field: String,
    size: Option<usize>,
    error: Option<f64>,
    seed: u64,
    time_limit: Option<f64>,
    threads: Option<usize>,
}

/// Vertices and faces of a base mesh.
type Base<'py> = Option<(Points<'py>, Faces<'py>)>;

/// A model, the figures of its making as JSON, and notes.
type Learned = (Model, String, Vec<String>);

impl FitOptions {
    fn time_limit(&self) -> Result<Option<Duration>, String> {
        let sentence = |seconds| format!("time_limit must be seconds that are not negative, not {seconds}");
        let limit = |seconds| Duration::try_from_secs_f64(seconds).map_err(|_| sentence(seconds));
        self.time_limit.map(limit).transpose()
    }

    /// The settings of a network, if any were given.
    fn settings(&self, kind: Kind, time_limit: Option<Duration>) -> Option<Settings> {
        let preset = if self.paper { Preset::Paper } else { Preset::Default };
        let is_given = self.paper || [self.features, self.epochs, self.samples].iter().any(Option::is_some);
        let mut settings = Settings { seed: self.seed, time_limit, ..preset.settings(kind) };
        settings.field.network.features = self.features.unwrap_or(settings.field.network.features);
        settings.epochs = self.epochs.unwrap_or(settings.epochs);
        settings.samples = self.samples.unwrap_or(settings.samples);
        (is_given || self.field == "network").then_some(settings)
    }

    /// The run that was asked for.
    fn fit<'a>(&self, opened: &'a Opened) -> Result<Fit<'a>, String> {
        let (seed, time_limit) = (self.seed, self.time_limit()?);
        let mut fit = Fit::new(opened).seed(seed);
        if let Some(limit) = time_limit {
            fit = fit.time_limit(limit);
        }
        if let Some(settings) = self.settings(opened.kind, time_limit) {
            fit = fit.settings(settings);
        }
        fit = match self.field.as_str() {
            "auto" => fit,
            "levels" => fit.field(Field::Levels),
            "network" if self.size.is_some() || self.error.is_some() => {
                return Err("size and error are for levels, not for a network".to_owned());
            }
            "network" => fit.field(Field::Network),
            other => return Err(format!("field must be auto, levels or network, not {other}")),
        };
        if let Some(size) = self.size {
            fit = fit.levels(LevelOptions { seed, time_limit, ..levels_of_size(size) });
        }
        if let Some(share) = self.error {
            fit = fit.error(share);
        }
        match self.base_faces {
            Some(faces @ 0..4) => Err(format!("base_faces must be at least 4, not {faces}")),
            Some(faces) => Ok(fit.base_faces(faces)),
            None => Ok(fit),
        }
    }
}

/// Learns what is opened.
fn learned(
    py: Python<'_>,
    options: &FitOptions,
    base: Base<'_>,
    observer: Option<&Bound<'_, PyAny>>,
    raised: &Raised,
    open: impl FnOnce(&dyn Progress) -> Result<Opened, String> + Send,
) -> PyResult<Learned> {
    let base = base.map(|(vertices, faces)| mesh(&vertices, &faces)).transpose()?;
    let work = |progress: &dyn Progress| -> Result<_, String> {
        let started = Instant::now();
        let opened = open(progress)?;
        let seconds_reading = started.elapsed().as_secs_f64();
        let base =
            base.map(ManifoldMesh::try_from).transpose().map_err(|e| format!("the base mesh is {e}"))?;
        let mut fit = options.fit(&opened)?.progress(progress);
        if let Some(base) = &base {
            fit = fit.base(base);
        }
        let fitted = fit.run().map_err(|error| error.to_string())?;
        let mut figures = serde_json::to_value(fitted.figures()).map_err(|error| error.to_string())?;
        figures["output"] = serde_json::Value::Null;
        figures["seconds_reading"] = seconds_reading.into();
        let notes = opened.notes.iter().chain(&fitted.notes).map(ToString::to_string).collect();
        Ok((fitted.model, figures.to_string(), notes))
    };
    let (model, figures, notes) = run(py, options.threads, observer, raised, work)?.map_err(failure)?;
    Ok((Model::new(model), figures, notes))
}

/// Which components are kept.
fn repair(largest_component: bool, keep_seams: bool) -> RepairOptions {
    let RepairOptions { parts, .. } = OpenOptions::default().repair;
    RepairOptions { parts: if largest_component { Parts::Largest } else { parts }, keep_seams }
}

/// Learns a mesh. With a name it is the file of this name that provenance tells of.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "Python gives them by name")]
pub(crate) fn fit_mesh(
    py: Python<'_>,
    vertices: Points<'_>,
    faces: Faces<'_>,
    name: Option<PathBuf>,
    largest_component: bool,
    base: Base<'_>,
    options: FitOptions,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<Learned> {
    let mesh: TriangleMesh = mesh(&vertices, &faces)?;
    learned(py, &options, base, observer, &Raised::default(), move |_| {
        let opened = ndf::open::open_mesh_with(mesh, &repair(largest_component, false));
        let mut opened = opened.map_err(|error| error.to_string())?;
        opened.path = name;
        Ok(opened)
    })
}

/// Learns a cloud.
#[pyfunction]
pub(crate) fn fit_points(
    py: Python<'_>,
    positions: Points<'_>,
    normals: Option<Points<'_>>,
    name: Option<PathBuf>,
    base: Base<'_>,
    options: FitOptions,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<Learned> {
    let positions = points(&positions)?;
    let normals = normals.map(|normals| points(&normals)).transpose()?;
    let raw = RawCloud { positions, normals, flagged: 0, unclear_columns: false, numbered: false };
    learned(py, &options, base, observer, &Raised::default(), move |progress| {
        let (cloud, report) = PointCloud::cleaned(raw).map_err(|error| format!("the cloud: {error}"))?;
        let mut opened = ndf::open_cloud(&cloud, None, progress).map_err(|error| error.to_string())?;
        let file = CloudFile { cloud, report, format: CloudFormat::Text };
        opened.notes.splice(0..0, cloud_notes(&file, &OpenOptions::default()));
        opened.path = name;
        Ok(opened)
    })
}

/// Learns whatever is in a file.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "Python gives them by name")]
pub(crate) fn fit_file(
    py: Python<'_>,
    path: PathBuf,
    kind: Option<&str>,
    iso: Option<f64>,
    largest_component: bool,
    keep_seams: bool,
    base: Base<'_>,
    options: FitOptions,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<Learned> {
    let names = || Kind::ALL.map(Kind::name).join(", ");
    let kind = kind.map(str::parse::<Kind>).transpose();
    let kind = kind.map_err(|error| failure(format!("{error}; the kinds are {}", names())))?;
    let repair = repair(largest_component, keep_seams);
    let opening = OpenOptions { kind, level: iso, repair, ..OpenOptions::default() };
    learned(py, &options, base, observer, &Raised::default(), move |progress| {
        ndf::open_with(&path, &opening, progress).map_err(|error| error.to_string())
    })
}

/// Learns a surface that is written in Python.
#[pyfunction]
pub(crate) fn fit_surface(
    py: Python<'_>,
    object: &Bound<'_, PyAny>,
    base: Base<'_>,
    options: FitOptions,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<Learned> {
    let raised = Arc::new(Raised::default());
    let surface = PySurface::new(object, raised.clone())?;
    learned(py, &options, base, observer, &raised, move |_| {
        Ok(Opened::from_surface(Box::new(surface), Kind::Mesh))
    })
}
