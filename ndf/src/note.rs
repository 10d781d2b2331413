//! What a user should know about a result that is still usable.

use std::fmt;

use ndf_formats::point_cloud::CleaningReport;
use ndf_mesh::io::ReadNote;
use ndf_mesh::repair::RepairNote;
use ndf_mesh::{NotManifold, ValidationReport};
use serde::Serialize;

use crate::text::{grouped, readable};

/// Names of classes that a sentence holds.
const MAX_NAMES: usize = 4;

/// Something that was left out, changed or doubtful, and did not stop the work.
///
/// Programs see a variant with numbers, serialised as an object whose `note` names the variant. `Display` gives a
/// sentence for people, without the name of the file. Shares are from 0 to 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "note", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Note {
    /// Points that the file marks as withheld or as noise were left out.
    PointsFlagged {
        /// How many.
        points: usize,
    },
    /// An option is not used, since it says nothing of what the input is.
    OptionUnused {
        /// What the option is about.
        what: &'static str,
    },
    /// Columns that may be normals were passed over.
    UnclearColumns,
    /// The first column is the number of the row, and was passed over.
    RowsNumbered,
    /// Points that are not finite were left out.
    PointsNotFinite {
        /// How many.
        points: usize,
    },
    /// Points in the place of another were merged with it.
    DuplicatePoints {
        /// How many.
        points: usize,
    },
    /// Points whose normal is zero or not finite were left out.
    PointsWithoutNormal {
        /// How many.
        points: usize,
    },
    /// Normals that were not of length 1 were scaled.
    NormalsScaled {
        /// How many.
        normals: usize,
    },
    /// Most normals were zero or not finite; none is used.
    NormalsGivenUp,
    /// Too few neighbouring normals point to the same side; the cloud is treated as one without normals.
    NormalsDisagree {
        /// The share that does.
        agreement: f64,
    },
    /// The normals point inward; they were turned.
    NormalsTurned,
    /// There are more points than surfaces are made of; some of them, evenly picked, are used.
    PointsThinned {
        /// How many there are.
        points: usize,
        /// How many are used.
        used: usize,
    },
    /// Points far from all others were left out.
    Outliers {
        /// How many.
        points: usize,
    },
    /// Few of the neighbouring normals that were estimated point to the same side.
    NormalsDoubtful {
        /// The share that does.
        agreement: f64,
    },
    /// Splats that are not finite or have no axes were left out.
    SplatsUnsound {
        /// How many.
        splats: usize,
    },
    /// Splats outside the object, or larger than half of it, were left out.
    SplatsFloating {
        /// How many.
        splats: usize,
    },
    /// There are many splats; those that are small and close together were merged.
    SplatsMerged {
        /// How many splats there are.
        splats: usize,
        /// What they were merged into.
        merged: usize,
    },
    /// A checkpoint names classes or functions, which are not run.
    Foreign {
        /// Their names.
        names: Vec<String>,
    },
    /// The file does not say the activation between layers; that of the layout was taken.
    ActivationAssumed {
        /// What was taken, as `--activation` has it, and the frequency of sines.
        activation: String,
    },
    /// A decoder of many shapes was opened without a code.
    NoCode,
    /// The mesh cannot be decimated; its base mesh is made from the isosurface of its winding number.
    NotDecimated {
        /// Why.
        reason: NotDecimated,
    },
    /// An edge length was given for a mesh, which is used as it is.
    EdgeLengthUnused,
    /// A place is away from the surface, whose closest point is taken for it.
    PlaceOff {
        /// The place.
        place: [f64; 3],
        /// How far.
        distance: f64,
    },
    /// Some of the mesh is inside of the solid that it bounds, and left out.
    WallsInside {
        /// The share of the area that is, and is farther than a twentieth of the diagonal from what is kept.
        share: f64,
    },
    /// An isosurface is in more parts than the mesh: what is thinner than the cells of its grid falls apart.
    FallsApart {
        /// Parts of the isosurface.
        parts: usize,
        /// Parts of the mesh.
        of: usize,
    },
    /// The inner sides of a density that is high on a surface were left out of the base mesh.
    InnerWallsLeftOut {
        /// How many.
        walls: usize,
    },
    /// Smaller components of the isosurface were left out of the base mesh.
    PartsLeftOut {
        /// How many.
        parts: usize,
        /// Their share of its area.
        area: f64,
    },
    /// The topology of the surface needs more faces than were asked for.
    FacesNeeded {
        /// Faces of the base mesh.
        faces: usize,
        /// Faces asked for.
        asked: usize,
    },
    /// The mesh has no more faces than were asked for; all of it is the base mesh.
    NothingToDecimate {
        /// Its faces.
        faces: usize,
    },
    /// A network is learned, since something is asked for that levels do not have.
    NetworkNeeded {
        /// What.
        what: &'static str,
    },
    /// The time limit was reached before the last epoch or iteration.
    TimeUp {
        /// Epochs or iterations made.
        rounds: usize,
        /// Those wanted.
        of: usize,
    },
    /// Training diverged and went on at a smaller rate.
    Diverged {
        /// How often.
        times: usize,
    },
    /// No model that was tried is as close to the surface as was asked for.
    ErrorMissed {
        /// The mean distance that was asked for, as a share of the diagonal.
        wanted: f64,
        /// That of the closest one.
        reached: f64,
    },
    /// The search for the smallest model ended early; the best so far is kept.
    SearchStopped {
        /// Why.
        reason: String,
    },
    /// A vertex is so far away that areas and distances are no numbers.
    BeyondReach {
        /// The vertex, counted from 0.
        vertex: usize,
    },
    /// Some of the learned surface is turned against the input.
    Flipped {
        /// How much.
        share: f64,
    },
    /// Some of the learned surface could not be projected onto the input.
    Missed {
        /// How much.
        share: f64,
    },
    /// A note of the reader of a mesh file.
    #[serde(untagged)]
    File(ReadNote),
    /// A repair of the mesh.
    #[serde(untagged)]
    Repair(RepairNote),
}

impl Note {
    /// Notes on the points of a file.
    pub(crate) fn of_points(report: &CleaningReport) -> Vec<Self> {
        let counted = |n: usize, note: fn(usize) -> Self| (n > 0).then(|| note(n));
        let notes = [
            counted(report.flagged, |points| Self::PointsFlagged { points }),
            report.unclear_columns.then_some(Self::UnclearColumns),
            report.numbered.then_some(Self::RowsNumbered),
            counted(report.not_finite, |points| Self::PointsNotFinite { points }),
            counted(report.duplicates, |points| Self::DuplicatePoints { points }),
            counted(report.without_normal, |points| Self::PointsWithoutNormal { points }),
            counted(report.normals_scaled, |normals| Self::NormalsScaled { normals }),
            report.normals_given_up.then_some(Self::NormalsGivenUp),
        ];
        notes.into_iter().flatten().collect()
    }
}

impl From<ReadNote> for Note {
    fn from(note: ReadNote) -> Self {
        Self::File(note)
    }
}

impl From<RepairNote> for Note {
    fn from(note: RepairNote) -> Self {
        Self::Repair(note)
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counted = |n: usize| if n == 1 { "1 point".to_owned() } else { format!("{n} points") };
        match self {
            Self::PointsFlagged { points } => {
                write!(
                    f,
                    "{} marked as withheld or as noise in the file, left out (--keep-flagged keeps them)",
                    counted(*points)
                )
            }
            Self::UnclearColumns => f.write_str(
                "columns 4 to 6 look neither like normals nor like colours, and were passed over; --columns x,y,z,nx,ny,nz takes them for normals",
            ),
            Self::BeyondReach { vertex } => {
                write!(f, "vertex {vertex} lies beyond 1e75, where lengths cannot be computed any more; scale it down")
            }
            Self::OptionUnused { what } => write!(f, "{what}: not used, since the input is something else"),
            Self::RowsNumbered => f.write_str(
                "the first column numbers the rows; the place is taken from columns 2 to 4 (--columns x,y,z takes the first three)",
            ),
            Self::PointsNotFinite { points } => write!(f, "{} not finite, left out", counted(*points)),
            Self::DuplicatePoints { points } => {
                write!(f, "{} in the place of another, merged", counted(*points))
            }
            Self::PointsWithoutNormal { points } => {
                write!(f, "{} without a usable normal, left out", counted(*points))
            }
            Self::NormalsScaled { normals } => {
                let what = if *normals == 1 { "normal" } else { "normals" };
                write!(f, "{normals} {what} not of length 1, scaled")
            },
            Self::NormalsGivenUp => f.write_str("most normals are zero or not finite; all are left out"),
            Self::NormalsDisagree { agreement } => write!(
                f,
                "only {:.0} % of neighbouring normals point to the same side; they are not used",
                100.0 * agreement
            ),
            Self::NormalsTurned => f.write_str("the normals point inward; they are turned"),
            Self::PointsThinned { points, used } => {
                write!(f, "of {} points {} are used, evenly picked", grouped(*points), grouped(*used))
            }
            Self::Outliers { points } => {
                let what = if *points == 1 { "point is" } else { "points are" };
                write!(f, "{} {what} far from all others, and left out", grouped(*points))
            }
            Self::NormalsDoubtful { agreement } => write!(
                f,
                "only {:.0} % of the estimated normals agree with their neighbours; expect holes and handles",
                100.0 * agreement
            ),
            Self::SplatsUnsound { splats } => {
                let what = if *splats == 1 { "splat is" } else { "splats are" };
                write!(f, "{} {what} not finite or without axes, and left out", grouped(*splats))
            }
            Self::SplatsFloating { splats } => {
                let what = if *splats == 1 { "splat is" } else { "splats are" };
                let splats = grouped(*splats);
                write!(f, "{splats} {what} outside the object or larger than half of it, and left out")
            }
            Self::SplatsMerged { splats, merged } => {
                let (of, into) = (grouped(*splats), grouped(*merged));
                write!(f, "small splats that are close together were merged: {into} instead of {of}")
            }
            Self::Foreign { names } => {
                let shown = names.iter().take(MAX_NAMES).map(String::as_str).collect::<Vec<_>>().join(", ");
                let rest = names.len().saturating_sub(MAX_NAMES);
                let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
                write!(f, "it refers to {shown}{more}, which is not run; only tensors are taken from it")
            }
            Self::ActivationAssumed { activation } => write!(
                f,
                "the file does not say which activation the network has; {activation} is assumed (--activation and --omega set it)"
            ),
            Self::NoCode => {
                f.write_str("a decoder of many shapes; without a code it is the one with the code 0")
            }
            Self::NotDecimated { reason } => {
                write!(f, "{reason}; the base mesh is made from the isosurface of its winding number")
            }
            Self::EdgeLengthUnused => {
                f.write_str("it is a mesh, used as it is; the edge length is for models")
            }
            Self::PlaceOff { place, distance } => write!(
                f,
                "({}, {}, {}) is {} away from the surface; the closest point of the surface is taken",
                place[0],
                place[1],
                place[2],
                readable(*distance)
            ),
            Self::WallsInside { share } => write!(
                f,
                "at least {:.1} % of its area is inside of the solid that it bounds, and left out",
                100.0 * share
            ),
            Self::FallsApart { parts, of } => write!(
                f,
                "its isosurface is in {parts} parts, {of} of the mesh: what is thinner than a cell of the grid falls apart; take a finer one"
            ),
            Self::InnerWallsLeftOut { walls } => {
                let what = if *walls == 1 { "wall" } else { "walls" };
                write!(f, "{walls} inner {what} of the density left out: the surface is the outer side")
            }
            Self::PartsLeftOut { parts: 1, area } => {
                write!(f, "1 smaller part ({:.1} % of the area) is left out", 100.0 * area)
            }
            Self::PartsLeftOut { parts, area } => {
                write!(f, "{parts} smaller parts ({:.1} % of the area) are left out", 100.0 * area)
            }
            Self::FacesNeeded { faces, asked } => {
                write!(f, "the topology needs {faces} faces, more than {asked} asked for")
            }
            Self::NothingToDecimate { faces } => {
                let what = if *faces == 1 { "face" } else { "faces" };
                write!(f, "it has no more than {faces} {what}; all of it is the base mesh")
            }
            Self::NetworkNeeded { what } => {
                write!(f, "it is learned as a network, since levels have no {what}")
            }
            Self::TimeUp { rounds, of } => {
                write!(f, "the time limit was reached after {rounds} of {of} rounds of training")
            }
            Self::Diverged { times } => {
                let how_often = if *times == 1 { "once".to_owned() } else { format!("{times} times") };
                write!(f, "training diverged {how_often} and went on at a smaller rate")
            }
            Self::ErrorMissed { wanted, reached } => write!(
                f,
                "no model that was tried comes as close as {:.4} % of the diagonal; the closest has {:.4} %",
                100.0 * wanted,
                100.0 * reached
            ),
            Self::SearchStopped { reason } => {
                write!(f, "no further sizes were tried ({reason}); the best model so far is kept")
            }
            Self::Flipped { share } => {
                write!(f, "{:.1} % of the learned surface is turned against the input", 100.0 * share)
            }
            Self::Missed { share } => {
                write!(
                    f,
                    "{:.1} % of the learned surface could not be projected onto the input",
                    100.0 * share
                )
            }
            Self::File(note) => note.fmt(f),
            Self::Repair(note) => note.fmt(f),
        }
    }
}

/// Why a mesh cannot be decimated to a base mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "reason", rename_all = "snake_case")]
#[non_exhaustive]
pub enum NotDecimated {
    /// It is in pieces whose borders lie side by side.
    InPieces {
        /// How many.
        pieces: usize,
        /// The share of the area that the largest has.
        largest: f64,
    },
    /// Some of its pieces are inside of others.
    Overlapping {
        /// How many pieces it has.
        pieces: usize,
        /// The share of the area that the largest has.
        largest: f64,
    },
    /// It cannot be repaired to be a manifold.
    NotManifold {
        /// What is still wrong with it.
        report: Box<ValidationReport>,
    },
}

impl From<NotManifold> for NotDecimated {
    fn from(NotManifold(report): NotManifold) -> Self {
        Self::NotManifold { report }
    }
}

impl fmt::Display for NotDecimated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InPieces { pieces, largest } => write!(
                f,
                "it is in {pieces} pieces with borders side by side, the largest with {:.0} % of the area",
                100.0 * largest
            ),
            Self::Overlapping { pieces, largest } => write!(
                f,
                "it is in {pieces} pieces of which some are inside of others, the largest with {:.0} % of the area",
                100.0 * largest
            ),
            Self::NotManifold { report } => NotManifold(report.clone()).fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_are_flat_objects() {
        let note = serde_json::to_value(Note::Flipped { share: 0.25 }).unwrap();
        assert_eq!(note, serde_json::json!({"note": "flipped", "share": 0.25}));
        let note = serde_json::to_value(Note::from(RepairNote::UnusableFaces { faces: 2 })).unwrap();
        assert_eq!(note, serde_json::json!({"note": "unusable_faces", "faces": 2}));
    }
}
