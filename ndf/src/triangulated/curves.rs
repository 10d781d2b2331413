//! Signed distances from curves, and centres of places, told at the vertices and faces of the file.

use ndf_core::{DVec3, Progress};
use ndf_fields::{
    CentreKind, FieldError, SignedHeatOptions, ZeroSet, geodesic_centre, joined_curve, signed_distances,
};
use ndf_mesh::{FacePoint, SurfacePoint, Vertex};

use super::solver::MAX_TIME_STEP;
use super::{HeatReport, Place, SurfaceFieldError, SurfaceFields};
use crate::Note;

/// Steps after which the search for a centre is given up.
const MOST_STEPS: usize = 200;

/// What signed distances are measured from, and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SignedDistanceOptions {
    /// Curves through places, in order: from each to the next straight where a face has both, and by a shortest path otherwise. The
    /// distance is negative on their left.
    pub curves: Vec<Vec<Place>>,
    /// Places whose distance has no sign, each at the nearest corner of its face.
    pub points: Vec<Place>,
    /// What is zero.
    pub zero_set: ZeroSet,
    /// How long normals diffuse, in squared mean edge lengths. If nothing is given 1/4, or the least of its products with a power of four
    /// that reaches every vertex.
    pub time_step: Option<f64>,
}

/// Signed distances over a surface, in its units.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SignedDistance {
    /// Of every vertex of the [mesh](super::Triangulated::mesh); +∞ where no source reaches, and at vertices that no face uses.
    pub values: Vec<f64>,
    /// The length of all curves.
    pub curve_length: f64,
    /// How the heat method went.
    pub heat: HeatReport,
    /// What is doubtful: places far from the surface.
    pub notes: Vec<Note>,
}

/// A centre of places on a surface.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SurfaceCentre {
    /// Where it is, as a point of a face of the [mesh](super::Triangulated::mesh).
    pub point: FacePoint,
    /// The same in space.
    pub position: DVec3,
    /// The weighted mean of the squared distances of the places.
    pub variance: f64,
    /// The weighted mean of the distances.
    pub mean_distance: f64,
    /// The largest distance.
    pub max_distance: f64,
    /// Steps that were taken.
    pub iterations: usize,
    /// Whether the search came to an end.
    pub has_converged: bool,
    /// What is doubtful: places far from the surface.
    pub notes: Vec<Note>,
}

impl SurfaceFields<'_> {
    /// Signed distances of all vertices from oriented curves and from places without sides. See [`signed_distances`].
    ///
    /// # Errors
    /// If there is no source, a place is not on the surface, no path joins two places of a curve, the surface is too distorted for double
    /// precision, or the observer asks to stop.
    pub fn signed_distance(
        &self,
        options: &SignedDistanceOptions,
        progress: &dyn Progress,
    ) -> Result<SignedDistance, SurfaceFieldError> {
        let mut notes = Vec::new();
        let working = self.working();
        let mut curves = Vec::new();
        for curve in &options.curves {
            let mut points = Vec::new();
            for &place in curve {
                // Of several points that are one place, any will do.
                points.extend(working.points(place, &mut notes)?.first().copied());
            }
            curves.push(joined_curve(&self.mesh, &points, progress)?);
        }
        let mut points: Vec<Vertex> = Vec::new();
        for &place in &options.points {
            points.extend(working.points(place, &mut notes)?.into_iter().map(|point| working.corner(point)));
        }
        let asked = SignedHeatOptions { zero_set: options.zero_set, ..SignedHeatOptions::default() };
        let mut time = options.time_step.unwrap_or(asked.time);
        let found = loop {
            let found = signed_distances(
                &self.mesh,
                &curves,
                &points,
                &SignedHeatOptions { time, ..asked },
                progress,
            )?;
            if found.out_of_reach == 0 || options.time_step.is_some() || time >= MAX_TIME_STEP {
                break found;
            }
            time *= 4.0;
        };
        let heat = HeatReport { time_step: time, out_of_reach: found.out_of_reach };
        let values = self.to_file(&found.values, f64::INFINITY);
        Ok(SignedDistance { values, curve_length: found.curve_length, heat, notes })
    }

    /// A centre of weighted places, which is a local one: see [`geodesic_centre`].
    ///
    /// # Errors
    /// If there is no place, one is not on the surface, a weight is not positive, there is no path between two places, the surface is too
    /// distorted for double precision, or the observer asks to stop.
    pub fn centre(
        &self,
        places: &[(Place, f64)],
        kind: CentreKind,
        progress: &dyn Progress,
    ) -> Result<SurfaceCentre, SurfaceFieldError> {
        let mut notes = Vec::new();
        let working = self.working();
        let mut points: Vec<(SurfacePoint, f64)> = Vec::new();
        for &(place, weight) in places {
            points.extend(working.points(place, &mut notes)?.first().map(|&point| (point, weight)));
        }
        if points.is_empty() {
            return Err(FieldError::NoSource.into());
        }
        let found = geodesic_centre(&self.mesh, &points, kind, MOST_STEPS, progress)?;
        let point = working.on_file(found.point);
        Ok(SurfaceCentre {
            point,
            position: point.position(self.surface.mesh()),
            variance: found.variance,
            mean_distance: found.mean_distance,
            max_distance: found.max_distance,
            iterations: found.iterations,
            has_converged: found.has_converged,
            notes,
        })
    }
}
