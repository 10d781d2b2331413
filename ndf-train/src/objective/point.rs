//! Distance to given points.

use super::{Block, Gradients, Term};

/// ‖g(x) − q‖² with q the foot of the target: in the identity stage (supplement, Eq. 1), x itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointTarget;

impl Term for PointTarget {
    fn name(&self) -> &str {
        "point"
    }

    fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64 {
        let mut sum = 0.0;
        for ((y, target), dy) in block.images.iter().zip(block.targets).zip(gradients.images.iter_mut()) {
            if !target.is_found() {
                continue;
            }
            let away = *y - target.foot;
            sum += away.length_squared();
            *dy += 2.0 * weight * away;
        }
        f64::from(sum)
    }
}
