//! Distance to the surface.

use super::{Block, Gradients, Term};

/// L_P: ‖g(x) − P(g(x), n)‖² with the surface taken as its plane at the last foot, so that it stays exact to second
/// order while the image moves between projections. Images slide along the surface freely.
#[derive(Clone, Copy, Debug, Default)]
pub struct ProjectionDistance;

impl Term for ProjectionDistance {
    fn name(&self) -> &str {
        "projection"
    }

    fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64 {
        let mut sum = 0.0;
        for ((y, target), dy) in block.images.iter().zip(block.targets).zip(gradients.images.iter_mut()) {
            let away = *y - target.foot;
            // Zero where there is no foot, since the normal is.
            let height = target.normal.dot(away);
            sum += height * height;
            *dy += 2.0 * weight * height * target.normal;
        }
        f64::from(sum)
    }
}
