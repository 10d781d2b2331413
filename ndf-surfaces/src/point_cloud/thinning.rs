//! Fewer points of a large cloud, as evenly spread.

use ndf_core::{BoundingBox, DVec3};
use ndf_mesh::{Z_CURVE_DIGITS, z_curve_place};
use rayon::prelude::*;

/// `count` of some finite points, in ascending order; all, if there are no more. They are picked at equal distances along a Morton
/// curve, so that dense parts stay denser than others. O(n log n) on all threads.
pub fn evenly_picked(positions: &[DVec3], count: usize) -> Vec<u32> {
    let all = positions.len();
    if all <= count {
        return (0..all as u32).collect();
    }
    let bounds = BoundingBox::of_points(positions);
    let scale = f64::from((1_u32 << Z_CURVE_DIGITS) - 1) / bounds.extent().max_element();
    let code = |p: DVec3| z_curve_place(((p - bounds.min) * scale).to_array().map(|x| x as u64));
    let mut order: Vec<(u64, u32)> =
        positions.par_iter().zip(0..all as u32).map(|(&p, i)| (code(p), i)).collect();
    order.par_sort_unstable();
    let mut picked: Vec<u32> = (0..count).map(|k| order[(2 * k + 1) * all / (2 * count)].1).collect();
    picked.sort_unstable();
    picked
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_keeps_its_share() {
        let spread = |i: u32| (DVec3::new(0.618, 0.414, 0.732) * f64::from(i)).fract();
        let points: Vec<DVec3> = (0..64_000).map(spread).collect();
        let picked = evenly_picked(&points, 8000);
        assert!(picked.len() == 8000 && picked.is_sorted_by(|a, b| a < b));
        for octant in 0..8 {
            let is_in = |p: DVec3| {
                p.to_array().map(|x| u32::from(x >= 0.5)) == [octant & 1, (octant >> 1) & 1, octant >> 2]
            };
            let all = points.iter().filter(|&&p| is_in(p)).count() as f64;
            let kept = picked.iter().filter(|&&i| is_in(points[i as usize])).count() as f64;
            assert!((kept / all * 8.0 - 1.0).abs() < 0.01, "{kept} of {all}");
        }
        assert_eq!(evenly_picked(&points[..5], 9), [0, 1, 2, 3, 4]);
        assert_eq!(evenly_picked(&[DVec3::ONE; 10], 3).len(), 3);
    }
}
