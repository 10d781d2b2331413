//! Models of shapes. They are kept beside the build; what their making cost is a line of `fits.csv`, of which the experiments of
//! run times and of cycle consistency are made.

use std::fs;

use ndf::presets::levels_of_size;
use ndf::{Field, Fit, Model, Preset, Settings};
use serde::{Deserialize, Serialize};

use super::Setup;
use super::row::load;
use super::shapes::Shape;
use crate::performance::process::timed;
use crate::rows::{Row, Rows};

/// What is learned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Learned {
    /// Levels of about so many bytes.
    Levels(usize),
    /// A network with the default preset.
    Network,
    /// A network with the preset of the paper.
    Paper,
}

/// A line of `fits.csv`.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct FitRow {
    pub(crate) shape: String,
    pub(crate) kind: String,
    pub(crate) model: String,
    /// Of networks.
    pub(crate) epochs: Option<usize>,
    pub(crate) samples: Option<usize>,
    pub(crate) base_faces: usize,
    pub(crate) bytes: usize,
    pub(crate) seed: u64,
    /// Base mesh, cache of the field, and training.
    pub(crate) seconds: f64,
    /// Of these, training.
    pub(crate) seconds_training: f64,
    /// Distances from the surface, in the box.
    pub(crate) projection_rms: f64,
    pub(crate) projection_max: f64,
    /// L_C of the last epoch.
    pub(crate) cycle_loss: Option<f64>,
    pub(crate) flipped: f64,
    pub(crate) load: Option<f64>,
    /// Why there is no model.
    #[serde(default)]
    pub(crate) left_out: String,
}

impl Row for FitRow {
    fn key(&self) -> String {
        format!("{}; {}; {}", self.shape, self.kind, self.model)
    }
}

impl Learned {
    /// The name of its rows.
    pub(crate) fn name(self, paper_epochs: Option<usize>) -> String {
        match (self, paper_epochs) {
            (Self::Levels(bytes), _) => format!("ours, {} kB", bytes as f64 / 1000.0),
            (Self::Network, _) => "ours, network".to_owned(),
            (Self::Paper, None) => PAPER.to_owned(),
            (Self::Paper, Some(epochs)) => format!("{PAPER}, {epochs} epochs"),
        }
    }
}

/// The name of the paper's own method.
pub(crate) const PAPER: &str = "preset of the paper";

/// A model, with the seconds of its making.
pub(super) fn model(shape: &Shape, learned: Learned, setup: &Setup) -> Result<(Vec<u8>, f64), String> {
    let say = |e: &dyn std::fmt::Display| format!("{}: {e}", shape.name);
    let rows: Rows<FitRow> = Rows::open(setup.out.join("fits.csv"))?;
    let name = learned.name(setup.scale.paper_epochs);
    let file = format!("{}-{:?}-{name}.ndf", shape.name, shape.role).to_lowercase().replace([' ', ','], "_");
    let file = setup.cache.join(file);
    let opened = shape.open()?;
    let kind = opened.kind.to_string();
    let known = rows
        .all()
        .iter()
        .find(|r| r.shape == shape.name && r.kind == kind && r.model == name)
        .filter(|row| row.left_out.is_empty());
    if let (Some(row), Ok(bytes)) = (known, fs::read(&file)) {
        return Ok((bytes, row.seconds));
    }
    let mut settings = match learned {
        Learned::Paper => Preset::Paper,
        _ => Preset::Default,
    }
    .settings(opened.kind);
    if let (Learned::Paper, Some(epochs)) = (learned, setup.scale.paper_epochs) {
        settings = Settings { epochs, identity_epochs: epochs.min(settings.identity_epochs), ..settings };
    }
    let (epochs, samples) = (settings.epochs, settings.samples);
    let fit = Fit::new(&opened);
    let fit = match learned {
        Learned::Levels(bytes) => fit.levels(levels_of_size(bytes)),
        Learned::Network | Learned::Paper => fit.field(Field::Network).settings(settings),
    };
    eprintln!("{}: learning {name}", shape.name);
    let (seconds, fitted) = timed(|| fit.run());
    let fitted = fitted.map_err(|e| say(&e))?;
    let bytes = fitted.model.to_bytes();
    let of_network = |count| (!matches!(learned, Learned::Levels(_))).then_some(count);
    fs::create_dir_all(&setup.cache).and_then(|()| fs::write(&file, &bytes)).map_err(|e| say(&e))?;
    // Another process may have kept a fit in the meantime.
    Rows::open(setup.out.join("fits.csv"))?.put(FitRow {
        shape: shape.name.clone(),
        kind,
        model: name,
        epochs: of_network(epochs),
        samples: of_network(samples),
        base_faces: fitted.model.field.base().face_count(),
        bytes: bytes.len(),
        seed: 0,
        seconds,
        seconds_training: fitted.report.seconds,
        projection_rms: fitted.report.projection_rms,
        projection_max: fitted.report.projection_max,
        cycle_loss: fitted.report.cycle_loss,
        flipped: fitted.report.flipped_fraction,
        load: load(),
        left_out: String::new(),
    })?;
    Ok((bytes, seconds))
}

/// Keeps the reason why there is no model.
pub(super) fn put_left_out(
    shape: &Shape,
    learned: Learned,
    setup: &Setup,
    left_out: String,
) -> Result<(), String> {
    let mut rows: Rows<FitRow> = Rows::open(setup.out.join("fits.csv"))?;
    let (kind, model) = (format!("{:?}", shape.role).to_lowercase(), learned.name(setup.scale.paper_epochs));
    rows.put(FitRow { shape: shape.name.clone(), kind, model, left_out, load: load(), ..FitRow::default() })
}

/// The model in bytes.
pub(super) fn read(bytes: &[u8]) -> Result<Model, String> {
    Model::from_bytes(bytes).map_err(|e| e.to_string())
}
