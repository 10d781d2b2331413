//! Gaussian splats.

use ndf_core::{DVec3, ImplicitField, Progress};
use ndf_formats::splats::{Splat, SplatFormat, parse_splats, splats_of_tensors};
use ndf_formats::tensors::{Container, is_tensor_file};
use ndf_surfaces::LevelSetSurface;
use ndf_surfaces::splats::{DensityOptions, SplatDensity, SplatRule};

use super::{Content, OpenError, OpenOptions, Representation};
use crate::describe::{Described, Description, SplatsDescription};
use crate::kind::Kind;
use crate::note::Note;
use crate::opened::{Level, LevelRule, Opened};
use crate::range::check_range;

/// Files of splats.
pub(super) struct Splats;

impl Representation for Splats {
    fn kinds(&self) -> &'static [Kind] {
        &[Kind::Splats]
    }

    fn open(&self, content: Content, options: &OpenOptions, _: &dyn Progress) -> Result<Opened, OpenError> {
        let Read { density, level, notes, .. } = read(&content, options)?;
        drop(content);
        let surface = LevelSetSurface::new(density);
        let cached = Some(*surface.search());
        let opened = Opened::from_surface(Box::new(surface), Kind::Splats);
        Ok(Opened { level: Some(level), cached, notes, ..opened })
    }

    fn describe(&self, content: &Content, options: &OpenOptions) -> Result<Described, OpenError> {
        let Read { density, format, level, splats, notes } = read(content, options)?;
        let description = SplatsDescription::of(&density, format, level, splats);
        Ok(Described { description: Description::Splats(description), notes })
    }
}

/// The density of the splats of a file.
struct Read {
    density: SplatDensity,
    format: SplatFormat,
    level: Level,
    /// Splats in the file.
    splats: usize,
    notes: Vec<Note>,
}

/// The splats of a checkpoint, if it is one.
fn tensors_of(content: &Content) -> Option<(Container, Vec<Splat>)> {
    let file = is_tensor_file(&content.bytes).then(|| content.tensors().ok())??;
    splats_of_tensors(file).map(|splats| (file.container(), splats))
}

fn read(content: &Content, options: &OpenOptions) -> Result<Read, OpenError> {
    let name = || content.name();
    let (format, splats) = match tensors_of(content) {
        Some((container, splats)) => (SplatFormat::Checkpoint(container), splats),
        None => {
            parse_splats(&content.bytes).map_err(|source| OpenError::SplatFile { name: name(), source })?
        }
    };
    let centers: Vec<DVec3> =
        splats.iter().filter(|splat| splat.is_sound()).map(|splat| DVec3::from_array(splat.center)).collect();
    check_range(&centers).map_err(|source| OpenError::Range { name: name(), source })?;
    let density = SplatDensity::new(&splats, &DensityOptions::default())
        .map_err(|source| OpenError::NoSplats { name: name(), source })?;
    let report = density.report();
    let mut notes = Vec::new();
    if report.unsound > 0 {
        notes.push(Note::SplatsUnsound { splats: report.unsound });
    }
    if report.floaters > 0 {
        notes.push(Note::SplatsFloating { splats: report.floaters });
    }
    if report.merged < report.kept {
        notes.push(Note::SplatsMerged { splats: report.kept, merged: report.merged });
    }
    let (density, level) = match options.level {
        Some(value) => (density.with_level(value), Level { value, rule: LevelRule::Asked }),
        None => {
            let rule = match density.level_rule() {
                Some(SplatRule::HalfTypical) => LevelRule::HalfTypical,
                Some(SplatRule::EvenSheet) => LevelRule::EvenSheet,
                Some(SplatRule::Sugar) | None => LevelRule::Sugar,
            };
            let value = density.level();
            (density, Level { value, rule })
        }
    };
    Ok(Read { density, format, level, splats: splats.len(), notes })
}
