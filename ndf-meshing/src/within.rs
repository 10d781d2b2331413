//! Decimation and isotropic remeshing as far as a distance allows.
//!
//! A distance is what [`measure`](ndf_mesh::metrics::measure) finds between the input and the result: the largest over samples and vertices of both, which
//! approaches the Hausdorff distance from below.

use ndf_core::{Cancelled, Progress};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::metrics::{MeasureError, MeasureOptions, Measurement, measure_with};

use crate::decimation::{Decimated, Decimation, DecimationOptions};
use crate::isotropic::{IsotropicError, IsotropicOptions, remesh_isotropically};

/// The search for a number of faces ends when as few as this share of those that are left are open.
const CLOSE: f64 = 0.01;

/// The first edge length that is tried, as a share of the diagonal, and the factor to the next.
const LONGEST: f64 = 0.1;
const SHORTER: f64 = 0.7;
/// How often the interval of edge lengths is halved.
const HALVINGS: u32 = 3;

/// Why there is no mesh within a distance.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum WithinError {
    /// The distance is not a positive number.
    #[error("the distance {0} is not a positive number")]
    Distance(f64),
    /// The mesh cannot be measured.
    #[error(transparent)]
    Measure(MeasureError),
    /// Edges as short as they would have to be make too many faces.
    #[error("edges as short as a distance of {0} asks for make too many faces")]
    Edges(f64),
    /// The observer asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The mesh of the fewest faces, to about a hundredth, and no fewer than `options` ask for, that is no farther from the input
/// than `distance`. Also what it measures.
///
/// Decimation to fewer faces goes through those to more: halving finds the first number of faces that is too few, bisection the
/// last that is enough. Some twenty measurements beside the decimation.
///
/// # Errors
/// If the distance is not positive, the mesh has no area, or the work was cancelled.
pub fn decimate_within(
    mesh: &ManifoldMesh,
    distance: f64,
    options: &DecimationOptions,
    sampling: &MeasureOptions,
    progress: &dyn Progress,
) -> Result<(Decimated, Measurement), WithinError> {
    check(distance)?;
    let mut enough = Decimation::new(mesh, options);
    let (mut best, mut of_best) = (enough.decimated(), measured(mesh, mesh, sampling, progress)?);
    let mut too_few = options.faces.saturating_sub(1);
    let mut is_halving = true;
    loop {
        let faces = best.mesh.face_count();
        let next = if is_halving { faces / 2 } else { usize::midpoint(faces, too_few) }.max(too_few + 1);
        if next >= faces || (!is_halving && (faces - next) as f64 <= CLOSE * faces as f64) {
            break;
        }
        let mut tried = enough.clone();
        tried.run(next, progress)?;
        let found = tried.decimated();
        let of_found = measured(mesh, &found.mesh, sampling, progress)?;
        let left = found.mesh.face_count();
        if of_found.hausdorff > distance {
            (too_few, is_halving) = (next, false);
            continue;
        }
        (enough, best, of_best) = (tried, found, of_found);
        if left > next {
            // Topology and shape need what is left.
            break;
        }
    }
    Ok((best, of_best))
}

/// The isotropic mesh of the longest edges, to about a twentieth, that is no farther from the input than `distance`, the edge
/// length, and what the mesh measures. The length in `options` is the longest that is tried, if it is finite.
///
/// # Errors
/// If the distance is not positive or too small, the mesh has no area, or the work was cancelled.
pub fn remesh_within(
    mesh: &ManifoldMesh,
    distance: f64,
    options: &IsotropicOptions,
    sampling: &MeasureOptions,
    progress: &dyn Progress,
) -> Result<(ManifoldMesh, f64, Measurement), WithinError> {
    check(distance)?;
    let of_length = |edge_length: f64| {
        let options = IsotropicOptions { edge_length, ..*options };
        let found = remesh_isotropically(mesh, None, &options, progress).map_err(|error| match error {
            IsotropicError::EdgeLength(_) => WithinError::Edges(distance),
            IsotropicError::Cancelled(cancelled) => cancelled.into(),
        })?;
        let of_found = measured(mesh, &found, sampling, progress)?;
        Ok::<_, WithinError>((of_found.hausdorff <= distance).then_some((found, edge_length, of_found)))
    };
    let mut length = (LONGEST * mesh.bounds().diagonal()).min(options.edge_length);
    let mut too_long = None;
    let mut best = loop {
        if let Some(found) = of_length(length)? {
            break found;
        }
        too_long = Some(length);
        length *= SHORTER;
    };
    let Some(mut too_long) = too_long else { return Ok(best) };
    for _ in 0..HALVINGS {
        let middle = 0.5 * (best.1 + too_long);
        match of_length(middle)? {
            Some(found) => best = found,
            None => too_long = middle,
        }
    }
    Ok(best)
}

fn measured(
    mesh: &ManifoldMesh,
    found: &ManifoldMesh,
    sampling: &MeasureOptions,
    progress: &dyn Progress,
) -> Result<Measurement, WithinError> {
    measure_with(mesh, found, sampling, progress).map_err(|error| match error {
        MeasureError::Cancelled(cancelled) => cancelled.into(),
        error => WithinError::Measure(error),
    })
}

fn check(distance: f64) -> Result<(), WithinError> {
    if distance.is_finite() && distance > 0.0 { Ok(()) } else { Err(WithinError::Distance(distance)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_core::NoProgress;
    use ndf_mesh::{ValidationReport, shapes};

    fn ball() -> ManifoldMesh {
        ManifoldMesh::try_from(shapes::icosphere(5)).unwrap()
    }

    /// Equilateral faces with edges h, of which the unit sphere has 4 π / (√3/4 h²), are at best h² / 12 from it on both sides.
    #[test]
    fn decimation_keeps_a_distance() {
        let (ball, sampling) = (ball(), MeasureOptions::default());
        let options = DecimationOptions::to_faces(4);
        let mut before = usize::MAX;
        for bound in [0.001, 0.004, 0.016] {
            let (found, measured) = decimate_within(&ball, bound, &options, &sampling, &NoProgress).unwrap();
            assert!(measured.hausdorff <= bound && measured.hausdorff > 0.3 * bound, "{measured:?}");
            let faces = found.mesh.face_count();
            assert!(faces < before && (2.4..10.0).contains(&(faces as f64 * bound)), "{faces}");
            let report = ValidationReport::of(&found.mesh);
            assert!(report.is_oriented_manifold() && report.euler_characteristic == 2);
            let at_once = crate::decimate(&ball, &DecimationOptions::to_faces(faces), &NoProgress);
            assert_eq!(at_once.mesh.positions(), found.mesh.positions());
            before = faces;
        }
    }

    /// Vertices are on the sphere, hence faces up to h² / 6 from it.
    #[test]
    fn remeshing_keeps_a_distance() {
        let (ball, sampling) = (ball(), MeasureOptions::default());
        let options = IsotropicOptions::with_edges_of(f64::INFINITY);
        for bound in [0.004, 0.016] {
            let (found, length, measured) =
                remesh_within(&ball, bound, &options, &sampling, &NoProgress).unwrap();
            assert!(measured.hausdorff <= bound, "{measured:?}");
            assert!((0.5..1.5).contains(&(length / (6.0 * bound).sqrt())), "{length} for {bound}");
            assert!(ValidationReport::of(&found).is_oriented_manifold());
        }
    }

    #[test]
    fn distances_are_positive() {
        let (ball, sampling) = (ball(), MeasureOptions::default());
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let options = DecimationOptions::to_faces(4);
            assert!(decimate_within(&ball, wrong, &options, &sampling, &NoProgress).is_err());
            let options = IsotropicOptions::with_edges_of(1.0);
            assert!(remesh_within(&ball, wrong, &options, &sampling, &NoProgress).is_err());
        }
    }
}
