//! Distance to the surface.

use super::{LossTerm, SampleGradients, Samples, add_scaled, dot};

/// L_P: ‖g(x) − P(g(x), n)‖² with the surface taken as its plane at the last foot, so that it stays exact to second
/// order while the image moves between projections. Images slide along the surface freely.
#[derive(Clone, Copy, Debug, Default)]
pub struct ProjectionDistance;

impl LossTerm for ProjectionDistance {
    fn name(&self) -> &'static str {
        "projection"
    }

    fn accumulate(&self, samples: &Samples<'_>, weight: f32, gradients: &mut SampleGradients<'_>) -> f64 {
        let mut sum = 0.0;
        for ((y, target), dy) in samples.points.iter().zip(samples.targets).zip(gradients.points.iter_mut()) {
            let away = [y[0] - target.foot[0], y[1] - target.foot[1], y[2] - target.foot[2]];
            // Zero where there is no foot, since the normal is.
            let height = dot(target.normal, away);
            sum += height * height;
            add_scaled(dy, 2.0 * weight * height, target.normal);
        }
        f64::from(sum)
    }
}
