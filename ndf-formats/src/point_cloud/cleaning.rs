//! From what a file holds to points that can be computed with.

use ndf_core::{BoundingBox, DVec3};
use ndf_mesh::first_in_place;

/// Fewest points that mean a surface.
const FEWEST: usize = 4;

/// Share of the points without a usable normal from which all normals are given up.
const HOPELESS: f64 = 0.5;

/// How far the length of a normal may be from 1 to count as unit.
const UNIT: f64 = 1e-3;

/// Points as they stand in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawCloud {
    /// Places, finite or not.
    pub positions: Vec<DVec3>,
    /// Normals of any length, one a point, if the file has any.
    pub normals: Option<Vec<DVec3>>,
    /// Points that the file marks as withheld or as noise; they are not among the others.
    pub flagged: usize,
    /// Whether there are columns that may be normals, and were not read as such.
    pub unclear_columns: bool,
    /// Whether the first column was told to be the number of the row.
    pub numbered: bool,
}

/// Distinct finite points, with unit normals or without.
#[derive(Clone, Debug, PartialEq)]
pub struct PointCloud {
    positions: Vec<DVec3>,
    normals: Option<Vec<DVec3>>,
}

/// What was left out or changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CleaningReport {
    /// Points in the file.
    pub read: usize,
    /// Points that the file marks as withheld or as noise, left out.
    pub flagged: usize,
    /// Whether there are columns that may be normals, and were not read as such.
    pub unclear_columns: bool,
    /// Whether the first column was told to be the number of the row.
    pub numbered: bool,
    /// Points that were not finite, and left out.
    pub not_finite: usize,
    /// Points in the very place of an earlier one, merged with it.
    pub duplicates: usize,
    /// Points whose normal was zero or not finite, left out.
    pub without_normal: usize,
    /// Normals that were not of length 1, and scaled.
    pub normals_scaled: usize,
    /// Whether most normals were unusable, and all of them left out.
    pub normals_given_up: bool,
}

/// A cloud with too few usable points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.sentence())]
pub struct TooFewPoints {
    /// Points that the file marks as withheld or as noise.
    pub flagged: usize,
    /// Points in the file.
    pub read: usize,
    /// Those that are finite and distinct.
    pub kept: usize,
}

impl TooFewPoints {
    fn sentence(&self) -> String {
        let Self { flagged, read, kept } = self;
        let marked = match flagged {
            0 => String::new(),
            _ => format!(" ({flagged} others are marked as withheld or as noise)"),
        };
        match read {
            0 => "it holds no points".to_owned(),
            _ => format!(
                "{kept} of {read} points are usable{marked}; a surface needs at least {FEWEST} distinct finite points"
            ),
        }
    }
}

impl PointCloud {
    /// Leaves out what cannot be used: points that are not finite, have no normal where most have one, or lie in the
    /// very place of another. The others keep their order. O(n).
    ///
    /// # Errors
    /// If fewer than 4 points are left.
    pub fn cleaned(raw: RawCloud) -> Result<(Self, CleaningReport), TooFewPoints> {
        let RawCloud { positions, normals, flagged, unclear_columns, numbered } = raw;
        let read = positions.len() + flagged;
        let mut report =
            CleaningReport { read, flagged, unclear_columns, numbered, ..CleaningReport::default() };
        let usable = |n: &DVec3| n.is_finite() && n.length() > 0.0;
        let mut kept: Vec<usize> = (0..positions.len()).filter(|&i| positions[i].is_finite()).collect();
        report.not_finite = positions.len() - kept.len();
        let normals = normals.filter(|normals| {
            let lacking = kept.iter().filter(|&&i| !usable(&normals[i])).count();
            report.normals_given_up = lacking as f64 > HOPELESS * kept.len() as f64;
            !report.normals_given_up
        });
        if let Some(normals) = &normals {
            let before = kept.len();
            kept.retain(|&i| usable(&normals[i]));
            report.without_normal = before - kept.len();
            report.normals_scaled =
                kept.iter().filter(|&&i| (normals[i].length() - 1.0).abs() > UNIT).count();
        }
        let finite: Vec<DVec3> = kept.iter().map(|&i| positions[i]).collect();
        drop(positions);
        let first = first_in_place(&finite);
        let is_first: Vec<bool> = (0..).zip(&first).map(|(i, &first)| i == first).collect();
        report.duplicates = is_first.iter().filter(|is_first| !**is_first).count();
        let distinct = finite.len() - report.duplicates;
        if distinct < FEWEST {
            return Err(TooFewPoints { flagged, read, kept: distinct });
        }
        let normals = normals.map(|normals| {
            let normals: Vec<DVec3> = kept.iter().map(|&i| normals[i]).collect();
            // The points of the same place, together; in the order of their first points.
            let mut order: Vec<usize> = (0..normals.len()).collect();
            if report.duplicates > 0 {
                order.sort_by_key(|&i| first[i]);
            }
            order.chunk_by(|&i, &j| first[i] == first[j]).map(|group| mean(&normals, group)).collect()
        });
        let mut is_first = is_first.into_iter();
        let mut positions = finite;
        positions.retain(|_| is_first.next() == Some(true));
        Ok((Self { positions, normals }, report))
    }

    /// Places, distinct and finite.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Unit normals, one a point, if there are any.
    pub fn normals(&self) -> Option<&[DVec3]> {
        self.normals.as_deref()
    }

    /// The same points with other normals, which are scaled to length 1.
    ///
    /// # Panics
    /// If there is not one for each point, or one has no direction.
    #[must_use]
    pub fn with_normals(self, normals: Vec<DVec3>) -> Self {
        assert_eq!(normals.len(), self.positions.len());
        let normals = normals.into_iter().map(|n| n.try_normalize().expect("normals have directions"));
        Self { normals: Some(normals.collect()), ..self }
    }

    /// The same points without normals.
    #[must_use]
    pub fn without_normals(self) -> Self {
        Self { normals: None, ..self }
    }

    /// The points for whose numbers `keep` holds.
    #[must_use]
    pub fn retained(self, keep: impl Fn(usize) -> bool) -> Self {
        let kept = |all: Vec<DVec3>| (0..).zip(all).filter(|&(i, _)| keep(i)).map(|(_, v)| v).collect();
        Self { positions: kept(self.positions), normals: self.normals.map(kept) }
    }

    /// The box around all points.
    pub fn bounds(&self) -> BoundingBox {
        BoundingBox::of_points(&self.positions)
    }
}

/// The direction of the mean normal of points in the same place; that of the first where they cancel.
fn mean(normals: &[DVec3], group: &[usize]) -> DVec3 {
    let unit = |i: usize| normals[i].normalize();
    let sum: DVec3 = group.iter().map(|&i| unit(i)).sum();
    sum.try_normalize().filter(|_| sum.length() > 1e-6).unwrap_or_else(|| unit(group[0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raw(positions: &[[f64; 3]], normals: Option<&[[f64; 3]]>) -> RawCloud {
        let vectors = |all: &[[f64; 3]]| all.iter().map(|&p| DVec3::from_array(p)).collect();
        RawCloud { positions: vectors(positions), normals: normals.map(vectors), ..RawCloud::default() }
    }

    #[test]
    fn what_cannot_be_used_is_left_out_and_counted() {
        let nan = f64::NAN;
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [nan, 0.0, 0.0],
            [-0.0, 0.0, 0.0],
            [0.0, 2.0, 0.0],
            [0.0, 0.0, 3.0],
            [5.0, 0.0, 0.0],
            [0.0, 0.0, f64::INFINITY],
        ];
        let z = [0.0, 0.0, 1.0];
        let normals = [z, [0.0, 0.0, 7.0], z, [1.0, 0.0, 0.0], z, z, [0.0, 0.0, 0.0], z];
        let (cloud, report) = PointCloud::cleaned(raw(&positions, Some(&normals))).unwrap();
        assert_eq!(
            report,
            CleaningReport {
                read: 8,
                flagged: 0,
                unclear_columns: false,
                numbered: false,
                not_finite: 2,
                duplicates: 1,
                without_normal: 1,
                normals_scaled: 1,
                normals_given_up: false
            }
        );
        assert_eq!(cloud.positions().len(), 4);
        assert_eq!(cloud.positions()[1], DVec3::X);
        let slanted = DVec3::new(1.0, 0.0, 1.0).normalize();
        assert!(cloud.normals().unwrap()[0].distance(slanted) < 1e-12);
        assert_eq!(cloud.bounds().max, DVec3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn mostly_missing_normals_are_given_up() {
        let positions = [[0.0; 3], [1.0; 3], [2.0; 3], [3.0; 3]];
        let normals = [[0.0; 3], [0.0; 3], [f64::NAN; 3], [0.0, 0.0, 1.0]];
        let (cloud, report) = PointCloud::cleaned(raw(&positions, Some(&normals))).unwrap();
        assert!(cloud.normals().is_none() && report.normals_given_up && report.without_normal == 0);
    }

    #[test]
    fn too_few_points_are_refused() {
        let error = PointCloud::cleaned(raw(&[[1.0; 3]; 100], None)).unwrap_err();
        assert_eq!(error, TooFewPoints { flagged: 0, read: 100, kept: 1 });
        assert!(PointCloud::cleaned(RawCloud::default()).is_err());
    }
}
