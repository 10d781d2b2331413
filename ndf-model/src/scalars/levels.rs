//! Scalar fields as integers on levels of nodes.
//!
//! Nodes are the vertices of the base mesh, split a few times, on the surface. They become known [level by
//! level](super::nesting), from a handful to all; a node's value is what the [smoothest
//! function](super::prediction) through the nodes of coarser levels has there, and an integer times its level's step.
//! Between nodes values are linear on the faces of the split mesh. What is smooth needs integers on the coarse levels alone.

use std::sync::Arc;

use ndf_mesh::subdivision::Refinement;
use ndf_mesh::{Face, FacePoint, ManifoldMesh};

use super::error::ScalarsError;
use super::nesting::Nesting;
use super::prediction::Extensions;
use crate::displacement_field::DisplacementField;

/// Faces of a mesh with nodes, and of one that is split: what is predicted takes some seconds for so many.
const MAX_FACES: usize = 1 << 17;
const MAX_SPLIT_FACES: usize = 1 << 16;
/// Base meshes are split at most so often.
pub const MAX_SPLITS: u32 = 3;
/// Rises of steps are counted in so many parts of an octave.
pub const RISES: f64 = 8.0;
/// Contexts of the integers of a level by what is around them, and levels from the finest on that have contexts of their
/// own.
pub const ACTIVITIES: usize = 12;
/// As [`ACTIVITIES`].
pub const OWN_LEVELS: usize = 6;

/// The nodes of scalar fields on the surface of a field.
#[derive(Clone, Debug)]
pub struct NodeMesh {
    splits: u32,
    /// Faces of the split mesh in ranks of nodes; those of face f of the file are f · 4^splits and on.
    faces: Vec<[u32; 3]>,
    /// Of every base face, which face of the file it is, and which of its corners is the first there.
    places: Vec<(u32, u8)>,
    /// Where nodes are on the base mesh, rank by rank.
    points: Vec<FacePoint>,
    /// The levels of nodes.
    pub nesting: Nesting,
}

impl NodeMesh {
    /// The nodes on a field of which the base mesh is `stored` in the file; `first` are the half-edges of its base mesh that
    /// begin every face there. O(n log n) for n nodes.
    ///
    /// # Errors
    /// If there are too many of them.
    pub(crate) fn new(stored: &ManifoldMesh, first: &[u32], splits: u32) -> Result<Self, ScalarsError> {
        if splits > MAX_SPLITS {
            return Err(ScalarsError::Nodes);
        }
        let max_faces = if splits == 0 { MAX_FACES } else { MAX_SPLIT_FACES >> (2 * splits) };
        if stored.face_count() > max_faces {
            return Err(ScalarsError::Nodes);
        }
        let mut meshes = vec![Refinement::from_mesh(stored)];
        let mut corners = vec![[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]; stored.face_count()];
        for _ in 0..splits {
            meshes.push(meshes[meshes.len() - 1].refined());
            let middle = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]));
            let split = |&[a, b, c]: &[[f64; 3]; 3]| {
                let [x, y, z] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, x, z], [x, b, y], [z, y, c], [x, y, z]]
            };
            corners = corners.iter().flat_map(split).collect();
        }
        let finest = &meshes[meshes.len() - 1];
        let nesting = Nesting::new(&meshes);
        let mut ranks = vec![0; nesting.len()];
        nesting.order().iter().zip(0..).for_each(|(&node, rank)| ranks[node as usize] = rank);
        let faces: Vec<[u32; 3]> = finest.faces().iter().map(|f| f.map(|v| ranks[v as usize])).collect();
        // Where nodes are on the base mesh of the field.
        let mut points = vec![FacePoint { face: Face::new(0), barycentric: [1.0, 0.0, 0.0] }; nesting.len()];
        for (f, (face, corners)) in faces.iter().zip(&corners).enumerate() {
            let begin = first[f >> (2 * splits)] as usize;
            for (&rank, at) in face.iter().zip(corners) {
                let mut barycentric = [0.0; 3];
                (0..3).for_each(|c| barycentric[(begin + c) % 3] = at[c]);
                points[rank as usize] = FacePoint { face: Face::new(begin / 3), barycentric };
            }
        }
        let mut places = vec![(0, 0); first.len()];
        for (&begin, f) in first.iter().zip(0..) {
            places[begin as usize / 3] = (f, (begin % 3) as u8);
        }
        Ok(Self { splits, faces, places, points, nesting })
    }

    /// What extends values of coarse levels to finer ones on the surface of this field. O(n^1.5) for n nodes.
    ///
    /// # Errors
    /// If the mesh is too irregular.
    pub fn extensions(&self, field: &DisplacementField) -> Result<Extensions, ScalarsError> {
        Extensions::new(&self.nesting, &field.map(&self.points), &self.faces)
    }

    /// How often base faces are split.
    pub fn splits(&self) -> u32 {
        self.splits
    }

    /// The split face in which a point of the base mesh lies, and its coordinates there. O(splits).
    ///
    /// # Panics
    /// If the face does not exist in the base mesh.
    pub fn locate(&self, point: &FacePoint) -> (usize, [f64; 3]) {
        let (face, first) = self.places[point.face.index()];
        let (mut face, first) = (face as usize, usize::from(first));
        let mut b = [0, 1, 2].map(|c| point.barycentric[(first + c) % 3]);
        for _ in 0..self.splits {
            let child = (0..3).find(|&c| b[c] >= 0.5).unwrap_or(3);
            face = 4 * face + child;
            if child < 3 {
                b = b.map(|x| 2.0 * x);
                b[child] -= 1.0;
            } else {
                b = [1.0 - 2.0 * b[2], 1.0 - 2.0 * b[0], 1.0 - 2.0 * b[1]];
            }
        }
        (face, b)
    }

    /// Where nodes are on the base mesh, rank by rank.
    pub fn points(&self) -> &[FacePoint] {
        &self.points
    }

    /// Corners of the split faces, in ranks of nodes.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The context of an integer, one of [`OWN_LEVELS`] · [`ACTIVITIES`], from the `magnitude(rank)` of those before it.
    pub fn context(&self, level: usize, rank: usize, magnitude: impl Fn(usize) -> u32) -> usize {
        let before = self.nesting.before(rank);
        let sum: u64 = before.iter().map(|&r| u64::from(magnitude(r as usize).min(1 << 12))).sum();
        let mean = (4 * sum).checked_div(before.len() as u64).unwrap_or(0);
        let activity = (u64::BITS - mean.leading_zeros()) as usize;
        let from_finest = self.nesting.levels() - 1 - level;
        ACTIVITIES * from_finest.min(OWN_LEVELS - 1) + activity.min(ACTIVITIES - 1)
    }
}

/// The numbers of scalar fields on levels.
#[derive(Clone, Debug, PartialEq)]
pub struct ScalarNumbers {
    /// What an integer counts on the coarsest level, in units of the channel.
    pub step: f32,
    /// Of every level, by how many eighths of an octave its step is larger.
    pub rises: Vec<u8>,
    /// Integers rank by rank, one for each channel.
    pub integers: Vec<i32>,
}

impl ScalarNumbers {
    /// The step of a level.
    pub fn step_of(&self, level: usize) -> f64 {
        f64::from(self.step) * (f64::from(self.rises[level]) / RISES).exp2()
    }
}

/// Scalar fields on levels of nodes.
#[derive(Clone, Debug)]
pub struct ScalarLevels {
    mesh: Arc<NodeMesh>,
    numbers: ScalarNumbers,
    /// Values of all channels rank by rank, in units of the channels.
    values: Vec<f32>,
}

impl ScalarLevels {
    pub(super) fn new(
        mesh: Arc<NodeMesh>,
        extensions: &Extensions,
        numbers: ScalarNumbers,
        channels: usize,
    ) -> Result<Self, ScalarsError> {
        let nesting = &mesh.nesting;
        let fits = numbers.rises.len() == nesting.levels()
            && nesting.len().checked_mul(channels) == Some(numbers.integers.len());
        if !fits {
            return Err(ScalarsError::Integers);
        }
        if !(numbers.step.is_finite() && numbers.step > 0.0) {
            return Err(ScalarsError::Step);
        }
        let mut values = Vec::with_capacity(numbers.integers.len());
        for level in 0..nesting.levels() {
            let (ranks, step) = (nesting.level(level), numbers.step_of(level));
            let integers = &numbers.integers[ranks.start * channels..ranks.end * channels];
            values.extend(integers.iter().map(|&q| step * f64::from(q)));
        }
        extensions.accumulate(nesting, &mut values, channels);
        let values: Vec<f32> = values.into_iter().map(|x| x as f32).collect();
        if !values.iter().all(|x| x.is_finite()) {
            return Err(ScalarsError::NotFinite);
        }
        Ok(Self { mesh, numbers, values })
    }

    /// The nodes.
    pub fn mesh(&self) -> &NodeMesh {
        &self.mesh
    }

    /// The numbers that are stored.
    pub fn numbers(&self) -> &ScalarNumbers {
        &self.numbers
    }

    /// The values of all channels at a point, in units of the channels.
    pub(super) fn at(&self, point: &FacePoint, to: &mut [f32]) {
        let (face, weights) = self.mesh.locate(point);
        to.fill(0.0);
        for (&rank, weight) in self.mesh.faces[face].iter().zip(weights) {
            let values = &self.values[rank as usize * to.len()..][..to.len()];
            to.iter_mut().zip(values).for_each(|(to, x)| *to += weight as f32 * x);
        }
    }
}
