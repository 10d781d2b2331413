//! Convolutions where their results are wanted, in place of a whole lattice.

use ndf_spectral::faer::linalg::matmul::matmul;
use ndf_spectral::faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

/// Voxels that a thread takes at a time.
const CHUNK: usize = 128;
/// Slope of activations below zero.
const LEAK: f32 = 0.01;

/// A box of places, numbered with the last axis fastest, as PyTorch does for an array of x, y and z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    sides: [u32; 3],
}

impl Lattice {
    pub(crate) fn new(sides: [u32; 3]) -> Self {
        Self { sides }
    }

    pub(crate) fn sides(&self) -> [u32; 3] {
        self.sides
    }

    pub(crate) fn len(&self) -> usize {
        self.sides.iter().map(|&n| n as usize).product()
    }

    pub(crate) fn coordinates(&self, place: u32) -> [u32; 3] {
        let [_, rows, depth] = self.sides;
        [place / depth / rows, place / depth % rows, place % depth]
    }

    /// The place so many steps from another; both must be in the box.
    pub(crate) fn moved(&self, place: u32, by: [i32; 3]) -> u32 {
        let [_, rows, depth] = self.sides.map(|n| n as i32);
        place.wrapping_add_signed((by[0] * rows + by[1]) * depth + by[2])
    }
}

/// The ways to a place and its 26 neighbours, the last axis fastest.
fn neighbourhood() -> impl Iterator<Item = [i32; 3]> {
    (0..27).map(|tap| [tap / 9 - 1, tap / 3 % 3 - 1, tap % 3 - 1])
}

/// Some of the places of a lattice, in order, numbered through.
pub(crate) struct Voxels {
    pub(crate) places: Vec<u32>,
    numbers: Vec<u32>,
}

impl Voxels {
    pub(crate) fn new(lattice: Lattice, places: Vec<u32>) -> Self {
        let mut numbers = vec![u32::MAX; lattice.len()];
        for (number, &place) in (0..).zip(&places) {
            numbers[place as usize] = number;
        }
        Self { places, numbers }
    }

    /// These and all their neighbours, which must be in the lattice.
    pub(crate) fn grown(lattice: Lattice, places: &[u32]) -> Self {
        let mut is_in = vec![false; lattice.len()];
        for &place in places {
            for way in neighbourhood() {
                is_in[lattice.moved(place, way) as usize] = true;
            }
        }
        Self::new(lattice, (0..lattice.len() as u32).filter(|&place| is_in[place as usize]).collect())
    }

    pub(crate) fn number(&self, place: u32) -> Option<u32> {
        Some(self.numbers[place as usize]).filter(|&number| number != u32::MAX)
    }
}

/// Weights and biases from some channels to others: of one place, or of a place and its neighbours.
#[derive(Clone, Debug)]
pub(crate) struct Convolution {
    /// For each neighbour, in the order of the neighbourhood, each channel before: a weight for each channel after.
    weights: Vec<f32>,
    bias: Vec<f32>,
}

impl Convolution {
    /// Of weights as PyTorch has them, by channel after, channel before and neighbour.
    pub(crate) fn new(weights: &[f32], bias: &[f32], taps: usize) -> Self {
        let (after, before) = (bias.len(), weights.len() / bias.len() / taps);
        let at = |i: usize| {
            let (input, output) = (i / after, i % after);
            weights[(output * before + input % before) * taps + input / before]
        };
        Self { weights: (0..weights.len()).map(at).collect(), bias: bias.to_vec() }
    }

    /// Number of channels after.
    pub(crate) fn width(&self) -> usize {
        self.bias.len()
    }

    /// Adds what rows of numbers, a row a place, lead to.
    fn apply(&self, rows: &[f32], count: usize, out: &mut [f32]) {
        let (inputs, width) = (self.weights.len() / self.width(), self.width());
        out.chunks_exact_mut(width).for_each(|row| row.copy_from_slice(&self.bias));
        let out = MatMut::from_column_major_slice_mut(out, width, count);
        let weights = MatRef::from_column_major_slice(&self.weights, width, inputs);
        let rows = MatRef::from_column_major_slice(rows, inputs, count);
        matmul(out, Accum::Add, weights, rows, 1.0, Par::Seq);
    }
}

fn activate(values: &mut [f32]) {
    values.iter_mut().for_each(|x| *x = if *x < 0.0 { LEAK * *x } else { *x });
}

/// What is done with the channels of one place.
#[derive(Clone, Debug)]
pub(crate) enum Local {
    /// An activated product.
    Dense(Convolution),
    /// Two products with an activation between, added to the channels before, and activated.
    Residual([Convolution; 2]),
    /// A product.
    Last(Convolution),
}

impl Local {
    fn apply(&self, rows: &mut Vec<f32>, count: usize) {
        let product = |convolution: &Convolution, rows: &[f32]| {
            let mut out = vec![0.0; count * convolution.width()];
            convolution.apply(rows, count, &mut out);
            out
        };
        match self {
            Self::Dense(convolution) => {
                *rows = product(convolution, rows);
                activate(rows);
            }
            Self::Residual([first, second]) => {
                let mut inner = product(first, rows);
                activate(&mut inner);
                let out = product(second, &inner);
                rows.iter_mut().zip(out).for_each(|(x, y)| *x += y);
                activate(rows);
            }
            Self::Last(convolution) => *rows = product(convolution, rows),
        }
    }
}

/// An activated convolution over neighbours, and what follows at each place.
#[derive(Clone, Debug)]
pub(crate) struct Stage {
    pub(crate) convolution: Convolution,
    pub(crate) then: Vec<Local>,
}

impl Stage {
    /// The rows of `places` from those of all their neighbours: `row` gives the channels of a place.
    pub(crate) fn apply<'a>(
        &self,
        lattice: Lattice,
        places: &[u32],
        row: impl Fn(u32) -> &'a [f32] + Sync,
    ) -> Vec<f32> {
        let of_chunk = |chunk: &[u32]| {
            let mut gathered = Vec::new();
            for &place in chunk {
                for way in neighbourhood() {
                    gathered.extend_from_slice(row(lattice.moved(place, way)));
                }
            }
            let mut rows = vec![0.0; chunk.len() * self.convolution.width()];
            self.convolution.apply(&gathered, chunk.len(), &mut rows);
            activate(&mut rows);
            self.then.iter().for_each(|local| local.apply(&mut rows, chunk.len()));
            rows
        };
        places.par_chunks(CHUNK).flat_map_iter(of_chunk).collect()
    }
}
