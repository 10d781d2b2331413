//! Neural dual contouring (Chen, Tagliasacchi, Funkhouser and Zhang 2022) of signed distances: NDC, and its deeper variant
//! NDCx.
//!
//! A convolutional network sees the distances at 7³ corners around a cell and says where in the cell its vertex is. Each
//! edge of the grid with ends on different sides has a quadrilateral of the vertices of the four cells around it. So meshes
//! may pass through themselves and touch themselves along edges, as those of the paper may.
//!
//! The authors' weights are not public with their code; [`NeuralDualContouring::from_tensors`] reads them, and those that
//! `experiments/ndc/train.py` makes, from a state of PyTorch's. What is ours: the network runs where the surface is, and
//! in its neighbourhood as far as it sees, not on the whole grid; quadrilaterals are cut along the shorter diagonal.

mod convolution;
mod network;
#[cfg(test)]
mod tests;

use ndf_core::{BoundingBox, DVec3, ImplicitField, Inside, Progress};
use ndf_mesh::TriangleMesh;
use ndf_meshing::IsosurfaceError;
use ndf_meshing::marching_cubes::Grid;
use rayon::prelude::*;

use convolution::{Lattice, Voxels};
pub use network::{NdcWeightsError, NeuralDualContouring};

/// Points handed to a field at a time.
const BATCH: usize = 512;
/// Corners that the network sees on each side of that of a cell.
const SEEN: u32 = 3;
/// Distances are cut off at so many cells, as in training.
const CUT: f64 = 2.0;

/// How to sample a field of distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NdcOptions {
    /// Cells along the longest side of the bounds. A margin of at least one cell is added on every side.
    pub grid: u32,
    /// The box to look in; the bounds of the field if not given.
    pub bounds: Option<BoundingBox>,
}

impl Default for NdcOptions {
    fn default() -> Self {
        Self { grid: 64, bounds: None }
    }
}

/// A surface with a vertex a cell.
#[derive(Clone, Debug)]
pub struct DualContour {
    /// The surface, oriented from inside to outside. Not a manifold everywhere.
    pub mesh: TriangleMesh,
    /// Number of cells along each axis, margin included.
    pub cells: [u32; 3],
    /// Side of a cell.
    pub cell: f64,
    /// How many points the field was evaluated at.
    pub evaluations: u64,
}

impl NeuralDualContouring {
    /// The surface of a field of signed distances. It is asked at all corners of the grid and of three cells more on every
    /// side. About 0.2 ms a crossed cell on one core. Deterministic, over all threads.
    ///
    /// # Errors
    /// As for [`marching_cubes`](ndf_meshing::marching_cubes()).
    pub fn contour(
        &self,
        field: &dyn ImplicitField,
        options: &NdcOptions,
        progress: &dyn Progress,
    ) -> Result<DualContour, IsosurfaceError> {
        let grid = Grid::of_field(field, options.bounds, options.grid)?;
        let go_on = |fraction: f64| {
            progress.report("neural dual contouring", fraction);
            progress.check().map_err(|_| IsosurfaceError::Cancelled)
        };
        go_on(0.0)?;
        let lattice = Lattice::new(grid.cells.map(|n| n + 1 + 2 * SEEN));
        let distances = distances(field, grid, lattice);
        go_on(0.3)?;
        let cells = crossed_cells(lattice, &distances);
        let evaluations = lattice.len() as u64;
        if cells.places.is_empty() {
            return Err(IsosurfaceError::NoCrossing { level: field.level(), evaluations, cell: grid.cell });
        }
        let offsets = self.offsets(lattice, &distances, &cells.places, &|share| go_on(0.3 + 0.6 * share))?;
        let position = |(&place, offset): (&u32, &[f32; 3])| {
            // The lattice begins three corners before the grid.
            let corner = DVec3::from_array(lattice.coordinates(place).map(f64::from)) - f64::from(SEEN);
            let offset = DVec3::from_array(offset.map(|x| f64::from(x).clamp(0.0, 1.0)));
            grid.origin + grid.cell * (corner + offset)
        };
        let positions: Vec<DVec3> = cells.places.iter().zip(&offsets).map(position).collect();
        let faces = faces(lattice, &distances, &cells, &positions);
        go_on(1.0)?;
        let mesh = TriangleMesh::new(positions, faces).expect("faces name vertices made for them");
        Ok(DualContour { mesh, cells: grid.cells, cell: grid.cell, evaluations })
    }
}

/// Distances at all places of a lattice around a grid, in cells, negative inside and cut off.
fn distances(field: &dyn ImplicitField, grid: Grid, lattice: Lattice) -> Vec<f32> {
    let sign = match field.inside() {
        Inside::Below => 1.0,
        Inside::Above => -1.0,
    };
    let scale = sign / grid.cell;
    let mut distances = vec![0.0_f32; lattice.len()];
    distances.par_chunks_mut(BATCH).enumerate().for_each(|(batch, distances)| {
        let first = batch * BATCH;
        let point = |i: usize| {
            let corner = DVec3::from_array(lattice.coordinates(i as u32).map(f64::from)) - f64::from(SEEN);
            grid.origin + grid.cell * corner
        };
        let points: Vec<DVec3> = (first..first + distances.len()).map(point).collect();
        let mut values = vec![0.0; points.len()];
        field.values(&points, &mut values);
        for (distance, value) in distances.iter_mut().zip(values) {
            let value = scale * (value - field.level());
            // Where the field has no value is outside, far away.
            *distance = if value.is_nan() { CUT } else { value.clamp(-CUT, CUT) } as f32;
        }
    });
    distances
}

/// Whether a place of a lattice is the lowest corner of a cell of the grid that it surrounds.
fn is_cell(lattice: Lattice, at: [u32; 3]) -> bool {
    (0..3).all(|k| (SEEN..lattice.sides()[k] - SEEN - 1).contains(&at[k]))
}

/// The cells of the grid that have corners on both sides.
fn crossed_cells(lattice: Lattice, distances: &[f32]) -> Voxels {
    let is_crossed = |&place: &u32| {
        is_cell(lattice, lattice.coordinates(place)) && {
            let inside = (0..8_u32).map(|c| {
                let corner = lattice.moved(place, [0, 1, 2].map(|k| (c >> k & 1) as i32));
                distances[corner as usize] < 0.0
            });
            let count = inside.filter(|&is| is).count();
            0 < count && count < 8
        }
    };
    Voxels::new(lattice, (0..lattice.len() as u32).into_par_iter().filter(is_crossed).collect())
}

/// Two triangles for each crossed edge with four cells of the grid around it.
fn faces(lattice: Lattice, distances: &[f32], cells: &Voxels, positions: &[DVec3]) -> Vec<[u32; 3]> {
    let mut faces = Vec::new();
    for &place in &cells.places {
        let is_inside = distances[place as usize] < 0.0;
        for axis in 0..3 {
            let step = |k: usize, by: i32| {
                let mut way = [0; 3];
                way[(axis + k) % 3] = by;
                way
            };
            let far = lattice.moved(place, step(0, 1));
            if is_inside == (distances[far as usize] < 0.0) {
                continue;
            }
            // Around the axis, counter-clockwise.
            let back = [lattice.moved(place, step(1, -1)), lattice.moved(place, step(2, -1))];
            let ring = [place, back[0], lattice.moved(back[0], step(2, -1)), back[1]];
            let [Some(a), Some(b), Some(c), Some(d)] = ring.map(|cell| cells.number(cell)) else { continue };
            let mut quad = [a, b, c, d];
            if !is_inside {
                quad.reverse();
            }
            let length =
                |i: usize| positions[quad[i] as usize].distance_squared(positions[quad[i + 2] as usize]);
            if length(1) < length(0) {
                quad.rotate_left(1);
            }
            let [a, b, c, d] = quad;
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    faces
}
