//! Point clouds, with normals and without.

use ndf_core::Surface;
use ndf_formats::point_cloud::{CloudFile, PointCloud, parse_cloud, sniff};
use ndf_mesh::io::parse_mesh;
use ndf_surfaces::point_cloud::{
    Neighbours, OrientedCloud, WindingFieldOptions, agreement_of_normals, unoriented_cloud,
};
use serde_json::json;

use super::{BaseSource, Content, Family, Input, Kind, Reading};
use crate::commands::info::describe_mesh;
use crate::context::Context;
use crate::interrupt;
use crate::output::{Failure, Outcome, grouped, readable, table};

/// Share of neighbouring points whose normals point to the same side below which normals are taken to be of no use.
const CONSISTENT: f64 = 0.8;

/// The same, below which normals that were found are doubted.
const DOUBTFUL: f64 = 0.9;

/// Files of points.
pub(super) const FAMILY: Family =
    Family { kinds: &[Kind::OrientedCloud, Kind::Cloud], recognises, open, describe };

fn recognises(content: &Content) -> bool {
    sniff(&content.bytes).is_some()
}

/// A file of points and the kind it is treated as.
struct Points {
    file: CloudFile,
    kind: Kind,
    /// The share of neighbouring points whose normals agree, where there are normals.
    agreement: Option<f64>,
}

/// Reads a file; what was left out is told as warnings.
fn read(content: &Content, reading: &Reading, context: &Context) -> Result<Points, Failure> {
    let name = content.name();
    let file = parse_cloud(&content.bytes, &content.path)?;
    file.report.sentences().iter().for_each(|said| context.warn(&format!("{name}: {said}")));
    let positions = file.cloud.positions();
    let agreement =
        file.cloud.normals().map(|n| agreement_of_normals(positions, n, &Neighbours::new(positions)));
    let kind = match (reading.kind, agreement) {
        (Some(Kind::OrientedCloud), None) => {
            let failure = Failure::new(format!("{name} has no usable normals"));
            return Err(failure.try_instead("--as cloud finds normals"));
        }
        (Some(kind), _) => kind,
        (None, Some(share)) if share < CONSISTENT => {
            context.warn(&format!(
                "{name}: only {:.0} % of neighbouring normals point to the same side; they are not used (--as \
                 oriented-cloud uses them)",
                100.0 * share
            ));
            Kind::Cloud
        }
        (None, Some(_)) => Kind::OrientedCloud,
        (None, None) => Kind::Cloud,
    };
    Ok(Points { file, kind, agreement })
}

fn open(content: &Content, reading: &Reading, context: &Context) -> Result<Input, Failure> {
    let points = read(content, reading, context)?;
    let name = content.name();
    let cloud = &points.file.cloud;
    match points.kind {
        Kind::OrientedCloud => Ok(oriented(&name, cloud, context)),
        _ => unoriented(&name, cloud, context),
    }
}

fn oriented(name: &str, cloud: &PointCloud, context: &Context) -> Input {
    let surface = OrientedCloud::new(cloud, &WindingFieldOptions::default());
    if surface.field().is_turned() {
        context.warn(&format!("{name}: the normals point inward; they are turned"));
    }
    let base = BaseSource::Isosurface { scaffold: None, reason: None };
    Input {
        kind: Kind::OrientedCloud,
        surface: Box::new(surface),
        base,
        mesh: None,
        level: None,
        cached: None,
    }
}

fn unoriented(name: &str, cloud: &PointCloud, context: &Context) -> Result<Input, Failure> {
    let progress = context.progress().cancelled_by(interrupt::flag());
    let found = unoriented_cloud(cloud, &progress)
        .map_err(|_| Failure::new(format!("{name}: interrupted while its normals were sought")))?;
    drop(progress);
    if found.outliers > 0 {
        let count = grouped(found.outliers);
        context.warn(&format!("{name}: {count} points are far from all others, and left out"));
    }
    if found.agreement < DOUBTFUL {
        context.warn(&format!(
            "{name}: only {:.0} % of neighbouring normals that were found point to the same side; expect holes and \
             handles",
            100.0 * found.agreement
        ));
    }
    let scaffold: Box<dyn Surface> = Box::new(found.scaffold);
    let base = BaseSource::Isosurface { scaffold: Some(scaffold), reason: None };
    Ok(Input {
        kind: Kind::Cloud,
        surface: Box::new(found.surface),
        base,
        mesh: None,
        level: None,
        cached: None,
    })
}

fn describe(content: &Content, reading: &Reading, context: &Context) -> Result<Outcome, Failure> {
    let Points { file: CloudFile { cloud, report, format }, kind, agreement } =
        match read(content, reading, context) {
            Ok(points) => points,
            // Too few points to learn from: what is in the file can be told all the same.
            Err(failure) => {
                return parse_mesh(&content.bytes, &content.path)
                    .map(|file| describe_mesh(&content.name(), &file))
                    .map_err(|_| failure);
            }
        };
    let bounds = cloud.bounds();
    let points = cloud.positions().len();
    let json = json!({
        "kind": kind.name(),
        "format": format.to_string(),
        "points": points,
        "vertices": points,
        "faces": 0,
        "points_read": report.read,
        "nonfinite_points": report.not_finite,
        "duplicate_points": report.duplicates,
        "points_without_normal": report.without_normal,
        "normals": cloud.normals().is_some(),
        "normals_scaled": report.normals_scaled,
        "normals_agreeing": agreement,
        "bounds": {"min": bounds.min.to_array(), "max": bounds.max.to_array()},
        "diagonal": bounds.diagonal(),
    });
    let extent = bounds.extent().to_array().map(readable).join(" × ");
    let normals = match agreement {
        Some(share) => format!("{:.1} % of neighbouring ones point to the same side", 100.0 * share),
        None => "none".to_owned(),
    };
    let rows = [
        ("points", grouped(points)),
        ("normals", normals),
        ("box", format!("{extent}, diagonal {}", readable(bounds.diagonal()))),
    ];
    let mut text = format!("{}: {kind} ({format})\n{}", content.name(), table(&rows));
    for said in report.sentences() {
        text += &format!("  ! {said}\n");
    }
    Ok(Outcome::new(json, text))
}
