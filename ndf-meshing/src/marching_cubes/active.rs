//! Finds the blocks of cells the surface can pass through, without sampling the rest.

use super::grid::{Grid, Oriented};

/// Side, in cells, of the blocks that are kept or skipped as a whole.
pub(crate) const BLOCK: u32 = 2;
/// Cells in a layer of blocks that is worked on at a time.
pub(crate) const SLAB: u32 = 8;
/// Side of the blocks the search begins with.
const COARSEST: u32 = 64;

/// The cells that can contain the surface. A field with a Lipschitz bound is searched from coarse to fine: a
/// block whose centre is further from the level than the field can change on the way to a corner has no
/// crossing. Without a bound every block counts.
pub(crate) struct ActiveBlocks<'a> {
    field: Oriented<'a>,
    grid: Grid,
    bound: Option<f64>,
    /// Lowest corners of the blocks of side [`SLAB`] that may be crossed, by z, then y, then x.
    coarse: Vec<[u32; 3]>,
    /// Points looked at.
    pub(crate) evaluations: u64,
}

impl<'a> ActiveBlocks<'a> {
    pub(crate) fn new(field: Oriented<'a>, grid: Grid) -> Self {
        let bound = field.field.lipschitz().filter(|bound| bound.is_finite() && *bound >= 0.0);
        let mut this = Self { field, grid, bound, coarse: Vec::new(), evaluations: 0 };
        if this.bound.is_some() {
            let roots = this.parts(&[[0; 3]], u32::MAX, COARSEST);
            let roots = this.crossed(roots, COARSEST);
            this.coarse = this.descend(roots, COARSEST, SLAB);
            this.coarse.sort_unstable_by_key(|&[x, y, z]| [z, y, x]);
        }
        this
    }

    /// Lowest corners of the blocks of side [`BLOCK`] between the layers of corners `z` and `z + SLAB`.
    pub(crate) fn in_slab(&mut self, z: u32) -> Vec<[u32; 3]> {
        let mut blocks = if self.bound.is_some() {
            let begin = self.coarse.partition_point(|block| block[2] < z);
            let end = self.coarse.partition_point(|block| block[2] <= z);
            let coarse = self.coarse[begin..end].to_vec();
            self.descend(coarse, SLAB, BLOCK)
        } else {
            let [x, y, top] = self.grid.cells;
            box_parts([0, 0, z], [x, y, top.min(z + SLAB)], BLOCK)
        };
        blocks.sort_unstable_by_key(|&[x, y, z]| [z, y, x]);
        blocks
    }

    fn descend(&mut self, mut blocks: Vec<[u32; 3]>, mut side: u32, finest: u32) -> Vec<[u32; 3]> {
        while side > finest {
            let parts = self.parts(&blocks, side, side / 2);
            side /= 2;
            blocks = self.crossed(parts, side);
        }
        blocks
    }

    /// Blocks of side `part` within blocks of side `side`, as far as they are in the grid.
    fn parts(&self, blocks: &[[u32; 3]], side: u32, part: u32) -> Vec<[u32; 3]> {
        let cells = self.grid.cells;
        let end = |low: [u32; 3]| [0, 1, 2].map(|k| cells[k].min(low[k].saturating_add(side)));
        blocks.iter().flat_map(|&low| box_parts(low, end(low), part)).collect()
    }

    /// Those of the blocks that may be crossed.
    fn crossed(&mut self, blocks: Vec<[u32; 3]>, side: u32) -> Vec<[u32; 3]> {
        let Some(bound) = self.bound else { return blocks };
        // The centre of a block of even side is a corner of the grid; a little slack covers rounding.
        let centers: Vec<_> = blocks.iter().map(|low| self.grid.corner(low.map(|x| x + side / 2))).collect();
        self.evaluations += centers.len() as u64;
        let radius = 0.5 * 3.0_f64.sqrt() * self.grid.cell * f64::from(side);
        let far = bound * radius * (1.0 + 1e-9);
        let values = self.field.values_of(&centers);
        blocks
            .into_iter()
            .zip(values)
            .filter(|(_, v)| v.is_nan() || v.abs() <= far)
            .map(|(block, _)| block)
            .collect()
    }
}

/// Lowest corners of the cubes of side `part` that fill a box from `low`.
fn box_parts(low: [u32; 3], end: [u32; 3], part: u32) -> Vec<[u32; 3]> {
    let range = |k: usize| (low[k]..end[k]).step_by(part as usize);
    range(2).flat_map(|z| range(1).flat_map(move |y| range(0).map(move |x| [x, y, z]))).collect()
}
