//! What displacements cost in bits, as the coder of the file will have it.

use ndf_model::levels::{
    CLUES, CONTEXTS, ClueWeights, Clues, Hierarchy, Neighbours, energies, fitted_weights,
};

/// Magnitudes with a price of their own.
const PRICED: usize = 24;
/// What the prior of a context weighs, in displacements.
const PRIOR: f64 = 20.0;

/// The prices of the displacements of all levels.
#[derive(Clone, Debug)]
pub(super) struct Rate {
    neighbours: Vec<Neighbours>,
    weights: Vec<ClueWeights>,
    /// By level.
    pub(super) prices: Vec<Prices>,
}

impl Rate {
    /// Without prices yet. O(n).
    pub(super) fn new(hierarchy: &Hierarchy, levels: usize) -> Self {
        let neighbours = (0..levels).map(|l| Neighbours::new(hierarchy.level(l))).collect();
        Self { neighbours, weights: vec![[0; CLUES]; levels], prices: Vec::new() }
    }

    /// The prices at these displacements. What their contexts make of their clues is fitted anew if asked for, and else as
    /// it was. O(n).
    pub(super) fn update<'a>(
        &mut self,
        hierarchy: &Hierarchy,
        displacements: impl Iterator<Item = &'a [i32]>,
        refit: bool,
    ) {
        let mut coarser = vec![0; hierarchy.level(0).vertex_count()];
        self.prices.clear();
        for (level, integers) in displacements.enumerate() {
            let clues = Clues::new(&self.neighbours[level], &coarser);
            if refit {
                self.weights[level] = fitted_weights(&clues, integers);
            }
            self.prices.push(Prices::of_level(&clues, &self.weights[level], integers));
            coarser = energies(hierarchy.level(level), &coarser, |i| integers[i as usize].unsigned_abs());
        }
    }
}

/// The prices of the displacements of one level.
#[derive(Clone, Debug)]
pub(super) struct Prices {
    contexts: Vec<u8>,
    bits: [[f32; PRICED]; CONTEXTS],
}

impl Prices {
    fn of_level(clues: &Clues<'_>, weights: &ClueWeights, integers: &[i32]) -> Self {
        let context = |i| clues.context(weights, i, |j| integers[j as usize].unsigned_abs()) as u8;
        let contexts: Vec<u8> = (0..integers.len()).map(context).collect();
        let mut counts = [[0.0; PRICED]; CONTEXTS];
        for (&context, q) in contexts.iter().zip(integers) {
            counts[usize::from(context)][(q.unsigned_abs() as usize).min(PRICED - 1)] += 1.0;
        }
        let mut bits = [[0.0; PRICED]; CONTEXTS];
        for (context, (counts, bits)) in counts.iter().zip(&mut bits).enumerate() {
            // A geometric prior of the magnitude that the context expects.
            let mean = 0.02 * ((context as f64 + 0.5) / 2.0).exp2();
            let ratio = mean / (1.0 + mean);
            let prior = |m: usize| 0.98 * (1.0 - ratio) * ratio.powi(m as i32) + 0.02 / PRICED as f64;
            let total: f64 = counts.iter().sum::<f64>() + PRIOR * (0..PRICED).map(prior).sum::<f64>();
            for (m, (count, bits)) in counts.iter().zip(bits).enumerate() {
                let sign = if m > 0 { 1.0 } else { 0.0 };
                *bits = (sign - ((count + PRIOR * prior(m)) / total).log2()) as f32;
            }
        }
        Self { contexts, bits }
    }

    /// Bits of displacement i with this value.
    pub(super) fn bits(&self, i: usize, q: i32) -> f64 {
        let table = &self.bits[usize::from(self.contexts[i])];
        let m = q.unsigned_abs() as usize;
        let beyond = m.saturating_sub(PRICED - 1);
        f64::from(table[m.min(PRICED - 1)]) + beyond as f64
    }
}
