//! Smoothness.

use super::{LossTerm, SampleGradients, Samples, add_scaled, dot};

/// L_D: ‖J‖²_F, the Dirichlet energy density.
#[derive(Clone, Copy, Debug, Default)]
pub struct Dirichlet;

impl LossTerm for Dirichlet {
    fn name(&self) -> &'static str {
        "dirichlet"
    }

    fn needs_tangents(&self) -> bool {
        true
    }

    fn accumulate(&self, samples: &Samples<'_>, weight: f32, gradients: &mut SampleGradients<'_>) -> f64 {
        let mut sum = 0.0;
        for (tangents, gradients) in samples.tangents.iter().zip(&mut gradients.tangents) {
            for (t, dt) in tangents.iter().zip(gradients.iter_mut()) {
                sum += dot(*t, *t);
                add_scaled(dt, 2.0 * weight, *t);
            }
        }
        f64::from(sum)
    }
}
