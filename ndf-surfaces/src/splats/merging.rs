//! Fewer Gaussians for many small splats.

use ndf_core::DVec3;
use ndf_formats::splats::Splat;

/// Splats, those no larger than `least` in any direction together where they lie in one cell of a grid of that width: at their mean,
/// with the sum of their opacities.
///
/// Scales are raised to `least` before they are summed, so that these Gaussians are alike, and where they lie close together
/// their sum is nearly one Gaussian. On a sheet their mean lies on the sheet, too, which becomes no thicker. How many are summed at a
/// place then depends on the object alone, and no longer on the number of splats. Splats without opacity are left out.
pub(super) fn merged(splats: &[&Splat], least: f64) -> Vec<Splat> {
    let (small, large): (Vec<&Splat>, Vec<&Splat>) =
        splats.iter().copied().partition(|splat| splat.scales.iter().all(|&s| f64::from(s) <= least));
    let cell = |splat: &Splat| splat.center.map(|x| (x / least).floor() as i64);
    let mut order: Vec<([i64; 3], u32)> = small.iter().map(|splat| cell(splat)).zip(0..).collect();
    order.sort_unstable();
    let together = order.chunk_by(|a, b| a.0 == b.0).filter_map(|group| {
        let of_group = || group.iter().map(|&(_, i)| small[i as usize]);
        let opacity: f64 = of_group().map(|splat| f64::from(splat.opacity)).sum();
        let sum: DVec3 =
            of_group().map(|splat| f64::from(splat.opacity) * DVec3::from_array(splat.center)).sum();
        (opacity > 0.0).then(|| Splat {
            center: (sum / opacity).to_array(),
            scales: [least as f32; 3],
            rotation: [1.0, 0.0, 0.0, 0.0],
            opacity: opacity as f32,
        })
    });
    large.into_iter().copied().chain(together).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splats::{DensityOptions, SplatDensity};
    use ndf_core::ImplicitField;

    /// Splats on a unit sphere.
    fn sphere(count: usize, scale: f32) -> Vec<Splat> {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let splat = |i: usize| {
            let z = 1.0 - 2.0 * (i as f64 + 0.5) / count as f64;
            let (sin, cos) = (golden * i as f64).sin_cos();
            let center = [(1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z];
            Splat { center, scales: [scale; 3], rotation: [1.0, 0.0, 0.0, 0.0], opacity: 0.9 }
        };
        (0..count).map(splat).collect()
    }

    #[test]
    fn few_gaussians_have_the_density_of_many() {
        let splats = sphere(100_000, 0.02);
        let least = f64::from(0.02_f32);
        let few = merged(&splats.iter().collect::<Vec<_>>(), least);
        assert!(few.len() < 60_000, "{}", few.len());
        let total = |splats: &[Splat]| splats.iter().map(|s| f64::from(s.opacity)).sum::<f64>();
        assert!((total(&few) / total(&splats) - 1.0).abs() < 1e-5);
        let of = |splats: &[Splat]| SplatDensity::new(splats, &DensityOptions::default()).unwrap();
        let (many, few) = (of(&splats), of(&few));
        for i in 0..200 {
            let direction = (DVec3::new(0.618, 0.414, 0.732) * f64::from(i)).fract() - 0.5;
            let p = [direction.normalize() * (1.0 + 0.03 * (f64::from(i % 3) - 1.0))];
            let [mut a, mut b] = [[0.0]; 2];
            many.values(&p, &mut a);
            few.values(&p, &mut b);
            assert!((a[0] - b[0]).abs() < 0.06 * many.level() * 2.0 + 0.06 * a[0].abs(), "{a:?} {b:?}");
        }
    }

    #[test]
    fn large_splats_stay() {
        let splats = sphere(1000, 0.1);
        let left = merged(&splats.iter().collect::<Vec<_>>(), 0.02);
        assert_eq!(left.len(), 1000);
    }
}
