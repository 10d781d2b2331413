//! What single precision does to positions.

use ndf_core::{BoundingBox, DVec3};

/// The share of the diagonal by which single precision may move a vertex.
const MAX_MOVE: f64 = 1e-6;

/// What rounding did to the positions of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rounding {
    /// The largest distance by which a vertex moved.
    pub moved: f64,
    /// The same as a share of the diagonal.
    pub share: f64,
}

impl Rounding {
    /// What single precision does to these positions.
    pub fn to_single(positions: &[DVec3]) -> Self {
        Self::about(positions, DVec3::ZERO)
    }

    /// What single precision does to these positions relative to `origin`.
    pub(super) fn about(positions: &[DVec3], origin: DVec3) -> Self {
        let moved = |p: &DVec3| {
            let relative = *p - origin;
            relative.distance(relative.as_vec3().as_dvec3())
        };
        let moved = positions.iter().map(moved).fold(0.0, f64::max);
        let diagonal = BoundingBox::of_points(positions).diagonal();
        Self { moved, share: if moved > 0.0 { moved / diagonal } else { 0.0 } }
    }

    /// Whether vertices moved by more than a millionth of the diagonal.
    pub fn is_coarse(&self) -> bool {
        self.share > MAX_MOVE
    }
}
