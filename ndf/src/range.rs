//! Which coordinates can be computed with.

use ndf_core::{BoundingBox, DVec3};

/// Products of four lengths are computed, which have a range of 1e±308.
const LIMIT: f64 = 1e75;

/// Points whose distances cannot be computed in double precision.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "its points span {extent:.1e}, and lie up to {farthest:.1e} from the origin: lengths cannot be computed beyond 1e75 and below 1e-75; scale them"
)]
pub struct OutOfRange {
    /// The diagonal of the points.
    pub extent: f64,
    /// The largest coordinate.
    pub farthest: f64,
}

/// Refuses points of which lengths and their squares cannot be computed.
///
/// # Errors
/// If a coordinate is beyond 1e75, or all points lie within 1e-75.
pub fn check_range(points: &[DVec3]) -> Result<(), OutOfRange> {
    let bounds = BoundingBox::of_points(points);
    let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
    let extent = (bounds.extent() / farthest.max(f64::MIN_POSITIVE)).length() * farthest;
    // Points all in one place are told of elsewhere: nothing is to be scaled there.
    let is_tiny = extent > 0.0 && extent < LIMIT.recip();
    if farthest > LIMIT || is_tiny { Err(OutOfRange { extent, farthest }) } else { Ok(()) }
}
