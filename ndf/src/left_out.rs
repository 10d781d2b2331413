//! How much of a surface may be left out.

use ndf_mesh::repair::Parts;

/// More than this share of the area is not left out unless that is wanted.
pub const MAX_LEFT_OUT: f64 = 0.05;

/// Too much of a surface would be left out.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{:.1} % of the area would be left out: small parts, sheets beside a solid, or faces whose corners are not finite", 100.0 * .share)]
pub struct LeftOut {
    /// The share, from 0 to 1.
    pub share: f64,
}

/// Refuses to leave out more than a twentieth, unless the largest component is all that is wanted.
///
/// # Errors
/// If it is more.
pub fn check_left_out(share: f64, parts: Parts) -> Result<(), LeftOut> {
    if share > MAX_LEFT_OUT && parts != Parts::Largest { Err(LeftOut { share }) } else { Ok(()) }
}
