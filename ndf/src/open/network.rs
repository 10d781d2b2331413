//! Neural fields: checkpoints of networks.

use std::path::Path;

use ndf_core::{ImplicitField, Progress};
use ndf_formats::tensors::{TensorFile, is_tensor_file};
use ndf_surfaces::LevelSetSurface;
use ndf_surfaces::levels::DensityRule;
use ndf_surfaces::networks::{Activation, Latent, LayoutError, NeuralField, Quantity, is_snapshot};

use super::{Content, OpenError, OpenOptions, Representation};
use crate::describe::{Described, Description, NetworkDescription};
use crate::kind::Kind;
use crate::note::Note;
use crate::opened::{Level, LevelRule, Opened};

/// Checkpoints.
pub(super) struct Networks;

impl Representation for Networks {
    fn kinds(&self) -> &'static [Kind] {
        &[Kind::NeuralSdf, Kind::Neus, Kind::Nerf]
    }

    fn open(&self, content: Content, options: &OpenOptions, _: &dyn Progress) -> Result<Opened, OpenError> {
        let Network { field, kind, level, mut notes, .. } = read(&content, options)?;
        drop(content);
        notes.extend(assumed(&field));
        let search = field.search();
        let surface = Box::new(LevelSetSurface::new(field).with_search(search));
        Ok(Opened { level: Some(level), cached: Some(search), notes, ..Opened::from_surface(surface, kind) })
    }

    fn describe(&self, content: &Content, options: &OpenOptions) -> Result<Described, OpenError> {
        let Network { field, kind, level, container, notes } = read(content, options)?;
        let description = NetworkDescription::of(&field, kind, level, container);
        Ok(Described { description: Description::Network(description), notes })
    }
}

/// A network and what it is treated as.
struct Network {
    field: NeuralField,
    kind: Kind,
    level: Level,
    container: String,
    notes: Vec<Note>,
}

fn read(content: &Content, options: &OpenOptions) -> Result<Network, OpenError> {
    let name = || content.name();
    let layout = |source| OpenError::Layout { name: name(), source };
    let mut notes = Vec::new();
    let (field, container) = if is_tensor_file(&content.bytes) {
        let file = content.tensors()?;
        if !file.foreign().is_empty() {
            notes.push(Note::Foreign { names: file.foreign().to_vec() });
        }
        let field = NeuralField::from_tensors(file, &options.network).map_err(|error| match error {
            LayoutError::Unknown { .. } if is_table(file) => OpenError::Table { name: name() },
            error => layout(error),
        })?;
        if options.network.latent.is_none() && field.layout() == "DeepSDF" {
            notes.push(Note::NoCode);
        }
        (field, file.container().to_string())
    } else if is_snapshot(&content.bytes) {
        (
            NeuralField::from_snapshot(&content.bytes, &options.network).map_err(layout)?,
            "MessagePack".to_owned(),
        )
    } else {
        let field = NeuralField::from_flat_file(&content.bytes, &options.network);
        let field = field.ok_or_else(|| OpenError::NoNetwork { name: name() })?.map_err(layout)?;
        (field, "bare numbers".to_owned())
    };
    let found = match (field.quantity(), field.layout()) {
        (Quantity::Density, _) => Kind::Nerf,
        (Quantity::Distance, "NeuS" | "SDFStudio") => Kind::Neus,
        (Quantity::Distance, _) => Kind::NeuralSdf,
    };
    let kind = match options.kind {
        Some(asked) if (asked == Kind::Nerf) != (found == Kind::Nerf) => {
            return Err(OpenError::OtherKind { name: name(), found, asked });
        }
        asked => asked.unwrap_or(found),
    };
    let (field, level) = levelled(field, options.level);
    Ok(Network { field, kind, level, container, notes })
}

/// What is to be said of an activation that is only assumed. Layouts of one paper have that of the paper; perceptrons and
/// SIRENs come with any.
fn assumed(field: &NeuralField) -> Option<Note> {
    let is_of_any = matches!(field.layout(), "multilayer perceptron" | "SIREN" | "SIREN (lucidrains)");
    let activation = field.graph().activation().filter(|_| is_of_any && field.is_activation_assumed())?;
    let activation = match activation {
        Activation::Sine { frequency } => format!("sine of {frequency} x"),
        other => other.to_string(),
    };
    Some(Note::ActivationAssumed { activation })
}

/// The field at the level asked for, or at that of its rule.
fn levelled(field: NeuralField, asked: Option<f64>) -> (NeuralField, Level) {
    if let Some(value) = asked {
        return (field.with_level(value), Level { value, rule: LevelRule::Asked });
    }
    let (value, rule) = match (field.quantity(), field.level_rule()) {
        (Quantity::Distance, _) => (0.0, LevelRule::Zero),
        (Quantity::Density, Some(DensityRule::HalvedLight)) => (field.level(), LevelRule::HalvedLight),
        (Quantity::Density, Some(DensityRule::Otsu)) => (field.level(), LevelRule::Otsu),
        // The reader of snapshots sets the level.
        (Quantity::Density, None) => (field.level(), LevelRule::InstantNgp),
    };
    (field, Level { value, rule })
}

/// Whether a file holds nothing but a table, as the codes of decoders come.
fn is_table(file: &TensorFile) -> bool {
    file.iter().count() == 1 && Latent::from_tensors(file, 0).is_some()
}

/// A code of a decoder of many shapes: a row of a file with a table of them.
///
/// # Errors
/// If the file cannot be read, or has no such row.
pub fn read_latent(path: impl AsRef<Path>, row: usize) -> Result<Latent, OpenError> {
    let content = Content::read(path.as_ref())?;
    Latent::from_tensors(content.tensors()?, row)
        .ok_or_else(|| OpenError::NoCode { name: content.name(), row })
}
