//! What is to be said of clouds, networks and splats.

use ndf_core::{ImplicitField, Inside};
use ndf_formats::point_cloud::CloudFile;
use ndf_formats::splats::SplatFormat;
use ndf_surfaces::networks::{Activation, NeuralField};
use ndf_surfaces::splats::SplatDensity;
use serde::Serialize;

use super::Corners;
use crate::kind::Kind;
use crate::opened::{Level, LevelRule};

/// The points of a file. Lengths are in its units.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CloudDescription {
    /// What it is treated as.
    pub kind: Kind,
    /// Format of the file.
    pub format: String,
    /// Usable points.
    pub points: usize,
    /// The same, as meshes have it.
    pub vertices: usize,
    /// 0.
    pub faces: usize,
    /// Points in the file.
    pub points_read: usize,
    /// Points that the file marks as withheld or as noise, left out.
    pub flagged_points: usize,
    /// Points that are not finite, left out.
    pub nonfinite_points: usize,
    /// Points in the place of another, merged.
    pub duplicate_points: usize,
    /// Points without a usable normal, left out.
    pub points_without_normal: usize,
    /// Whether there are normals.
    pub normals: bool,
    /// Normals that were not of length 1, scaled.
    pub normals_scaled: usize,
    /// The share of neighbouring normals that point to the same side.
    pub normals_agreeing: Option<f64>,
    /// Smallest box around all points.
    pub bounds: Corners,
    /// Its diagonal.
    pub diagonal: f64,
}

impl CloudDescription {
    pub(crate) fn of(file: &CloudFile, kind: Kind, agreement: Option<f64>) -> Self {
        let CloudFile { cloud, report, format } = file;
        let (points, bounds) = (cloud.positions().len(), cloud.bounds());
        Self {
            kind,
            format: format.to_string(),
            points,
            vertices: points,
            faces: 0,
            points_read: report.read,
            flagged_points: report.flagged,
            nonfinite_points: report.not_finite,
            duplicate_points: report.duplicates,
            points_without_normal: report.without_normal,
            normals: cloud.normals().is_some(),
            normals_scaled: report.normals_scaled,
            normals_agreeing: agreement,
            bounds: bounds.into(),
            diagonal: bounds.diagonal(),
        }
    }
}

/// The network of a checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct NetworkDescription {
    /// What it is treated as.
    pub kind: Kind,
    /// Container of the file.
    pub format: String,
    /// Which network it is.
    pub layout: &'static str,
    /// Weights and biases.
    pub parameters: usize,
    /// Widths of what goes into the layers, one after the other, and of what comes out of the last.
    pub widths: Vec<usize>,
    /// The activation between layers, as `--activation` takes it.
    pub activation: Option<String>,
    /// Whether it is only that of the layout: neither the file nor an option says so.
    pub activation_assumed: bool,
    /// The frequency ω of sines, sin(ω x).
    pub omega: Option<f64>,
    /// Octaves of the encoding of the position.
    pub octaves: Option<usize>,
    /// The level that is its surface.
    pub level: f64,
    /// How that was chosen, in words.
    #[serde(serialize_with = "in_words")]
    pub level_rule: LevelRule,
    /// The side of the level that is inside: `below` or `above`.
    pub inside: &'static str,
    /// The box its surface is in.
    #[serde(rename = "box")]
    pub box_: Corners,
    /// The same, as other inputs have it.
    pub bounds: Corners,
    /// Its diagonal.
    pub diagonal: f64,
}

impl NetworkDescription {
    pub(crate) fn of(field: &NeuralField, kind: Kind, level: Level, container: String) -> Self {
        let bounds = field.bounds();
        let activation = field.graph().activation();
        Self {
            kind,
            format: container,
            layout: field.layout(),
            parameters: field.parameters(),
            widths: field.graph().widths(),
            activation: activation.map(|activation| activation.to_string()),
            activation_assumed: field.is_activation_assumed(),
            omega: match activation {
                // As it is written: 30.1 in single precision has more digits.
                Some(Activation::Sine { frequency }) => frequency.to_string().parse().ok(),
                _ => None,
            },
            octaves: field.graph().octaves(),
            level: level.value,
            level_rule: level.rule,
            inside: match field.inside() {
                Inside::Below => "below",
                Inside::Above => "above",
            },
            box_: bounds.into(),
            bounds: bounds.into(),
            diagonal: bounds.diagonal(),
        }
    }
}

/// The splats of a file.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SplatsDescription {
    /// [`Kind::Splats`].
    pub kind: Kind,
    /// Format of the file.
    pub format: String,
    /// Splats in the file.
    pub splats: usize,
    /// Those that make the density.
    pub splats_kept: usize,
    /// Those that are not finite or have no axes.
    pub unsound_splats: usize,
    /// Those that are too faint.
    pub faint_splats: usize,
    /// Those far from the others, or larger than half the object.
    pub floaters: usize,
    /// The level that is the surface.
    pub level: f64,
    /// How that was chosen, in words.
    #[serde(serialize_with = "in_words")]
    pub level_rule: LevelRule,
    /// About how far the surface is outside of the middle of the splats.
    pub offset: f64,
    /// The box of the object.
    pub bounds: Corners,
    /// Its diagonal.
    pub diagonal: f64,
}

impl SplatsDescription {
    pub(crate) fn of(density: &SplatDensity, format: SplatFormat, level: Level, splats: usize) -> Self {
        let (bounds, report) = (density.bounds(), density.report());
        Self {
            kind: Kind::Splats,
            format: format.to_string(),
            splats,
            splats_kept: report.kept,
            unsound_splats: report.unsound,
            faint_splats: report.faint,
            floaters: report.floaters,
            level: level.value,
            level_rule: level.rule,
            offset: density.offset(),
            bounds: bounds.into(),
            diagonal: bounds.diagonal(),
        }
    }
}

pub(crate) fn in_words<T: std::fmt::Display, S: serde::Serializer>(
    value: &T,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_str(value)
}
