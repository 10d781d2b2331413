//! Agreement of normals.

use super::{Block, Gradients, Needs, Term};

/// L_N (supplement, Eq. 4): ‖n_θ − n_Ω‖² between the unit normals of the learned surface and of the surface at the
/// foot. Samples whose tangents are parallel have no normal and are left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct NormalAlignment;

/// Square of the smallest area stretch at which a normal is trusted.
const MIN_AREA_SQUARED: f32 = 1e-16;

impl Term for NormalAlignment {
    fn name(&self) -> &str {
        "normal"
    }

    fn needs(&self) -> Needs {
        Needs::TANGENTS
    }

    fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64 {
        block.sum_over_normals(gradients, |[u, v], wanted, [by_u, by_v]| {
            let area = u.cross(v);
            let squared = area.length_squared();
            if squared < MIN_AREA_SQUARED {
                return 0.0;
            }
            let length = squared.sqrt();
            let n = area / length;
            let cosine = n.dot(wanted);
            // d(2 − 2 n·m)/d(area) = −2 (m − (m·n) n) / |area|, and area = u × v.
            let by_area = -2.0 * weight * (wanted - cosine * n) / length;
            *by_u += v.cross(by_area);
            *by_v += by_area.cross(u);
            2.0 - 2.0 * cosine
        })
    }
}
