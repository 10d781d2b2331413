//! Point signatures that are invariant under isometries.

use crate::modes::Modes;
use crate::vertex_functions::VertexFunctions;

impl Modes {
    /// Heat kernel signatures (Sun, Ovsjanikov and Guibas 2009, eq. 4): `Σ exp(−λt) φ(x)²`, the part of a unit of
    /// heat placed at `x` that is still there after a time `t`. A function for every time, in inverse squared units of
    /// length; times in squared units of length. What the missing modes would add is below `exp(−λt)` of the last one.
    pub fn heat_kernel_signatures(&self, times: &[f64]) -> VertexFunctions {
        self.sums_of_squares(times.len(), |t, lambda| (-lambda * times[t]).exp())
    }

    /// Times that suit the modes at hand (Sun et al. 2009, §5): `count` from `4 ln 10 / λ` of the last to that of the
    /// first eigenvalue above zero, evenly in the logarithm. Empty where all eigenvalues are zero.
    pub fn heat_times(&self, count: usize) -> Vec<f64> {
        let Some((first, last)) = self.positive_range() else { return Vec::new() };
        let time = |lambda: f64| 4.0 * 10.0_f64.ln() / lambda;
        spaced(time(last).ln(), time(first).ln(), count).map(f64::exp).collect()
    }

    /// Wave kernel signatures (Aubry, Schlickewei and Cremers 2011, eq. 4): the mean probability of finding at `x` a
    /// particle with an energy near `e`, for `count` energies, evenly in the logarithm between the first eigenvalue above
    /// zero and the last; the deviation is seven steps, as there. A function for every energy. Zero where all
    /// eigenvalues are zero.
    pub fn wave_kernel_signatures(&self, count: usize) -> VertexFunctions {
        let Some((first, last)) = self.positive_range() else {
            return VertexFunctions::zeros(self.functions.vertex_count(), count);
        };
        let deviation = 7.0 * (last / first).ln().max(f64::MIN_POSITIVE) / count.max(1) as f64;
        let energies: Vec<f64> =
            spaced(first.ln() + 2.0 * deviation, last.ln() - 2.0 * deviation, count).collect();
        let weight = |e: usize, lambda: f64| {
            let distance = (energies[e] - lambda.ln()) / deviation;
            if lambda > 0.0 { (-0.5 * distance * distance).exp() } else { 0.0 }
        };
        let sum = |e: usize| self.eigenvalues.iter().map(|&lambda| weight(e, lambda)).sum::<f64>();
        let sums: Vec<f64> = (0..count).map(sum).collect();
        self.sums_of_squares(count, |e, lambda| if sums[e] > 0.0 { weight(e, lambda) / sums[e] } else { 0.0 })
    }

    /// `count` functions `Σ w(λ) φ²`, each of its own weights. O(V · modes · count).
    fn sums_of_squares(&self, count: usize, weight: impl Fn(usize, f64) -> f64) -> VertexFunctions {
        let mut sums = VertexFunctions::zeros(self.functions.vertex_count(), count);
        for k in 0..count {
            let sum = sums.function_mut(k);
            for (function, &lambda) in self.functions.iter().zip(&self.eigenvalues) {
                let weight = weight(k, lambda);
                sum.iter_mut().zip(function).for_each(|(sum, x)| *sum += weight * x * x);
            }
        }
        sums
    }

    /// The first and the last eigenvalue above zero.
    fn positive_range(&self) -> Option<(f64, f64)> {
        let first = self.eigenvalues.iter().copied().find(|&lambda| lambda > 0.0)?;
        Some((first, self.eigenvalues[self.len() - 1]))
    }
}

/// `count` numbers evenly from one to another.
fn spaced(from: f64, to: f64, count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| from + (to - from) * i as f64 / (count.max(2) - 1) as f64)
}
