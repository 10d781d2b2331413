//! Occupancy-based dual contouring (Hwang and Sung 2024): sharp surfaces of fields of which only inside and outside are
//! known.
//!
//! A crossed edge of the grid has a 1-D point, found by bisection; a crossed face has a 2-D point, where lines through
//! further points of the surface in that face meet; a cell has a 3-D point for each loop in which the surface crosses its
//! sides, as in manifold dual contouring, the least squares of planes spanned by the former two. The points of the four
//! cells around a crossed edge make a quadrilateral.
//!
//! What is ours: where the two diagonal corners of a face are inside, the paper changes the pattern of both cells, so that
//! no edge gets four faces. Here the 2-D points of that face become vertices, as do those on the faces of cells with more
//! than one loop, and points of one cell keep to their sides of a plane between its loops. So the mesh is a manifold
//! without self-intersections by construction, not only nearly always. The corners at the border of the grid count as
//! outside, so that the mesh is closed. The regularisation is a row of 0.05 for each coordinate.

mod cases;
mod complex;
mod occupancy;
mod points;
mod polygons;
#[cfg(test)]
mod tests;

use ndf_core::{BoundingBox, DVec3, ImplicitField, Progress};
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_meshing::marching_cubes::Grid;
use ndf_meshing::{Isosurface, IsosurfaceError};
use rayon::prelude::*;

use complex::Complex;
use occupancy::Occupancy;
use polygons::{Polygons, polygons};

/// How to sample a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdcOptions {
    /// Cells along the longest side of the bounds. A margin of at least one cell is added on every side.
    pub grid: u32,
    /// The box to look in; the bounds of the field if not given.
    pub bounds: Option<BoundingBox>,
}

impl Default for OdcOptions {
    fn default() -> Self {
        Self { grid: 128, bounds: None }
    }
}

/// The surface of a field by occupancy-based dual contouring. The field is asked at every corner of the grid inside its
/// border, then 15 times for each crossed edge and up to 52 times for each crossed face.
///
/// Deterministic, over all threads. Memory: a byte a corner and about a kilobyte a crossed cell.
///
/// # Errors
/// As for [`marching_cubes`](ndf_meshing::marching_cubes()).
pub fn occupancy_dual_contouring(
    field: &dyn ImplicitField,
    options: &OdcOptions,
    progress: &dyn Progress,
) -> Result<Isosurface, IsosurfaceError> {
    let grid = Grid::of_field(field, options.bounds, options.grid)?;
    let occupancy = Occupancy::new(field);
    let go_on = |fraction: f64| {
        progress.report("dual contouring", fraction);
        progress.check().map_err(|_| IsosurfaceError::Cancelled)
    };
    let inside = corners(&occupancy, grid, &|share| go_on(0.5 * share))?;
    let complex = Complex::new(grid, &inside);
    drop(inside);
    if complex.crossings.is_empty() {
        let evaluations = occupancy.queries();
        return Err(IsosurfaceError::NoCrossing { level: field.level(), evaluations, cell: grid.cell });
    }
    go_on(0.5)?;
    let on_edges = points::on_edges(&complex, &occupancy, grid.cell);
    go_on(0.6)?;
    let in_faces = points::in_faces(&complex, &on_edges, &occupancy, grid.cell);
    go_on(0.9)?;
    let in_cells = points::in_cells(&complex, &on_edges, &in_faces, grid.cell);
    let Polygons { positions, faces } = polygons(&complex, &on_edges, |i| in_faces[i].point, in_cells);
    if faces.len() as u64 * 3 >= u64::from(u32::MAX) {
        return Err(IsosurfaceError::TooLarge);
    }
    go_on(1.0)?;
    let mesh = TriangleMesh::new(positions, faces).expect("faces name vertices made for them");
    let mesh = ManifoldMesh::try_from(mesh).expect("the faces around the edges of a grid make a manifold");
    Ok(Isosurface { mesh, cells: grid.cells, cell: grid.cell, evaluations: occupancy.queries() })
}

/// Which corners of the grid are inside, x first, then y, then z. Those of the border are not looked at.
fn corners(
    occupancy: &Occupancy<'_>,
    grid: Grid,
    go_on: &dyn Fn(f64) -> Result<(), IsosurfaceError>,
) -> Result<Vec<bool>, IsosurfaceError> {
    let [width, rows, layers] = grid.cells;
    let [row, layer] = [width as usize + 1, (width as usize + 1) * (rows as usize + 1)];
    let mut inside = vec![false; layer * (layers as usize + 1)];
    for z in 1..layers {
        go_on(f64::from(z) / f64::from(layers))?;
        let corner = |i: usize| grid.corner([1 + i as u32 % (width - 1), 1 + i as u32 / (width - 1), z]);
        let count = (width - 1) as usize * (rows - 1) as usize;
        let points: Vec<DVec3> = (0..count).into_par_iter().map(corner).collect();
        let found = occupancy.inside(&points);
        for (y, of_row) in found.chunks((width - 1) as usize).enumerate() {
            let start = z as usize * layer + (y + 1) * row + 1;
            inside[start..start + of_row.len()].copy_from_slice(of_row);
        }
    }
    Ok(inside)
}
