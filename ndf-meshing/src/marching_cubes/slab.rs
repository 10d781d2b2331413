//! A layer of corners of the grid: sampled values, and the vertices on the edges that begin there.

use ndf_core::DVec3;
use rayon::prelude::*;

use super::active::{BLOCK, SLAB};
use super::cases::CaseTable;
use super::cell::EDGE_CORNERS;
use super::grid::{Grid, Oriented};

/// No vertex yet.
const NONE: u32 = u32::MAX;

/// A crossed edge of the grid; its vertex has the same index.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    /// The lower corner of the edge.
    pub(crate) corner: [u32; 3],
    /// The axis the edge runs along; 3 for a vertex in the middle of a cell.
    pub(crate) axis: u8,
    /// Values at both ends.
    pub(crate) values: [f64; 2],
}

/// The surface as it grows.
#[derive(Debug, Default)]
pub(crate) struct Growing {
    /// One for every vertex.
    pub(crate) crossings: Vec<Crossing>,
    /// Vertices in the middle of a cell and the vertices they are the mean of.
    pub(crate) middles: Vec<(u32, Vec<u32>)>,
    pub(crate) faces: Vec<[u32; 3]>,
}

/// The corners of [`SLAB`] layers from `low` upward.
pub(crate) struct Slab {
    grid: Grid,
    low: u32,
    layers: u32,
    wanted: Vec<bool>,
    values: Vec<f64>,
    /// Vertices on the edges from each corner along x, y and z.
    vertices: Vec<[u32; 3]>,
}

impl Slab {
    /// Starts over from the layer `low`, in the same memory.
    pub(crate) fn restart(mut self, low: u32) -> Self {
        let layers = SLAB.min(self.grid.cells[2] + 1 - low);
        let fresh = Self::empty(self.grid);
        let count = layers as usize * fresh.corners_of_layer();
        self.wanted.clear();
        self.wanted.resize(count, false);
        self.values.clear();
        self.values.resize(count, f64::NAN);
        self.vertices.clear();
        self.vertices.resize(count, [NONE; 3]);
        Self { low, layers, ..self }
    }

    /// A slab without corners.
    pub(crate) fn empty(grid: Grid) -> Self {
        Self { grid, low: 0, layers: 0, wanted: Vec::new(), values: Vec::new(), vertices: Vec::new() }
    }

    fn corners_of_layer(&self) -> usize {
        (self.grid.cells[0] as usize + 1) * (self.grid.cells[1] as usize + 1)
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        let row = (z - self.low) as usize * (self.grid.cells[1] as usize + 1) + y as usize;
        row * (self.grid.cells[0] as usize + 1) + x as usize
    }

    fn contains(&self, z: u32) -> bool {
        (self.low..self.low + self.layers).contains(&z)
    }

    /// Asks for the corners of blocks, as far as they are in this slab.
    pub(crate) fn want(&mut self, blocks: &[[u32; 3]]) {
        let end = self.grid.cells;
        for &[x, y, z] in blocks {
            for cz in (z..=(z + BLOCK).min(end[2])).filter(|&cz| self.contains(cz)).collect::<Vec<_>>() {
                for cy in y..=(y + BLOCK).min(end[1]) {
                    let row = self.index([x, cy, cz]);
                    let count = ((x + BLOCK).min(end[0]) - x) as usize;
                    self.wanted[row..=row + count].fill(true);
                }
            }
        }
    }

    /// Samples the field at the corners asked for; returns how many those are.
    pub(crate) fn evaluate(&mut self, field: Oriented<'_>) -> u64 {
        let indices: Vec<u32> = (0..self.wanted.len() as u32).filter(|&i| self.wanted[i as usize]).collect();
        let (width, rows) = (self.grid.cells[0] + 1, self.grid.cells[1] + 1);
        let corner = |i: u32| [i % width, i / width % rows, self.low + i / width / rows];
        let sampled: Vec<Vec<f64>> = indices
            .par_chunks(field.batch())
            .map(|batch| {
                let points: Vec<DVec3> = batch.iter().map(|&i| self.grid.corner(corner(i))).collect();
                let mut values = vec![0.0; points.len()];
                field.values(&points, &mut values);
                values
            })
            .collect();
        for (&i, value) in indices.iter().zip(sampled.into_iter().flatten()) {
            self.values[i as usize] = value;
        }
        indices.len() as u64
    }
}

/// Adds the faces of the cells of `blocks`, which begin in the slab `below` and may end in the first layer of
/// the slab `above` it.
pub(crate) fn polygonize(blocks: &[[u32; 3]], below: &mut Slab, above: &mut Slab, growing: &mut Growing) {
    let table = CaseTable::new();
    let end = below.grid.cells;
    for &[bx, by, bz] in blocks {
        for z in bz..(bz + BLOCK).min(end[2]) {
            for y in by..(by + BLOCK).min(end[1]) {
                for x in bx..(bx + BLOCK).min(end[0]) {
                    add_cell(table, [x, y, z], below, above, growing);
                }
            }
        }
    }
}

fn add_cell(table: CaseTable, cell: [u32; 3], below: &mut Slab, above: &mut Slab, growing: &mut Growing) {
    let base = below.index(cell);
    let row = below.grid.cells[0] as usize + 1;
    let in_below = below.contains(cell[2] + 1);
    let top =
        if in_below { base + below.corners_of_layer() } else { above.index([cell[0], cell[1], cell[2] + 1]) };
    let offsets = [base, base + 1, base + row, base + row + 1, top, top + 1, top + row, top + row + 1];
    let mut values = [0.0; 8];
    let mut pattern = 0_u8;
    for c in 0..8 {
        values[c] = if c < 4 || in_below { below.values[offsets[c]] } else { above.values[offsets[c]] };
        pattern |= u8::from(values[c] > 0.0) << c;
    }
    if pattern == 0 || pattern == 255 {
        return;
    }
    let case = table.case(pattern, &values);
    let mut vertices = [NONE; 14];
    for (edge, &[a, b]) in EDGE_CORNERS.iter().enumerate() {
        if (pattern >> a & 1) == (pattern >> b & 1) {
            continue;
        }
        let (lower, axis) = (usize::from(a), edge / 4);
        let slab = if lower < 4 || in_below { &mut *below } else { &mut *above };
        let vertex = &mut slab.vertices[offsets[lower]][axis];
        if *vertex == NONE {
            *vertex = growing.crossings.len() as u32;
            let corner = [0, 1, 2].map(|k| cell[k] + (u32::from(a) >> k & 1));
            let values = [values[lower], values[usize::from(b)]];
            growing.crossings.push(Crossing { corner, axis: axis as u8, values });
        }
        vertices[edge] = *vertex;
    }
    for (i, polygon) in case.middles.iter().enumerate() {
        let vertex = growing.crossings.len() as u32;
        growing.crossings.push(Crossing { corner: cell, axis: 3, values: [0.0; 2] });
        growing.middles.push((vertex, polygon.iter().map(|&e| vertices[usize::from(e)]).collect()));
        vertices[12 + i] = vertex;
    }
    growing.faces.extend(case.triangles.iter().map(|t| t.map(|v| vertices[usize::from(v)])));
}
