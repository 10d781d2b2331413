//! Neural fields: checkpoints of networks.

use ndf_core::{ImplicitField, Inside};
use ndf_formats::tensors::{TensorFile, is_tensor_file};
use ndf_surfaces::LevelSetSurface;
use ndf_surfaces::networks::{Latent, LayoutError, NeuralField, Quantity, is_snapshot};
use serde_json::json;

use super::{BaseSource, Content, Family, Input, Kind, Level, Reading};
use crate::context::Context;
use crate::output::{Failure, Outcome, grouped, readable, table};

/// Checkpoints.
pub(super) const FAMILY: Family =
    Family { kinds: &[Kind::NeuralSdf, Kind::Neus, Kind::Nerf], recognises, open, describe };

fn recognises(content: &Content) -> bool {
    let bytes = &content.bytes;
    is_tensor_file(bytes) || is_snapshot(bytes) || NeuralField::from_flat_file(bytes).is_some()
}

/// A network and what it is treated as.
struct Network {
    field: NeuralField,
    kind: Kind,
    level: Level,
    container: String,
}

fn read(content: &Content, reading: &Reading, context: &Context) -> Result<Network, Failure> {
    let name = content.name();
    let say = |e: &dyn std::fmt::Display| Failure::new(format!("{name}: {e}"));
    let (field, container) = if is_tensor_file(&content.bytes) {
        let file = TensorFile::parse(&content.bytes).map_err(|e| say(&e))?;
        if !file.foreign().is_empty() {
            let foreign = file.foreign().join(", ");
            context.warn(&format!(
                "{name}: it names {foreign}, which is not run; what it stands for is left out"
            ));
        }
        let latent = latent(reading)?;
        let field = NeuralField::from_tensors(&file, latent.as_ref()).map_err(|e| match e {
            LayoutError::Unknown { .. } if is_codes(&file) => {
                Failure::new(format!("{name} is a table, perhaps of codes, and no network"))
                    .try_instead("fit the decoder they are for, and give the codes with --latent")
            }
            e => say(&e),
        })?;
        if latent.is_none() && field.layout() == "DeepSDF" {
            context.warn(&format!(
                "{name}: a decoder of many shapes; without --latent it is the one with the code 0"
            ));
        }
        (field, file.container().to_string())
    } else if is_snapshot(&content.bytes) {
        let field = NeuralField::from_snapshot(&content.bytes).map_err(|e| say(&e))?;
        (field, "MessagePack".to_owned())
    } else {
        let field = NeuralField::from_flat_file(&content.bytes);
        let none = || say(&"it is no PyTorch, safetensors, NumPy, HDF5 or instant-ngp file");
        (field.ok_or_else(none)?, "bare numbers".to_owned())
    };
    let found = match (field.quantity(), field.layout()) {
        (Quantity::Density, _) => Kind::Nerf,
        (Quantity::Distance, "NeuS" | "SDFStudio") => Kind::Neus,
        (Quantity::Distance, _) => Kind::NeuralSdf,
    };
    let kind = match reading.kind {
        Some(asked) if (asked == Kind::Nerf) != (found == Kind::Nerf) => {
            return Err(Failure::new(format!("{name} is of the kind {found}, not {asked}")));
        }
        asked => asked.unwrap_or(found),
    };
    let (field, level) = match (reading.iso, field.quantity(), field.layout()) {
        (Some(value), _, _) => (field.with_level(value), Level { value, rule: "as asked for" }),
        (None, Quantity::Distance, _) => (field, Level { value: 0.0, rule: "the zero of a distance" }),
        (None, Quantity::Density, "instant-ngp") => {
            let value = field.level();
            (field, Level { value, rule: "of the logarithm of the density, as instant-ngp meshes it" })
        }
        (None, Quantity::Density, _) => {
            let value = field.level();
            (
                field,
                Level {
                    value,
                    rule: "halves light within 1/100 of the box, or parts the densities best (Otsu) if less",
                },
            )
        }
    };
    Ok(Network { field, kind, level, container })
}

/// Whether a file holds nothing but a table, as the codes of decoders come.
fn is_codes(file: &TensorFile) -> bool {
    file.iter().count() == 1 && Latent::from_tensors(file, 0).is_some()
}

fn latent(reading: &Reading) -> Result<Option<Latent>, Failure> {
    let Some(path) = &reading.latent else { return Ok(None) };
    let content = Content::read(path)?;
    let name = content.name();
    let file = TensorFile::parse(&content.bytes).map_err(|e| Failure::new(format!("{name}: {e}")))?;
    let row = reading.latent_index;
    let missing = || Failure::new(format!("{name} has no code number {row}"));
    Latent::from_tensors(&file, row).map(Some).ok_or_else(missing)
}

fn open(content: &Content, reading: &Reading, context: &Context) -> Result<Input, Failure> {
    let Network { field, kind, level, .. } = read(content, reading, context)?;
    let search = field.search();
    Ok(Input {
        kind,
        surface: Box::new(LevelSetSurface::new(field).with_search(search)),
        base: BaseSource::Isosurface { scaffold: None, reason: None },
        mesh: None,
        level: Some(level),
        cached: Some(search),
    })
}

fn describe(content: &Content, reading: &Reading, context: &Context) -> Result<Outcome, Failure> {
    let Network { field, kind, level, container } = read(content, reading, context)?;
    let bounds = field.bounds();
    let inside = match field.inside() {
        Inside::Below => "below",
        Inside::Above => "above",
    };
    let json = json!({
        "kind": kind.name(),
        "format": container,
        "layout": field.layout(),
        "parameters": field.parameters(),
        "level": level.value,
        "level_rule": level.rule,
        "inside": inside,
        "bounds": {"min": bounds.min.to_array(), "max": bounds.max.to_array()},
        "diagonal": bounds.diagonal(),
    });
    let extent = bounds.extent().to_array().map(readable).join(" × ");
    let rows = [
        ("layout", field.layout().to_owned()),
        ("parameters", grouped(field.parameters())),
        ("level", format!("{}, {}; the inside is {inside} it", readable(level.value), level.rule)),
        ("box", format!("{extent}, diagonal {}", readable(bounds.diagonal()))),
    ];
    let text = format!("{}: {kind} ({container})\n{}", content.name(), table(&rows));
    Ok(Outcome::new(json, text))
}
