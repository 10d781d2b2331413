//! Agreement of normals.

use ndf_core::glam::Vec3;

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
        let mut sum = 0.0;
        for (i, target) in block.targets.iter().enumerate() {
            let (u, v) = (block.tangents[0][i], block.tangents[1][i]);
            let area = u.cross(v);
            let squared = area.length_squared();
            let wanted = target.surface_normal;
            if squared < MIN_AREA_SQUARED || wanted == Vec3::ZERO {
                continue;
            }
            let length = squared.sqrt();
            let n = area / length;
            let cosine = n.dot(wanted);
            sum += 2.0 - 2.0 * cosine;
            // d(2 − 2 n·m)/d(area) = −2 (m − (m·n) n) / |area|, and area = u × v.
            let by_area = -2.0 * weight * (wanted - cosine * n) / length;
            gradients.tangents[0][i] += v.cross(by_area);
            gradients.tangents[1][i] += by_area.cross(u);
        }
        f64::from(sum)
    }
}
