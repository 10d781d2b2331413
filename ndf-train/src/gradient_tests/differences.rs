//! Agreement with central differences of the definition, in f64.

use rayon::prelude::*;

use super::definition::loss;
use super::{case, cases, relative_error};

/// Every term alone and all of them together, by every group of parameters.
#[test]
fn gradients_agree_with_central_differences() {
    for (weights, reverse_map, activation) in cases() {
        let e = case(weights, reverse_map, activation);
        let groups = e.groups();
        let value = loss(&e, weights, &groups[0], &groups[1], &groups[2]);
        let name = format!("{weights:?}, {reverse_map:?}, {activation:?}");
        assert!((value - e.loss).abs() < 1e-6 * value, "{name}: {value} {}", e.loss);
        let h = 1e-7;
        for (group, found) in [&e.by_features, &e.by_theta, &e.by_phi].into_iter().enumerate() {
            let picks: Vec<usize> = (0..found.len()).step_by(11).collect();
            let slope = |&i: &usize| {
                let at = |h: f64| {
                    let mut moved = groups.clone();
                    moved[group][i] += h;
                    loss(&e, weights, &moved[0], &moved[1], &moved[2])
                };
                (at(h) - at(-h)) / (2.0 * h)
            };
            let truth: Vec<f64> = picks.par_iter().map(slope).collect();
            let found: Vec<f32> = picks.iter().map(|&i| found[i]).collect();
            let error = relative_error(&found, &truth);
            assert!(error < 1e-5, "{name}, group {group}: {error:.1e}");
        }
    }
}
