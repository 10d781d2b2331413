//! Smoothness.

use super::{Block, Gradients, Needs, Term};

/// L_D: ‖J‖²_F, the Dirichlet energy density.
#[derive(Clone, Copy, Debug, Default)]
pub struct Dirichlet;

impl Term for Dirichlet {
    fn name(&self) -> &str {
        "dirichlet"
    }

    fn needs(&self) -> Needs {
        Needs::TANGENTS
    }

    fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64 {
        let mut sum = 0.0;
        for (tangents, gradients) in block.tangents.iter().zip(&mut gradients.tangents) {
            for (t, dt) in tangents.iter().zip(gradients.iter_mut()) {
                sum += t.length_squared();
                *dt += 2.0 * weight * *t;
            }
        }
        f64::from(sum)
    }
}
