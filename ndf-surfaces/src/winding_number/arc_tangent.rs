//! The arc tangent of two arguments, for SIMD loops.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// `atan2(y, x)` without branches, so that a loop over it becomes SIMD; 0 for (0, 0). Cephes' rational
/// approximation (Moshier 1989), correct to 4e-16.
#[inline(always)]
pub(super) fn arc_tangent(y: f64, x: f64) -> f64 {
    let (ax, ay) = (x.abs(), y.abs());
    let (small, large) = if ay < ax { (ay, ax) } else { (ax, ay) };
    // The angle from the nearer axis, in [0, π/4], or from the diagonal if that is closer.
    let beyond = small > 0.66 * large;
    let (numerator, denominator) = if beyond { (small - large, small + large) } else { (small, large) };
    let ratio = numerator / denominator;
    let ratio = if denominator > 0.0 { ratio } else { 0.0 };
    let z = ratio * ratio;
    let p = (((-8.750_608_600_031_904e-1 * z - 1.615_753_718_733_365e1) * z - 7.500_855_792_314_705e1) * z
        - 1.228_866_684_490_136_2e2)
        * z
        - 6.485_021_904_942_025e1;
    let q = ((((z + 2.485_846_490_142_306_3e1) * z + 1.650_270_098_316_988_5e2) * z
        + 4.328_810_604_912_902_7e2)
        * z
        + 4.853_903_996_359_137e2)
        * z
        + 1.945_506_571_482_614e2;
    let angle = ratio + ratio * (z * p / q) + if beyond { FRAC_PI_4 } else { 0.0 };
    let angle = if ay < ax { angle } else { FRAC_PI_2 - angle };
    let angle = if large > 0.0 { angle } else { 0.0 };
    let angle = if x < 0.0 { PI - angle } else { angle };
    angle.copysign(y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn the_arc_tangent_is_right_in_all_quadrants() {
        for i in 0..4000 {
            let angle = (f64::from(i) / 2000.0 - 1.0) * PI;
            let (y, x) = angle.sin_cos();
            assert_abs_diff_eq!(arc_tangent(y, x), y.atan2(x), epsilon = 1e-15);
        }
        for (y, x) in [(0.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0), (-0.0, -1.0), (0.0, 0.0), (3.0, 3.0)]
        {
            assert_abs_diff_eq!(arc_tangent(y, x), f64::atan2(y, x), epsilon = 1e-15);
        }
    }
}
