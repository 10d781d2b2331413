//! The `LEVL` section: displacements on the levels of a subdivided base mesh.

use super::base::{Levelled, write_levelled};
use super::bytes::{Reader, Writer};
use super::error::ModelError;
use super::range_coder::{Bit, Coder, Decoder, Encoder};
use crate::levels::{
    CLUES, CONTEXTS, ClueWeights, Clues, Hierarchy, Level, Levels, LevelsError, MAX_LEVELS, check_size,
    energies, fitted_weights,
};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::io::FileDefect;

/// The tag.
pub(super) const TAG: &str = "LEVL";

/// Displacements a coded byte may stand for, beyond the first 2¹⁶: what a hostile file can ask for stays in proportion.
const MAX_PER_BYTE: usize = 64;

fn is_plausible(base: &ManifoldMesh, levels: usize, bytes: usize) -> bool {
    // A level has at most four times as many edges as the one below.
    let finest = base.topology().edge_count().saturating_mul(1 << (2 * levels));
    finest <= (1 << 16) + MAX_PER_BYTE * bytes
}

/// Magnitudes up to this are coded in unary.
const UNARY: usize = 15;

/// Bits of what is beyond.
const MAX_ESCAPE: u32 = 20;

/// The distribution of displacements of one level.
struct Displacements {
    unary: [[Bit; UNARY]; CONTEXTS],
    escape: [Bit; MAX_ESCAPE as usize],
    sign: Bit,
}

impl Displacements {
    fn new() -> Self {
        Self { unary: [[Bit::NEW; UNARY]; CONTEXTS], escape: [Bit::NEW; MAX_ESCAPE as usize], sign: Bit::NEW }
    }

    fn code(&mut self, coder: &mut impl Coder, context: usize, value: i32) -> i32 {
        let known = value.unsigned_abs();
        let unary = &mut self.unary[context];
        let mut magnitude = 0;
        while (magnitude as usize) < UNARY && coder.bit(&mut unary[magnitude as usize], known > magnitude) {
            magnitude += 1;
        }
        if magnitude as usize == UNARY {
            // The rest and one, as the number of its bits and the bits behind the first.
            let rest = (known + 1).saturating_sub(UNARY as u32).max(1);
            let mut bits = 0;
            while bits < MAX_ESCAPE && coder.bit(&mut self.escape[bits as usize], rest >> (bits + 1) > 0) {
                bits += 1;
            }
            let behind = coder.plain_bits(bits, rest & ((1 << bits) - 1));
            magnitude = (1 << bits | behind) - 1 + UNARY as u32;
        }
        let magnitude = magnitude as i32;
        if magnitude != 0 && coder.bit(&mut self.sign, value < 0) { -magnitude } else { magnitude }
    }
}

/// Codes the displacements of a level.
fn code_level(coder: &mut impl Coder, clues: &Clues, weights: &ClueWeights, displacements: &mut [i32]) {
    let mut model = Displacements::new();
    for i in 0..displacements.len() {
        let context = clues.context(weights, i, |j| displacements[j as usize].unsigned_abs());
        displacements[i] = model.code(coder, context, displacements[i]);
    }
}

/// The section. The displacements are in the order of the base mesh as it is written. Where they cost so little that a reader
/// would not believe it, zeros fill the section up.
pub(super) fn write(base: &ManifoldMesh, levels: &[Level]) -> Vec<u8> {
    let (weights, mut stream) = coded(base, levels);
    while !is_plausible(base, levels.len(), stream.len()) {
        stream.push(0);
    }
    let mut w = Writer::default();
    w.u8(levels.len() as u8);
    w.f32s(levels.iter().map(|level| level.step));
    weights.iter().for_each(|weights| w.0.extend(weights));
    w.0.extend(stream);
    w.0
}

impl Levels {
    /// Bytes of the base mesh and the levels in a file. O(n).
    ///
    /// # Panics
    /// If the levels do not fit the mesh.
    pub fn coded_size(&self, base: &ManifoldMesh) -> usize {
        let Levelled { base, mesh, levels, .. } = write_levelled(base, self);
        base.len() + write(&mesh, &levels.levels).len()
    }
}

/// The weights of the clues of every level, and the stream.
fn coded(base: &ManifoldMesh, levels: &[Level]) -> (Vec<ClueWeights>, Vec<u8>) {
    let mut all = Vec::with_capacity(levels.len());
    let hierarchy = Hierarchy::new(base, levels.len().saturating_sub(1));
    let mut coarser = vec![0; base.vertex_count()];
    let mut coder = Encoder::new();
    for (l, level) in levels.iter().enumerate() {
        let below = hierarchy.level(l);
        let clues = Clues::new(below, &coarser);
        let magnitude = |i: u32| level.displacements[i as usize].unsigned_abs();
        let weights = fitted_weights(&clues, &level.displacements);
        all.push(weights);
        code_level(&mut coder, &clues, &weights, &mut level.displacements.clone());
        coarser = energies(below, &coarser, magnitude);
    }
    (all, coder.finish())
}

/// Reads the section.
pub(super) fn read(mut r: Reader<'_>, base: &ManifoldMesh) -> Result<Vec<Level>, ModelError> {
    let count = usize::from(r.u8()?);
    if count > MAX_LEVELS {
        return Err(r.defect(LevelsError::Count(count)));
    }
    let steps = r.f32s(count)?;
    let weights = r.u8s(count * CLUES)?;
    let (weights, _) = weights.as_chunks();
    check_size(base, count).map_err(|e| r.defect(e))?;
    let stream = r.rest();
    if !is_plausible(base, count, stream.len()) {
        return Err(
            r.defect(FileDefect::TooLarge("it announces more displacements than its bytes can hold".into()))
        );
    }
    let mut coder = Decoder::new(stream);
    let hierarchy = Hierarchy::new(base, count.saturating_sub(1));
    let mut coarser = vec![0; base.vertex_count()];
    let mut levels = Vec::with_capacity(count);
    for (l, (step, weights)) in steps.into_iter().zip(weights).enumerate() {
        let below = hierarchy.level(l);
        let mut displacements = vec![0; below.edges().len()];
        code_level(&mut coder, &Clues::new(below, &coarser), weights, &mut displacements);
        if coder.is_exhausted() {
            return Err(r.truncated());
        }
        coarser = energies(below, &coarser, |i| displacements[i as usize].unsigned_abs());
        levels.push(Level { step, displacements });
    }
    if !coder.has_only_zeros() {
        return Err(r.defect(FileDefect::TrailingBytes("its end")));
    }
    Ok(levels)
}
