//! The isosurface of a scalar field as a mesh that is manifold by construction.
//!
//! Marching cubes (Lorensen and Cline 1987) with the ambiguous faces resolved by the asymptotic decider
//! (Nielson and Hamann 1991) and generated tables, so that the result is an oriented manifold for any
//! values at the corners: closed inside the grid, with boundary only where the surface leaves it.

mod active;
mod cases;
pub mod cell;
mod crossing;
mod grid;
mod slab;
#[cfg(test)]
mod tests;

use ndf_core::{BoundingBox, ImplicitField, Progress};
use ndf_mesh::{ManifoldMesh, TriangleMesh};

use active::{ActiveBlocks, SLAB};
pub use grid::Grid;
use grid::Oriented;
use slab::{Growing, Slab, polygonize};

/// The most cells along the longest side.
pub const LARGEST_GRID: u32 = 2048;

/// How to sample a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarchingCubesOptions {
    /// Cells along the longest side of the bounds, from 1 to [`LARGEST_GRID`]. A margin of at least one cell is
    /// added on every side.
    pub grid: u32,
    /// The box to look in; the bounds of the field if not given.
    pub bounds: Option<BoundingBox>,
    /// The most times the field is looked at to place a vertex on its edge; 0 interpolates the values at the
    /// ends. The search ends early where the field is nearly linear: once for most vertices of a distance.
    pub refinement: u32,
}

impl Default for MarchingCubesOptions {
    fn default() -> Self {
        Self { grid: 128, bounds: None, refinement: 8 }
    }
}

/// An isosurface and how it was found.
#[derive(Clone, Debug)]
pub struct Isosurface {
    /// The surface, oriented from inside to outside.
    pub mesh: ManifoldMesh,
    /// Number of cells along each axis, margin included.
    pub cells: [u32; 3],
    /// Side of a cell.
    pub cell: f64,
    /// How many points the field was evaluated at.
    pub evaluations: u64,
}

/// Why there is no isosurface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IsosurfaceError {
    /// The grid is empty or too fine.
    #[error("the grid must have 1 to {LARGEST_GRID} cells along its longest side, not {0}")]
    GridSize(u32),
    /// The box cannot be sampled.
    #[error("the bounds of the field are empty or not finite: {} to {}", .0.min, .0.max)]
    Bounds(BoundingBox),
    /// The field has only one side at the corners of the grid.
    #[error(
        "no isosurface: the field does not cross its level {level} at any of {evaluations} points, between which {cell} is \
         the distance; what is thinner is missed"
    )]
    NoCrossing {
        /// The level looked for.
        level: f64,
        /// How many points were looked at.
        evaluations: u64,
        /// The side of a cell of the grid.
        cell: f64,
    },
    /// More vertices or faces than indices can name.
    #[error("the isosurface has more than 2³² vertices or half-edges; use a coarser grid")]
    TooLarge,
    /// Space was skipped that the surface passes through.
    #[error(
        "the field changes faster than its Lipschitz bound {0} allows, so that the isosurface has cracks"
    )]
    WrongLipschitzBound(f64),
    /// The observer asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// The isosurface of a field.
///
/// A corner is inside if its value is strictly on the inner side of the level: a value equal to the level is
/// outside, and so is NaN (a vertex between NaN and the inside is found by bisection). Vertices keep 10⁻⁴ of a cell
/// away from corners, so that no face is without area. The mesh does not depend on the number of threads.
///
/// If the field has a [Lipschitz bound](ImplicitField::lipschitz), only blocks that can be crossed are sampled:
/// of the order of `grid²` points; otherwise all `grid³` are. Memory: 42 bytes a corner of 8 layers, and the
/// mesh.
///
/// # Errors
/// See [`IsosurfaceError`].
pub fn marching_cubes(
    field: &dyn ImplicitField,
    options: &MarchingCubesOptions,
    progress: &dyn Progress,
) -> Result<Isosurface, IsosurfaceError> {
    let grid = Grid::of_field(field, options.bounds, options.grid)?;
    let oriented = Oriented::new(field);
    let (growing, mut evaluations) = grow(oriented, grid, progress)?;
    if growing.faces.is_empty() {
        return Err(IsosurfaceError::NoCrossing { level: field.level(), evaluations, cell: grid.cell });
    }
    let (mut positions, looks) = crossing::positions(oriented, grid, &growing.crossings, options.refinement);
    evaluations += looks;
    for (vertex, polygon) in &growing.middles {
        let sum: ndf_core::DVec3 = polygon.iter().map(|&v| positions[v as usize]).sum();
        positions[*vertex as usize] = sum / polygon.len() as f64;
    }
    progress.report("marching cubes", 1.0);
    let mesh = TriangleMesh::new(positions, growing.faces).expect("faces name vertices made for them");
    let mesh = ManifoldMesh::try_from(mesh)
        .map_err(|_| IsosurfaceError::WrongLipschitzBound(field.lipschitz().unwrap_or(f64::INFINITY)))?;
    Ok(Isosurface { mesh, cells: grid.cells, cell: grid.cell, evaluations })
}

/// Topology of the surface, slab by slab, and the number of points looked at.
fn grow(field: Oriented<'_>, grid: Grid, progress: &dyn Progress) -> Result<(Growing, u64), IsosurfaceError> {
    let mut active = ActiveBlocks::new(field, grid);
    let mut growing = Growing::default();
    let mut evaluations = 0;
    let (mut below, mut spare) = (Slab::empty(grid), Slab::empty(grid));
    let mut blocks_below: Vec<[u32; 3]> = Vec::new();
    for low in (0..=grid.cells[2]).step_by(SLAB as usize) {
        if progress.cancelled() {
            return Err(IsosurfaceError::Cancelled);
        }
        progress.report("marching cubes", f64::from(low) / f64::from(grid.cells[2] + 1));
        let blocks = active.in_slab(low);
        let mut slab = spare.restart(low);
        slab.want(&blocks_below);
        slab.want(&blocks);
        evaluations += slab.evaluate(field);
        polygonize(&blocks_below, &mut below, &mut slab, &mut growing);
        // Half-edges are numbered in 32 bits, the last number is taken.
        if growing.faces.len() as u64 * 3 >= u64::from(u32::MAX) {
            return Err(IsosurfaceError::TooLarge);
        }
        (spare, below) = (below, slab);
        blocks_below = blocks;
    }
    // Where the last layer of corners is not the first of its slab, its cells are still to be done.
    polygonize(&blocks_below, &mut below, &mut spare, &mut growing);
    Ok((growing, evaluations + active.evaluations))
}
