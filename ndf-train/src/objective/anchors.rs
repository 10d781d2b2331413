//! Anchors: points of the base mesh that must go to given places.

use ndf_core::DVec3;
use ndf_model::file::StoredBase;
use serde_json::Value;

use super::{Block, FixedPoints, Gradients, PointTarget, Term};

/// ‖g(x) − q‖² over pairs of a point x of the base mesh and the place q of its image (supplement, Eq. 3).
#[derive(Clone, Debug)]
pub struct Anchors {
    points: FixedPoints,
}

impl Anchors {
    /// Anchors at the points of the base mesh closest to the first of each pair; the second is where the image should
    /// be. Both are in the coordinates of the surface. Pairs that are not finite are left out.
    pub fn new(base: &StoredBase, pairs: &[(DVec3, DVec3)]) -> Self {
        Self { points: FixedPoints::new(base, pairs) }
    }
}

impl Term for Anchors {
    fn name(&self) -> &str {
        "anchors"
    }

    fn points(&self) -> Option<&FixedPoints> {
        Some(&self.points)
    }

    fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64 {
        PointTarget.accumulate(block, weight, gradients)
    }

    /// A checksum of the points.
    fn state(&self) -> Value {
        let mut sum = crc32fast::Hasher::new();
        for (place, target) in self.points.places.iter().zip(&self.points.targets) {
            sum.update(&place.face.0.to_le_bytes());
            let numbers = place.barycentric.into_iter().chain(target.foot.to_array());
            numbers.for_each(|x| sum.update(&x.to_le_bytes()));
        }
        sum.finalize().into()
    }
}
