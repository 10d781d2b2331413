//! Point clouds, with normals and without.

use ndf_core::{Progress, Surface};
use ndf_formats::point_cloud::{CloudFile, CloudFormat, PointCloud, parse_cloud};
use ndf_mesh::io::parse_mesh;
use ndf_surfaces::point_cloud::{
    Neighbours, OrientedCloud, WindingFieldOptions, agreement_of_normals, evenly_picked, unoriented_cloud,
    without_outliers,
};

use super::{COLUMNS, Content, KEEP_FLAGGED, OpenError, OpenOptions, Representation};
use crate::describe::{CloudDescription, Described, Description, MeshDescription};
use crate::kind::Kind;
use crate::note::Note;
use crate::opened::{BaseSource, Opened};
use crate::presets::{CONSISTENT, DOUBTFUL, MAX_POINTS};
use crate::range::check_range;

/// Files of points.
pub(super) struct Clouds;

impl Representation for Clouds {
    fn kinds(&self) -> &'static [Kind] {
        &[Kind::OrientedCloud, Kind::Cloud]
    }

    fn open(
        &self,
        content: Content,
        options: &OpenOptions,
        progress: &dyn Progress,
    ) -> Result<Opened, OpenError> {
        let file = parse_cloud(&content.bytes, &content.path, &options.cloud)?;
        let name = content.name();
        drop(content);
        let notes = cloud_notes(&file, options);
        opened(file.cloud, options.kind, &name, notes, progress)
    }

    fn describe(&self, content: &Content, options: &OpenOptions) -> Result<Described, OpenError> {
        let name = content.name();
        let file = match parse_cloud(&content.bytes, &content.path, &options.cloud) {
            Ok(file) => file,
            // Too few points to learn from: what is in the file can be told all the same.
            Err(error) => {
                let file = parse_mesh(&content.bytes, &content.path).map_err(|_| error)?;
                let description = Description::Mesh(MeshDescription::of(&file));
                return Ok(Described { description, notes: Vec::new() });
            }
        };
        let mut notes = cloud_notes(&file, options);
        let agreement = agreement(&file.cloud, &Neighbours::new(file.cloud.positions()));
        let kind = chosen(options.kind, agreement, &name, &mut notes)?;
        let description = CloudDescription::of(&file, kind, agreement);
        Ok(Described { description: Description::Cloud(description), notes })
    }
}

/// What there is to say about the points of a file, and options that say nothing of its format.
pub fn cloud_notes(file: &CloudFile, options: &OpenOptions) -> Vec<Note> {
    let mut notes = Note::of_points(&file.report);
    let has_columns = matches!(file.format, CloudFormat::Text | CloudFormat::Pts);
    if options.cloud.columns.is_some() && !has_columns {
        notes.push(Note::OptionUnused { what: COLUMNS });
    }
    if options.cloud.keep_flagged && file.format != CloudFormat::Las {
        notes.push(Note::OptionUnused { what: KEEP_FLAGGED });
    }
    notes
}

/// The share of neighbouring points whose normals agree, where there are normals.
fn agreement(cloud: &PointCloud, neighbours: &Neighbours) -> Option<f64> {
    cloud.normals().map(|normals| agreement_of_normals(cloud.positions(), normals, neighbours))
}

/// What a cloud is treated as.
fn chosen(
    asked: Option<Kind>,
    agreement: Option<f64>,
    name: &str,
    notes: &mut Vec<Note>,
) -> Result<Kind, OpenError> {
    match (asked, agreement) {
        (Some(Kind::OrientedCloud), None) => Err(OpenError::NoNormals { name: name.to_owned() }),
        (Some(kind), _) => Ok(kind),
        (None, Some(agreement)) if agreement < CONSISTENT => {
            notes.push(Note::NormalsDisagree { agreement });
            Ok(Kind::Cloud)
        }
        (None, Some(_)) => Ok(Kind::OrientedCloud),
        (None, None) => Ok(Kind::Cloud),
    }
}

/// A cloud as a surface; what there is to say about its points comes first.
pub(super) fn opened(
    cloud: PointCloud,
    asked: Option<Kind>,
    name: &str,
    mut notes: Vec<Note>,
    progress: &dyn Progress,
) -> Result<Opened, OpenError> {
    check_range(cloud.positions()).map_err(|source| OpenError::Range { name: name.to_owned(), source })?;
    let (cloud, thinned) = thinned(cloud);
    notes.extend(thinned);
    let neighbours = Neighbours::new(cloud.positions());
    let kind = chosen(asked, agreement(&cloud, &neighbours), name, &mut notes)?;
    let mut opened = match kind {
        Kind::OrientedCloud => oriented(cloud, neighbours),
        _ => unoriented(cloud, neighbours, name, progress)?,
    };
    opened.notes.splice(0..0, notes);
    Ok(opened)
}

/// A cloud of no more points than surfaces are made of.
fn thinned(cloud: PointCloud) -> (PointCloud, Option<Note>) {
    let points = cloud.positions().len();
    if points <= MAX_POINTS {
        return (cloud, None);
    }
    let picked = evenly_picked(cloud.positions(), MAX_POINTS);
    let mut is_picked = vec![false; points];
    picked.into_iter().for_each(|i| is_picked[i as usize] = true);
    (cloud.retained(|i| is_picked[i]), Some(Note::PointsThinned { points, used: MAX_POINTS }))
}

fn outlying(points: usize) -> Option<Note> {
    (points > 0).then_some(Note::Outliers { points })
}

fn oriented(cloud: PointCloud, neighbours: Neighbours) -> Opened {
    let (cloud, neighbours, outliers) = without_outliers(cloud, neighbours);
    let surface = OrientedCloud::with_neighbours(&cloud, neighbours, &WindingFieldOptions::default());
    let turned = surface.field().is_turned().then_some(Note::NormalsTurned);
    let notes = outlying(outliers).into_iter().chain(turned).collect();
    Opened { notes, ..Opened::from_surface(Box::new(surface), Kind::OrientedCloud) }
}

fn unoriented(
    cloud: PointCloud,
    neighbours: Neighbours,
    name: &str,
    progress: &dyn Progress,
) -> Result<Opened, OpenError> {
    let found = unoriented_cloud(cloud, neighbours, progress)
        .map_err(|_| OpenError::Cancelled { name: name.to_owned() })?;
    let mut notes: Vec<Note> = outlying(found.outliers).into_iter().collect();
    if found.agreement < DOUBTFUL {
        notes.push(Note::NormalsDoubtful { agreement: found.agreement });
    }
    let scaffold: Box<dyn Surface> = Box::new(found.scaffold);
    let base = BaseSource::Isosurface { scaffold: Some(scaffold), reason: None };
    Ok(Opened { base, notes, ..Opened::from_surface(Box::new(found.surface), Kind::Cloud) })
}
