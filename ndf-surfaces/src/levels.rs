//! Which level of a density is the surface, where none is given.

use ndf_core::{DVec3, ImplicitField};
use rayon::prelude::*;

/// Points along each side of the box that are looked at.
const GRID: usize = 64;
/// Bins of the histogram.
const BINS: usize = 128;

/// Shares of the box's diagonal within which light that falls on the surface shall be halved.
const HALVINGS: f64 = 100.0;

/// Which rule gave the level of a density.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DensityRule {
    /// Light is halved within a hundredth of the diagonal.
    HalvedLight,
    /// The positive values are parted best into two classes; less than the level of halved light.
    Otsu,
}

/// The level of a density per unit of length in its box: that at which light is halved within a hundredth of the
/// diagonal, or, where that is less, the one that parts the positive values best into two classes (Otsu's threshold of
/// 1979 for their logarithms, at 64³ points). The former keeps to the outside of dense matter, the latter to what is
/// dense in a field without any. 0 where no value is positive.
///
/// Costs 64³ values of the field.
pub fn density_level(field: &dyn ImplicitField) -> (f64, DensityRule) {
    let bounds = field.bounds();
    let points: Vec<DVec3> = (0..GRID * GRID * GRID)
        .map(|k| {
            let [i, j, l] = [k % GRID, k / GRID % GRID, k / GRID / GRID].map(|i| i as f64 + 0.5);
            bounds.min + DVec3::new(i, j, l) / GRID as f64 * bounds.extent()
        })
        .collect();
    let logarithms: Vec<f64> = points
        .par_chunks(512)
        .flat_map_iter(|points| {
            let mut values = vec![0.0; points.len()];
            field.values(points, &mut values);
            values.into_iter().filter(|v| *v > 0.0 && v.is_finite()).map(f64::ln)
        })
        .collect();
    let halving = HALVINGS * std::f64::consts::LN_2 / bounds.diagonal();
    let threshold = otsu(&logarithms).map_or(0.0, f64::exp);
    if threshold < halving { (threshold, DensityRule::Otsu) } else { (halving, DensityRule::HalvedLight) }
}

/// The threshold with the largest variance between the classes below and above.
fn otsu(values: &[f64]) -> Option<f64> {
    let (low, high) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
    if values.is_empty() {
        return None;
    }
    let width = (high - low) / BINS as f64;
    if width <= 0.0 {
        return Some(low);
    }
    let mut counts = [0.0; BINS];
    for v in values {
        counts[(((v - low) / width) as usize).min(BINS - 1)] += 1.0;
    }
    let total = values.len() as f64;
    let moment: f64 = counts.iter().enumerate().map(|(i, n)| i as f64 * n).sum();
    let (mut below, mut moment_below, mut best) = (0.0, 0.0, (0.0, 0));
    for (i, n) in counts.iter().enumerate().take(BINS - 1) {
        below += n;
        moment_below += i as f64 * n;
        let above = total - below;
        if below > 0.0 && above > 0.0 {
            let apart = moment_below / below - (moment - moment_below) / above;
            let variance = below * above * apart * apart;
            if variance > best.0 {
                best = (variance, i);
            }
        }
    }
    Some(low + (best.1 + 1) as f64 * width)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_classes_are_parted_between_them() {
        let values: Vec<f64> =
            (0..1000).map(|i| if i % 10 == 0 { 5.0 } else { 1.0 } + 0.1 * (f64::from(i)).sin()).collect();
        let level = otsu(&values).unwrap();
        assert!((1.1..4.9).contains(&level), "{level}");
        assert_eq!(otsu(&[]), None);
        assert_eq!(otsu(&[2.0, 2.0]), Some(2.0));
    }
}
