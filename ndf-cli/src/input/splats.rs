//! Gaussian splats.

use ndf_core::ImplicitField;
use ndf_formats::splats::{SplatFormat, parse_splats, splat_format};
use ndf_surfaces::LevelSetSurface;
use ndf_surfaces::splats::{DensityOptions, SplatDensity};
use serde_json::json;

use super::{BaseSource, Content, Family, Input, Kind, Level, Reading};
use crate::context::Context;
use crate::output::{Failure, Outcome, grouped, readable, table};

/// Files of splats.
pub(super) const FAMILY: Family = Family { kinds: &[Kind::Splats], recognises, open, describe };

fn recognises(content: &Content) -> bool {
    splat_format(&content.bytes).is_some()
}

/// The density of the splats of a file.
struct Splats {
    density: SplatDensity,
    format: SplatFormat,
    level: Level,
    read: usize,
}

/// Reads a file; what was left out is told as warnings.
fn read(content: &Content, reading: &Reading, context: &Context) -> Result<Splats, Failure> {
    let name = content.name();
    let say = |e: &dyn std::fmt::Display| Failure::new(format!("{name}: {e}"));
    let (format, splats) = parse_splats(&content.bytes).map_err(|e| say(&e))?;
    let density = SplatDensity::new(&splats, &DensityOptions::default()).map_err(|e| say(&e))?;
    let report = density.report();
    for (count, what) in [
        (report.unsound, "splats are not finite or have no axes, and left out"),
        (report.floaters, "splats are outside the object or larger than half of it, and left out"),
    ] {
        if count > 0 {
            context.warn(&format!("{name}: {} {what}", grouped(count)));
        }
    }
    let (density, level) = match reading.iso {
        Some(value) => (density.with_level(value), Level { value, rule: "as asked for" }),
        None => {
            let value = density.level();
            (
                density,
                Level {
                    value,
                    rule: "as SuGaR's meshes, or half the typical density of opaque splats if less or where these are \
                           even",
                },
            )
        }
    };
    Ok(Splats { density, format, level, read: splats.len() })
}

fn open(content: &Content, reading: &Reading, context: &Context) -> Result<Input, Failure> {
    let Splats { density, level, .. } = read(content, reading, context)?;
    let surface = LevelSetSurface::new(density);
    let cached = Some(*surface.search());
    Ok(Input {
        kind: Kind::Splats,
        surface: Box::new(surface),
        base: BaseSource::Isosurface { scaffold: None, reason: None },
        mesh: None,
        level: Some(level),
        cached,
    })
}

fn describe(content: &Content, reading: &Reading, context: &Context) -> Result<Outcome, Failure> {
    let Splats { density, format, level, read } = read(content, reading, context)?;
    let (bounds, report) = (density.bounds(), density.report());
    let json = json!({
        "kind": Kind::Splats.name(),
        "format": format.to_string(),
        "splats": read,
        "splats_kept": report.kept,
        "unsound_splats": report.unsound,
        "faint_splats": report.faint,
        "floaters": report.floaters,
        "level": level.value,
        "level_rule": level.rule,
        "offset": density.offset(),
        "bounds": {"min": bounds.min.to_array(), "max": bounds.max.to_array()},
        "diagonal": bounds.diagonal(),
    });
    let extent = bounds.extent().to_array().map(readable).join(" × ");
    let kept = format!(
        "{} of {} make the density; {} are faint, {} far or large, {} unsound",
        grouped(report.kept),
        grouped(read),
        grouped(report.faint),
        grouped(report.floaters),
        grouped(report.unsound)
    );
    let rows = [
        ("splats", kept),
        ("level", format!("{}, {}", readable(level.value), level.rule)),
        ("offset", format!("about {} outside of the middle of the splats", readable(density.offset()))),
        ("box of the object", format!("{extent}, diagonal {}", readable(bounds.diagonal()))),
    ];
    Ok(Outcome::new(json, format!("{}: splats ({format})\n{}", content.name(), table(&rows))))
}
