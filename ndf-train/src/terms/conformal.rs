//! Local conformality.

use super::{LossTerm, SampleGradients, Samples, add_scaled, cross, dot};

/// L_F (supplement, Eq. 6): χ(−det J / tr JᵀJ) with χ(t) = log(1 + e^{10 t}) / 10. The determinant has the sign of the
/// orientation against the surface's normal at the foot: det J = n_Ω · (J u × J v), so that folds count as negative.
#[derive(Clone, Copy, Debug, Default)]
pub struct Conformal;

/// Below this ‖J‖²_F a sample has collapsed to a point and is left out.
const LEAST_TRACE: f32 = 1e-12;

impl LossTerm for Conformal {
    fn name(&self) -> &'static str {
        "conformal"
    }

    fn needs_tangents(&self) -> bool {
        true
    }

    fn accumulate(&self, samples: &Samples<'_>, weight: f32, gradients: &mut SampleGradients<'_>) -> f64 {
        let mut sum = 0.0;
        for (i, target) in samples.targets.iter().enumerate() {
            let (u, v) = (samples.tangents[0][i], samples.tangents[1][i]);
            let n = target.surface_normal;
            let trace = dot(u, u) + dot(v, v);
            if trace < LEAST_TRACE || n == [0.0; 3] {
                continue;
            }
            let determinant = dot(n, cross(u, v));
            let t = -determinant / trace;
            // |t| ≤ ½, so that the exponential is harmless.
            let exponential = (10.0 * t).exp();
            sum += exponential.ln_1p() / 10.0;
            let slope = weight * exponential / (1.0 + exponential);
            // t = −det / trace: dt = −d(det)/trace + det d(trace)/trace².
            let (by_determinant, by_trace) = (-slope / trace, slope * determinant / (trace * trace));
            add_scaled(&mut gradients.tangents[0][i], by_determinant, cross(v, n));
            add_scaled(&mut gradients.tangents[1][i], by_determinant, cross(n, u));
            add_scaled(&mut gradients.tangents[0][i], 2.0 * by_trace, u);
            add_scaled(&mut gradients.tangents[1][i], 2.0 * by_trace, v);
        }
        f64::from(sum)
    }
}
