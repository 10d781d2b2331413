//! The order in which levels are learned.

use ndf_mesh::ManifoldMesh;

use super::options::LevelOptions;

/// By what λ is multiplied at first.
const ANNEALING: f64 = 14.0;

/// Share of the iterations before the grid that go without the finest level: as long as bits cost several times their
/// price, there is hardly anything on it.
const COARSE: f64 = 0.75;

/// Iterations after which it is seen whether creases pay: on what is made of planes and bent sheets they do, on bumps
/// they do not. What is clearly behind is given up then, and all but the best when the finest level is added.
const TRIAL: usize = 5;

/// What is learned when.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    /// Levels at first, and in the end.
    pub(super) levels: [usize; 2],
    /// The iteration that adds the finest level, where there are fewer at first.
    pub(super) refined: usize,
    /// Those that give up what is clearly behind, and all but the best.
    pub(super) trial: usize,
    pub(super) chosen: usize,
    /// The first on the grid.
    pub(super) gridded: usize,
    pub(super) all: usize,
}

impl Plan {
    pub(super) fn new(options: &LevelOptions, base: &ManifoldMesh) -> Self {
        let levels = options.levels_above(base);
        let [free, gridded] = options.iterations;
        let refined = if levels > 1 { (COARSE * free as f64) as usize } else { 0 };
        let at_first = levels - usize::from(refined > 0);
        // When the finest level is added, or where that is there from the start, after the trial.
        let chosen = if refined > 0 { refined } else { TRIAL.min(free.max(1)) };
        let all = free.saturating_add(gridded);
        Self { levels: [at_first, levels], refined, trial: TRIAL.min(chosen), chosen, gridded: free, all }
    }

    /// The price of a bit in an iteration, where it is λ in the end.
    pub(super) fn annealed(&self, lambda: f64, iteration: usize) -> f64 {
        let rest = 1.0 - iteration as f64 / self.gridded as f64;
        if iteration < self.gridded { lambda * ANNEALING.powf(rest) } else { lambda }
    }
}
