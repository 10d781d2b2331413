//! What a displacement field makes of a point of its base mesh.

use ndf_core::DVec3;

/// A point of the learned surface and the surface's tangents there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mapped {
    /// g(x).
    pub point: DVec3,
    /// J u and J v, where u and v are the edges of the base face from its corner 0 to corners 1 and 2.
    pub tangents: [DVec3; 2],
}

impl Mapped {
    /// Unit normal of the learned surface, or zero where the tangents are parallel.
    pub fn normal(&self) -> DVec3 {
        self.tangents[0].cross(self.tangents[1]).normalize_or_zero()
    }
}
