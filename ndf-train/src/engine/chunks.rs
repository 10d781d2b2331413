//! How a batch is cut.

use std::ops::Range;

use crate::objective::Place;

/// Chunks a batch is cut into at most, whatever the number of threads, so that sums come out the same.
pub(crate) const CHUNKS: usize = 32;

/// A part of a batch: whole faces and their samples.
#[derive(Clone, Debug)]
pub(crate) struct Chunk {
    pub(crate) faces: Range<usize>,
    pub(crate) samples: Range<usize>,
}

/// The parts of a batch, about as many samples in each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chunks(Vec<Chunk>);

impl Chunks {
    /// Cuts samples that are ordered by face into `count` chunks, which have all faces of the mesh between them.
    pub(crate) fn new(places: &[Place], face_count: usize, count: usize) -> Self {
        let (mut face, mut start) = (0, 0);
        let chunk = |k: usize| {
            // Up to the first face of which no sample is in this share.
            let share = k * places.len() / count;
            let end_face = match share.checked_sub(1) {
                _ if k == count => face_count,
                Some(last) => places[last].face.index() + 1,
                None => 0,
            };
            let end = places.partition_point(|place| place.face.index() < end_face);
            Chunk {
                faces: std::mem::replace(&mut face, end_face)..end_face,
                samples: std::mem::replace(&mut start, end)..end,
            }
        };
        Self((1..=count).map(chunk).collect())
    }

    /// Whether nothing was cut yet.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn as_slice(&self) -> &[Chunk] {
        &self.0
    }

    pub(crate) fn iter(&self) -> std::slice::Iter<'_, Chunk> {
        self.0.iter()
    }
}
