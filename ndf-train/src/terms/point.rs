//! Distance to given points.

use super::{LossTerm, SampleGradients, Samples, add_scaled};

/// ‖g(x) − q‖² with q the foot of the target: the anchors of the supplement's Eq. 3, and the identity stage of its
/// Eq. 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointTarget;

impl LossTerm for PointTarget {
    fn name(&self) -> &'static str {
        "point"
    }

    fn accumulate(&self, samples: &Samples<'_>, weight: f32, gradients: &mut SampleGradients<'_>) -> f64 {
        let mut sum = 0.0;
        for ((y, target), dy) in samples.points.iter().zip(samples.targets).zip(gradients.points.iter_mut()) {
            if target.normal == [0.0; 3] {
                continue;
            }
            let away = [y[0] - target.foot[0], y[1] - target.foot[1], y[2] - target.foot[2]];
            sum += away.iter().map(|x| x * x).sum::<f32>();
            add_scaled(dy, 2.0 * weight, away);
        }
        f64::from(sum)
    }
}
