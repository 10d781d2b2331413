//! Arrays of numbers in a section: as they are, or, where they lie on grids, coded.
//!
//! The numbers are parted into groups, each with a grid and a distribution of its own: a feature of all vertices, the
//! weights of a layer, its biases. Neighbours do not predict features: learned ones are as far from their neighbours'
//! mean as from zero.

use super::bytes::{Reader, Writer};
use super::error::ModelError;
use super::grid::Grid;
use super::range_coder::{Coder, Decoder, Encoder, Integers};
use ndf_mesh::io::FileDefect;
use ndf_network::MlpShape;

const PLAIN: u8 = 0;
const CODED: u8 = 1;

/// Numbers a coded byte may stand for, beyond the first 2¹⁶: what a hostile file can ask for stays in proportion. More
/// regular arrays are written as they are.
const MAX_PER_BYTE: usize = 256;

fn is_plausible(count: usize, bytes: usize) -> bool {
    count <= (1 << 16) + MAX_PER_BYTE * bytes
}

/// How an array is parted.
#[derive(Clone, Copy)]
pub(super) enum Groups<'a> {
    /// So many, the numbers of which take turns.
    Interleaved(usize),
    /// The weights of every layer of a network, then its biases.
    Layers(&'a MlpShape),
}

impl Groups<'_> {
    /// The group of every number, in the order of the array, without end where they take turns.
    fn order(self) -> Box<dyn Iterator<Item = usize>> {
        match self {
            Self::Interleaved(count) => Box::new((0..count).cycle()),
            Self::Layers(shape) => {
                let sizes: Vec<usize> = shape.layers().into_iter().flat_map(|(i, o)| [i * o, o]).collect();
                Box::new(sizes.into_iter().enumerate().flat_map(|(g, size)| std::iter::repeat_n(g, size)))
            }
        }
    }

    fn count(self) -> usize {
        match self {
            Self::Interleaved(count) => count,
            Self::Layers(shape) => 2 * shape.layers().len(),
        }
    }

    /// The numbers of every group.
    pub(super) fn split(self, numbers: &[f32]) -> Vec<Vec<f32>> {
        let mut groups = vec![Vec::new(); self.count()];
        self.order().zip(numbers).for_each(|(g, &x)| groups[g].push(x));
        groups
    }
}

/// Appends an array.
pub(super) fn write(w: &mut Writer, groups: Groups<'_>, numbers: &[f32]) {
    match coded(groups, numbers) {
        Some((grids, stream)) => {
            w.u8(CODED);
            grids.iter().for_each(|grid| w.u8(grid.exponent() as u8));
            w.u32(stream.len() as u32);
            w.0.extend(stream);
        }
        None => {
            w.u8(PLAIN);
            w.f32s(numbers.iter().copied());
        }
    }
}

/// The grids of the groups and the coded integers, where the numbers lie on grids.
fn coded(groups: Groups<'_>, numbers: &[f32]) -> Option<(Vec<Grid>, Vec<u8>)> {
    let parts = groups.split(numbers);
    let grids: Vec<Grid> = parts.iter().map(|part| Grid::of(part.iter().copied())).collect::<Option<_>>()?;
    let mut coder = Encoder::new();
    let mut models = vec![Integers::new(); groups.count()];
    for (g, &x) in groups.order().zip(numbers) {
        models[g].code(&mut coder, grids[g].integer(x));
    }
    let stream = coder.finish();
    is_plausible(numbers.len(), stream.len()).then_some((grids, stream))
}

/// Reads an array of so many numbers.
///
/// # Errors
/// If they are not all there. Allocates no more than a small multiple of what is there.
pub(super) fn read(r: &mut Reader<'_>, groups: Groups<'_>, count: usize) -> Result<Vec<f32>, ModelError> {
    match r.u8()? {
        PLAIN => r.f32s(count),
        CODED => {
            let grids: Vec<Grid> = r.take(groups.count())?.iter().map(|&e| Grid::new(e as i8)).collect();
            let length = r.u32()? as usize;
            if !is_plausible(count, length) {
                let text = "it announces more numbers than its bytes can hold";
                return Err(r.defect(FileDefect::truncated(text)));
            }
            let mut coder = Decoder::new(r.take(length)?);
            let mut models = vec![Integers::new(); groups.count()];
            let mut numbers = Vec::new();
            for g in groups.order().take(count) {
                numbers.push(grids[g].number(models[g].code(&mut coder, 0)));
                if coder.is_exhausted() {
                    return Err(r.truncated());
                }
            }
            let is_spent = coder.is_spent();
            if is_spent { Ok(numbers) } else { Err(r.defect(FileDefect::TrailingBytes("its end"))) }
        }
        other => Err(r.unknown_coding(other)),
    }
}
