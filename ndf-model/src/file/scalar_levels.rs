//! The `SLEV` section: scalar fields on levels of nodes as bytes.
//!
//! | type | what |
//! |---|---|
//! | u32, … | channels K and of each name, range, mean, deviation, as in `SCAL` |
//! | u8 | how often base faces are split |
//! | f32 | step of the coarsest level |
//! | u8 per level | by how many eighths of an octave its step is larger |
//! | to the end | one range coder: integers node by node, one for each channel |

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

use super::base;
use super::bytes::{Reader, Writer};
use super::error::ModelError;
use super::range_coder::{Bit, Coder, Decoder, Encoder, Integers};
use super::scalars::{read_channels, write_channels};
use crate::displacement_field::DisplacementField;
use crate::scalars::{
    ACTIVITIES, Channel, Extensions, NodeMesh, OWN_LEVELS, ScalarLevels, ScalarNumbers, ScalarsError,
    SurfaceScalars,
};
use ndf_mesh::io::FileDefect;

/// Tag of the section.
pub(super) const TAG: &str = "SLEV";

/// Integers a coded byte may stand for, beyond the first 2¹⁹: what a hostile file can ask for stays in proportion.
const MAX_PER_BYTE: usize = 1024;
const MAX_FREE: usize = 1 << 19;

fn is_plausible(integers: usize, bytes: usize) -> bool {
    integers <= MAX_FREE + MAX_PER_BYTE * bytes
}

impl NodeMesh {
    /// The nodes of a field with base faces split so often, in the order of its file. O(n log n) for n nodes.
    ///
    /// # Errors
    /// If there are too many of them.
    pub fn on(field: &DisplacementField, splits: u32) -> Result<Self, ScalarsError> {
        let (stored, order) = base::as_written(field.base(), field.levels().is_some());
        Self::new(&stored, &order.faces, splits)
    }
}

/// The nodes of a field and what extends values on them, made once for all sections that need them.
pub(super) struct Nodes<'a> {
    field: &'a DisplacementField,
    meshes: BTreeMap<u32, Arc<NodeMesh>>,
    extensions: BTreeMap<u32, Extensions>,
}

impl<'a> Nodes<'a> {
    pub(super) fn of(field: &'a DisplacementField) -> Self {
        Self { field, meshes: BTreeMap::new(), extensions: BTreeMap::new() }
    }

    fn mesh(&mut self, splits: u32) -> Result<Arc<NodeMesh>, ScalarsError> {
        let mesh = match self.meshes.entry(splits) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(place) => place.insert(Arc::new(NodeMesh::on(self.field, splits)?)),
        };
        Ok(Arc::clone(mesh))
    }

    /// The fields of these numbers.
    pub(super) fn fields(
        &mut self,
        splits: u32,
        channels: Vec<Channel>,
        numbers: ScalarNumbers,
    ) -> Result<SurfaceScalars, ScalarsError> {
        let mesh = self.mesh(splits)?;
        let extensions = match self.extensions.entry(splits) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(place) => place.insert(mesh.extensions(self.field)?),
        };
        SurfaceScalars::levelled(channels, mesh, extensions, numbers)
    }
}

impl SurfaceScalars {
    /// The same numbers on a field that is almost the same: what is on levels depends on where nodes are.
    pub(super) fn moved_to(&self, field: &DisplacementField) -> Self {
        let Some(levels) = self.levels() else { return self.clone() };
        let (channels, numbers) = (self.channels().to_vec(), levels.numbers().clone());
        let moved = Nodes::of(field).fields(levels.mesh().splits(), channels, numbers);
        moved.unwrap_or_else(|_| self.clone())
    }
}

/// What is known of the integers in a context.
#[derive(Clone)]
struct Context {
    nonzero: Bit,
    integers: Integers,
}

/// Codes the integers of all channels node by node.
fn code(coder: &mut impl Coder, mesh: &NodeMesh, channels: usize, integers: &mut [i32]) -> bool {
    let new = Context { nonzero: Bit::NEW, integers: Integers::new() };
    let mut contexts = vec![new; OWN_LEVELS * ACTIVITIES];
    for level in 0..mesh.nesting.levels() {
        for rank in mesh.nesting.level(level) {
            for k in 0..channels {
                let at = |rank: usize| rank * channels + k;
                let context = mesh.context(level, rank, |r| integers[at(r)].unsigned_abs());
                let Context { nonzero, integers: of } = &mut contexts[context];
                let value = &mut integers[at(rank)];
                *value = if coder.bit(nonzero, *value != 0) { of.code(coder, *value) } else { 0 };
            }
            if coder.is_exhausted() {
                return false;
            }
        }
    }
    true
}

/// The section of these fields. Where integers cost so little that a reader would not believe it, zeros fill it up.
pub(super) fn write(channels: &[Channel], levels: &ScalarLevels) -> Vec<u8> {
    let mut w = Writer::default();
    write_channels(&mut w, channels);
    w.u8(levels.mesh().splits() as u8);
    let ScalarNumbers { step, rises, integers } = levels.numbers();
    w.f32s([*step]);
    w.0.extend(rises);
    let mut coder = Encoder::new();
    code(&mut coder, levels.mesh(), channels.len(), &mut integers.clone());
    let mut stream = coder.finish();
    while !is_plausible(integers.len(), stream.len()) {
        stream.push(0);
    }
    w.0.extend(stream);
    w.0
}

/// Reads the section of fields on these nodes. Allocates no more than a small multiple of the bytes and of the base mesh
/// split as often as they say; what extends values, which takes longest, is made when all else is right.
pub(super) fn read(mut r: Reader<'_>, nodes: &mut Nodes<'_>) -> Result<SurfaceScalars, ModelError> {
    let channels = read_channels(&mut r)?;
    let splits = u32::from(r.u8()?);
    let step = r.f32()?;
    let mesh = nodes.mesh(splits).map_err(|e| r.defect(e))?;
    let rises = r.u8s(mesh.nesting.levels())?;
    let stream = r.rest();
    let count = mesh.nesting.len().saturating_mul(channels.len());
    if !is_plausible(count, stream.len()) {
        return Err(r.defect(FileDefect::truncated("it announces more integers than its bytes can hold")));
    }
    let (mut coder, mut integers) = (Decoder::new(stream), vec![0; count]);
    if !code(&mut coder, &mesh, channels.len(), &mut integers) {
        return Err(r.truncated());
    }
    if !coder.has_only_zeros() {
        return Err(r.defect(FileDefect::TrailingBytes("its end")));
    }
    let numbers = ScalarNumbers { step, rises, integers };
    nodes.fields(splits, channels, numbers).map_err(|e| r.defect(e))
}
