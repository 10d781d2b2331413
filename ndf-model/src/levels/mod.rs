//! Displacements along the normal on the levels of a subdivided base mesh: the coarse part of a displacement field, in
//! few bytes.
//!
//! The base mesh is the control mesh c₀ of a [Loop surface](ndf_mesh::subdivision). Level l = 1, 2, … refines it,
//! `c_l = S_l c_{l−1}`, and moves every new vertex by an integer times the level's step along the normal there: the normal
//! meshes of Guskov et al. (2000) on a smooth base, with the displaced subdivision surfaces of Lee, Moreton & Hoppe
//! (2000) as their one-level case. What is meant is the limit surface of the last level. [`LevelSurface`] evaluates it.

mod contexts;
mod predictor;
mod surface;
#[cfg(test)]
pub(crate) mod tests;

use ndf_core::DVec3;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::subdivision::{Creases, Refinement, Side};
use rayon::prelude::*;

pub use contexts::{CLUES, CONTEXTS, ClueWeights, Clues, Neighbours, energies, fitted_weights};
pub use predictor::{GateWeights, PARALLELOGRAM, Predictor};
pub use surface::LevelSurface;

/// The displacements of one level.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// What an integer counts.
    pub step: f32,
    /// Of every vertex that is new on this level, its displacement along the normal in steps.
    pub displacements: Vec<i32>,
}

/// A base mesh on a grid and the levels above it.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    /// What an integer of a position counts, in the box.
    pub spacing: f32,
    /// Control vertices of the base mesh, in spacings.
    pub control: Vec<[i32; 3]>,
    /// Where the base mesh is sharp.
    pub creases: Creases,
    /// The levels, from the coarsest on.
    pub levels: Vec<Level>,
}

impl Levels {
    /// Control vertices of the base mesh in the box, exact in `f32`.
    pub fn positions(&self) -> Vec<DVec3> {
        let at = |q: i32| f64::from((f64::from(q) * f64::from(self.spacing)) as f32);
        self.control.iter().map(|p| DVec3::from(p.map(at))).collect()
    }

    /// The surface. `base` is a mesh with the connectivity of the base mesh; its positions do not count.
    ///
    /// # Errors
    /// If the levels do not fit the mesh.
    pub fn surface(&self, base: &ManifoldMesh) -> Result<LevelSurface, LevelsError> {
        self.validate(base)?;
        let depth = self.levels.len() + 1;
        let hierarchy = Hierarchy::new(base, &self.creases, depth - 1);
        let mut control = self.positions();
        for (l, level) in (1..).zip(&self.levels) {
            let step = f64::from(level.step);
            (control, _) = hierarchy.displaced(l, &control, |i| step * f64::from(level.displacements[i]));
        }
        let coarser = hierarchy.level(depth - 1);
        let points = coarser.refined_limit(&coarser.subdivide(&control));
        if !points.iter().all(|p| p.is_finite()) {
            return Err(LevelsError::NotFinite);
        }
        Ok(LevelSurface::new(depth as u32, coarser, points))
    }

    fn validate(&self, base: &ManifoldMesh) -> Result<(), LevelsError> {
        check_size(base, self.levels.len())?;
        if !(self.spacing.is_finite() && self.spacing > 0.0) {
            return Err(LevelsError::Spacing);
        }
        if self.control.len() != base.vertex_count() {
            return Err(LevelsError::Control { expected: base.vertex_count(), found: self.control.len() });
        }
        if self.control.as_flattened().iter().any(|q| q.unsigned_abs() > MAX_POSITION as u32) {
            return Err(LevelsError::Position);
        }
        let [mut edges, mut faces] = [base.topology().edge_count(), base.face_count()];
        for (level, Level { step, displacements }) in (1..).zip(&self.levels) {
            if !(step.is_finite() && *step > 0.0) {
                return Err(LevelsError::Step(level));
            }
            if displacements.len() != edges {
                return Err(LevelsError::Displacements {
                    level,
                    expected: edges,
                    found: displacements.len(),
                });
            }
            if displacements.iter().any(|q| q.unsigned_abs() > MAX_DISPLACEMENT as u32) {
                return Err(LevelsError::Large(level));
            }
            [edges, faces] = [2 * edges + 3 * faces, 4 * faces];
        }
        Ok(())
    }
}

/// Whether so many levels above a mesh are within the limits.
///
/// # Errors
/// If they are not.
pub fn check_size(base: &ManifoldMesh, levels: usize) -> Result<(), LevelsError> {
    if levels > MAX_LEVELS {
        return Err(LevelsError::Count(levels));
    }
    if base.face_count() > MAX_FACES || base.topology().edge_count() > MAX_FINEST_EDGES >> (2 * levels) {
        return Err(LevelsError::Faces);
    }
    Ok(())
}

/// Levels above a base mesh are at most so many: a level has four times the vertices of the one before.
pub const MAX_LEVELS: usize = 6;

/// The largest displacement, in steps.
pub const MAX_DISPLACEMENT: i32 = 1 << 20;

/// The largest coordinate of a control vertex, in spacings: what single precision tells apart.
pub const MAX_POSITION: i32 = 1 << 24;

/// Faces of a base mesh with levels.
pub const MAX_FACES: usize = 1 << 20;

/// Edges of the finest level with displacements: some ten gigabytes.
const MAX_FINEST_EDGES: usize = 1 << 25;

/// Why numbers are no levels of a base mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LevelsError {
    /// More than [`MAX_LEVELS`].
    #[error("{0} levels; at most {MAX_LEVELS} are possible")]
    Count(usize),
    /// A step that is not positive, or not finite.
    #[error("the step of level {0} is not a positive number")]
    Step(usize),
    /// As many displacements as other meshes have edges.
    #[error("level {level} has {found} displacements; the mesh below has {expected} edges")]
    Displacements {
        /// The level, from 1.
        level: usize,
        /// Edges of the level below.
        expected: usize,
        /// Displacements that there are.
        found: usize,
    },
    /// As many control vertices as other meshes have vertices.
    #[error("there are {found} control vertices for a base mesh of {expected}")]
    Control {
        /// Vertices of the base mesh.
        expected: usize,
        /// Control vertices that there are.
        found: usize,
    },
    /// A spacing that is not positive, or not finite.
    #[error("the spacing of the control vertices is not a positive number")]
    Spacing,
    /// A control vertex farther from the origin than [`MAX_POSITION`].
    #[error("a control vertex is too far from the origin for its spacing")]
    Position,
    /// A mesh of more faces than a file may have.
    #[error(
        "the base mesh has too many faces for so many levels; at most {MAX_FACES}, and fewer with many levels"
    )]
    Faces,
    /// A displacement that is larger than any should be.
    #[error("a displacement of level {0} is too large")]
    Large(usize),
    /// The surface is not finite.
    #[error("the levels lead to positions that are not finite")]
    NotFinite,
}

/// The meshes of the levels, from the base mesh on, each with its vertices.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    refinements: Vec<Refinement>,
}

impl Hierarchy {
    /// The meshes of levels 0 to `levels` of a base mesh. O(4^levels · faces).
    ///
    /// # Panics
    /// If the creases are those of another mesh.
    pub fn new(base: &ManifoldMesh, creases: &Creases, levels: usize) -> Self {
        let mut refinements = vec![Refinement::from_mesh(base).with_creases(creases)];
        for _ in 0..levels {
            refinements.push(refinements[refinements.len() - 1].refined());
        }
        Self { refinements }
    }

    /// The mesh of a level.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn level(&self, level: usize) -> &Refinement {
        &self.refinements[level]
    }

    /// Of every edge of every level of `other` its number here. `vertices` are the numbers here of the vertices of the other
    /// base mesh, which has the same connectivity in another order. O(n log n).
    ///
    /// # Panics
    /// If the meshes do not correspond.
    pub(crate) fn edges_in_order_of(&self, other: &Self, vertices: &[u32]) -> Vec<Vec<u32>> {
        let sorted = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        let mut vertices = vertices.to_vec();
        let mut orders = Vec::with_capacity(self.refinements.len());
        for (here, there) in self.refinements.iter().zip(&other.refinements) {
            let mut edges: Vec<([u32; 2], u32)> =
                here.edges().iter().zip(0..).map(|(side, e)| (sorted(side.ends), e)).collect();
            edges.par_sort_unstable();
            let number = |ends: [u32; 2]| {
                let at = edges.binary_search_by_key(&ends, |&(ends, _)| ends);
                edges[at.expect("the edge is in both meshes")].1
            };
            let renamed = |side: &Side| sorted(side.ends.map(|v| vertices[v as usize]));
            let order: Vec<u32> = there.edges().par_iter().map(|side| number(renamed(side))).collect();
            vertices.extend(order.iter().map(|e| here.vertex_count() as u32 + e));
            orders.push(order);
        }
        orders
    }

    /// Number of levels above the base mesh.
    pub fn levels(&self) -> usize {
        self.refinements.len() - 1
    }

    /// Control vertices of the next level: subdivided, and the new ones moved along the normal by `displacement(i)` for
    /// the i-th of them. Also the normals of the new ones.
    pub fn displaced(
        &self,
        level: usize,
        coarser: &[DVec3],
        displacement: impl Fn(usize) -> f64,
    ) -> (Vec<DVec3>, Vec<DVec3>) {
        let mut finer = self.level(level - 1).subdivide(coarser);
        let mut normals = self.level(level).normals(&finer);
        normals.drain(..coarser.len());
        for (i, (p, n)) in finer[coarser.len()..].iter_mut().zip(&normals).enumerate() {
            *p += displacement(i) * *n;
        }
        (finer, normals)
    }
}
