//! Agreement with the tape, on which the definition is differentiated in f64: by every parameter.

use super::definition::loss;
use super::{case, cases, relative_error};
use crate::tape::{Tape, Var};

#[test]
fn gradients_agree_with_the_tape() {
    for (weights, reverse_map, activation) in cases() {
        let e = case(weights, reverse_map, activation);
        let tape = Tape::default();
        let groups: [Vec<Var<'_>>; 3] =
            e.groups().map(|group| group.into_iter().map(|x| tape.variable(x)).collect());
        let value = loss(&e, weights, &groups[0], &groups[1], &groups[2]);
        let name = format!("{weights:?}, {reverse_map:?}, {activation:?}");
        assert!(
            (value.value() - e.loss).abs() < 1e-6 * value.value(),
            "{name}: {} {}",
            value.value(),
            e.loss
        );
        let by = value.gradient();
        for (variables, found) in groups.iter().zip([&e.by_features, &e.by_theta, &e.by_phi]) {
            let truth: Vec<f64> = variables.iter().map(|&x| by.by(x)).collect();
            let error = relative_error(found, &truth);
            assert!(error < 1e-5, "{name}: {error:.1e}");
        }
    }
}
