//! The `LEVL` section: displacements on the levels of a subdivided base mesh.

use super::base::LevelledBase;
use super::bytes::{Reader, Writer};
use super::error::ModelError;
use super::range_coder::{Bit, Coder, Decoder, Encoder};
use crate::levels::{
    CLUES, CONTEXTS, ClueWeights, Clues, Hierarchy, Level, Levels, LevelsError, MAX_LEVELS, Neighbours,
    check_size, energies, fitted_weights,
};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::io::FileDefect;
use ndf_mesh::subdivision::{Creases, Refinement};
use rayon::prelude::*;

/// The tag.
pub(super) const TAG: &str = "LEVL";

/// Displacements a coded byte may stand for, beyond the first 2¹⁹: what a hostile file can ask for stays in proportion.
const MAX_PER_BYTE: usize = 64;
const MAX_FREE: usize = 1 << 19;

fn is_plausible(base: &ManifoldMesh, levels: usize, bytes: usize) -> bool {
    // A level has at most four times as many edges as the one below.
    let finest = base.topology().edge_count().saturating_mul(1 << (2 * levels));
    finest <= MAX_FREE + MAX_PER_BYTE * bytes
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
fn code_level(coder: &mut impl Coder, clues: &Clues<'_>, weights: &ClueWeights, displacements: &mut [i32]) {
    let mut model = Displacements::new();
    for i in 0..displacements.len() {
        let context = clues.context(weights, i, |j| displacements[j as usize].unsigned_abs());
        displacements[i] = model.code(coder, context, displacements[i]);
    }
}

/// Codes creases, and corners among the vertices that may be some; each if there are any.
fn code_creases(
    coder: &mut impl Coder,
    mesh: &Refinement,
    [has_creases, has_corners]: [bool; 2],
    known: Creases,
) -> Creases {
    // An edge is the likelier to be a crease the more creases end where it does.
    let mut models = [[Bit::NEW; 3]; 3];
    let mut ending = vec![0_u8; mesh.vertex_count()];
    let mut edges = vec![false; if has_creases { mesh.edges().len() } else { 0 }];
    for (e, is_crease) in edges.iter_mut().enumerate() {
        let side = &mesh.edges()[e];
        if side.is_boundary() {
            continue;
        }
        let [a, b] = side.ends.map(|v| usize::from(ending[v as usize]).min(2));
        *is_crease = coder.bit(&mut models[a][b], known.is_crease(e));
        if *is_crease {
            side.ends.into_iter().for_each(|v| ending[v as usize] = ending[v as usize].saturating_add(1));
        }
    }
    let is_crease = |e: usize| has_creases && edges[e];
    let mut corners = vec![false; if has_corners { mesh.vertex_count() } else { 0 }];
    if has_corners {
        let candidates = Creases::new(mesh, is_crease, |_| false).candidates(mesh);
        let mut model = Bit::NEW;
        for (v, is_corner) in corners.iter_mut().enumerate().filter(|(v, _)| candidates[*v]) {
            *is_corner = coder.bit(&mut model, known.is_corner(v));
        }
    }
    Creases::new(mesh, is_crease, |v| has_corners && corners[v])
}

/// Writes levels above one base mesh, as often as wanted: what depends on the connectivity alone is made once.
#[derive(Clone, Debug)]
pub struct LevelCoder {
    base: LevelledBase,
    /// The displacement that became every displacement of a level.
    orders: Vec<Vec<u32>>,
    hierarchy: Hierarchy,
    neighbours: Vec<Neighbours>,
}

impl LevelCoder {
    /// A coder for `levels` levels above this base mesh, whose positions do not count. O(4^levels · faces).
    pub fn new(base: &ManifoldMesh, levels: usize) -> Self {
        let coded = LevelledBase::new(base);
        let depth = levels.saturating_sub(1);
        let smooth = Creases::default();
        let hierarchy = Hierarchy::new(&coded.mesh, &smooth, depth);
        let orders = Hierarchy::new(base, &smooth, depth).edges_in_order_of(&hierarchy, &coded.order);
        let neighbours = (0..levels).map(|l| Neighbours::new(hierarchy.level(l))).collect();
        Self { base: coded, orders, hierarchy, neighbours }
    }

    /// Bytes of the base mesh and of the levels in a file. O(n).
    ///
    /// # Panics
    /// If the levels do not fit the mesh.
    pub fn sizes(&self, levels: &Levels) -> [usize; 2] {
        self.write(levels).map(|section| section.len())
    }

    /// Old numbers of the vertices in the file.
    pub(super) fn order(&self) -> &[u32] {
        &self.base.order
    }

    /// The sections of base mesh and levels. Where displacements cost so little that a reader would not believe it,
    /// zeros fill the latter up.
    pub(super) fn write(&self, levels: &Levels) -> [Vec<u8>; 2] {
        let control: Vec<[i32; 3]> = self.order().iter().map(|&v| levels.control[v as usize]).collect();
        let mut w = Writer::default();
        w.u8(levels.levels.len() as u8);
        w.f32s(levels.levels.iter().map(|level| level.step));
        let mut coder = Encoder::new();
        let [edges, vertices] = [&self.orders[0], &self.base.order];
        let level = self.hierarchy.level(0);
        let creases = Creases::new(
            level,
            |e| levels.creases.is_crease(edges[e] as usize),
            |v| levels.creases.is_corner(vertices[v] as usize),
        );
        let flags = creases.has();
        w.u8(u8::from(flags[0]) | u8::from(flags[1]) << 1);
        code_creases(&mut coder, level, flags, creases);
        let mut coarser = vec![0; self.base.mesh.vertex_count()];
        for (l, level) in levels.levels.iter().enumerate() {
            let mut displacements: Vec<i32> =
                self.orders[l].iter().map(|&e| level.displacements[e as usize]).collect();
            let clues = Clues::new(&self.neighbours[l], &coarser);
            let weights = fitted_weights(&clues, &displacements);
            w.0.extend(weights);
            code_level(&mut coder, &clues, &weights, &mut displacements);
            let magnitude = |i: u32| displacements[i as usize].unsigned_abs();
            coarser = energies(self.hierarchy.level(l), &coarser, magnitude);
        }
        let mut stream = coder.finish();
        while !is_plausible(&self.base.mesh, levels.levels.len(), stream.len()) {
            stream.push(0);
        }
        w.0.extend(stream);
        [self.base.write(levels.spacing, &control), w.0]
    }
}

/// Reads the section.
pub(super) fn read(mut r: Reader<'_>, base: &ManifoldMesh) -> Result<(Creases, Vec<Level>), ModelError> {
    let count = usize::from(r.u8()?);
    if count > MAX_LEVELS {
        return Err(r.defect(LevelsError::Count(count)));
    }
    let steps = r.f32s(count)?;
    let flags = r.u8()?;
    if flags > 3 {
        return Err(r.defect(FileDefect::Value("it has parts that this version does not know".into())));
    }
    let weights = r.u8s(count * CLUES)?;
    let (weights, _) = weights.as_chunks();
    check_size(base, count).map_err(|e| r.defect(e))?;
    let stream = r.rest();
    if !is_plausible(base, count, stream.len()) {
        return Err(
            r.defect(FileDefect::truncated("it announces more displacements than its bytes can hold"))
        );
    }
    let mut coder = Decoder::new(stream);
    let hierarchy = Hierarchy::new(base, &Creases::default(), count.saturating_sub(1));
    let flags = [flags & 1 > 0, flags & 2 > 0];
    let creases = code_creases(&mut coder, hierarchy.level(0), flags, Creases::default());
    let mut coarser = vec![0; base.vertex_count()];
    let mut levels = Vec::with_capacity(count);
    let neighbours: Vec<Neighbours> =
        (0..count).into_par_iter().map(|l| Neighbours::new(hierarchy.level(l))).collect();
    for (l, (step, weights)) in steps.into_iter().zip(weights).enumerate() {
        let below = hierarchy.level(l);
        let mut displacements = vec![0; below.edges().len()];
        code_level(&mut coder, &Clues::new(&neighbours[l], &coarser), weights, &mut displacements);
        if coder.is_exhausted() {
            return Err(r.truncated());
        }
        coarser = energies(below, &coarser, |i| displacements[i as usize].unsigned_abs());
        levels.push(Level { step, displacements });
    }
    if !coder.has_only_zeros() {
        return Err(r.defect(FileDefect::TrailingBytes("its end")));
    }
    Ok((creases, levels))
}
