//! Local conformality.

use super::{Block, Gradients, Needs, Term};

/// L_F (supplement, Eq. 6): χ(−det J / tr JᵀJ) with χ(t) = log(1 + e^{10 t}) / 10. The determinant has the sign of the
/// orientation against the surface's normal at the foot: det J = n_Ω · (J u × J v), so that folds count as negative.
#[derive(Clone, Copy, Debug, Default)]
pub struct Conformal;

/// Below this ‖J‖²_F a sample has collapsed to a point and is left out.
const MIN_TRACE: f32 = 1e-12;

impl Term for Conformal {
    fn name(&self) -> &str {
        "conformal"
    }

    fn needs(&self) -> Needs {
        Needs::TANGENTS
    }

    fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64 {
        block.sum_over_normals(gradients, |[u, v], n, [by_u, by_v]| {
            let trace = u.length_squared() + v.length_squared();
            if trace < MIN_TRACE {
                return 0.0;
            }
            let determinant = n.dot(u.cross(v));
            let t = -determinant / trace;
            // |t| ≤ ½, so that the exponential is harmless.
            let exponential = (10.0 * t).exp();
            let slope = weight * exponential / (1.0 + exponential);
            // t = −det / trace: dt = −d(det)/trace + det d(trace)/trace².
            let (by_determinant, by_trace) = (-slope / trace, slope * determinant / (trace * trace));
            *by_u += by_determinant * v.cross(n);
            *by_v += by_determinant * n.cross(u);
            *by_u += 2.0 * by_trace * u;
            *by_v += 2.0 * by_trace * v;
            exponential.ln_1p() / 10.0
        })
    }
}
