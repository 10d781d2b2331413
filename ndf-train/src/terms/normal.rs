//! Agreement of normals.

use super::{LossTerm, SampleGradients, Samples, add_scaled, cross, dot};

/// L_N (supplement, Eq. 4): ‖n_θ − n_Ω‖² between the unit normals of the learned surface and of the surface at the
/// foot. Samples whose tangents are parallel have no normal and are left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct NormalAlignment;

/// Square of the smallest area stretch at which a normal is trusted.
const LEAST_AREA_SQUARED: f32 = 1e-16;

impl LossTerm for NormalAlignment {
    fn name(&self) -> &'static str {
        "normal"
    }

    fn needs_tangents(&self) -> bool {
        true
    }

    fn accumulate(&self, samples: &Samples<'_>, weight: f32, gradients: &mut SampleGradients<'_>) -> f64 {
        let mut sum = 0.0;
        for (i, target) in samples.targets.iter().enumerate() {
            let (u, v) = (samples.tangents[0][i], samples.tangents[1][i]);
            let area = cross(u, v);
            let squared = dot(area, area);
            let wanted = target.surface_normal;
            if squared < LEAST_AREA_SQUARED || wanted == [0.0; 3] {
                continue;
            }
            let length = squared.sqrt();
            let n = area.map(|a| a / length);
            let cosine = dot(n, wanted);
            sum += 2.0 - 2.0 * cosine;
            // d(2 − 2 n·m)/d(area) = −2 (m − (m·n) n) / |area|, and area = u × v.
            let by_area = [0, 1, 2].map(|c| -2.0 * weight * (wanted[c] - cosine * n[c]) / length);
            add_scaled(&mut gradients.tangents[0][i], 1.0, cross(v, by_area));
            add_scaled(&mut gradients.tangents[1][i], 1.0, cross(by_area, u));
        }
        f64::from(sum)
    }
}
