//! What the surface crosses: edges of the grid, faces and cells, and how those hang together.

use ndf_core::DVec3;
use ndf_meshing::marching_cubes::Grid;
use ndf_meshing::marching_cubes::cell::EDGE_CORNERS;
use rayon::prelude::*;

use super::cases::{HalfSpace, cases};

/// A half-space in the coordinates of the field.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bound {
    normal: DVec3,
    point: DVec3,
}

impl Bound {
    fn new(half: HalfSpace, origin: DVec3, cell: f64) -> Self {
        // The normals have components 0 and ±1, so that this is a point of the plane.
        let point = origin + half.normal * (cell * half.offset / half.normal.length_squared());
        Self { normal: half.normal, point }
    }

    /// How far inside a point is; negative outside.
    pub(crate) fn clearance(&self, p: DVec3) -> f64 {
        self.normal.dot(p - self.point)
    }
}

/// An edge of the grid with ends on different sides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    /// Its ends, the lower first.
    pub(crate) ends: [DVec3; 2],
    pub(crate) axis: usize,
    pub(crate) is_low_inside: bool,
}

/// Where the surface crosses a face of the grid, from one crossed edge to another.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    pub(crate) crossings: [u32; 2],
    /// The axis of the face's normal.
    pub(crate) normal: usize,
    /// What keeps it from other segments and loops. Where there is anything to keep it from, its point becomes a vertex.
    pub(crate) region: Vec<Bound>,
}

/// Where the surface crosses the sides of a cell.
#[derive(Clone, Debug)]
pub(crate) struct Loop {
    /// The corner of the cell with the smallest coordinates.
    pub(crate) low: DVec3,
    pub(crate) crossings: Vec<u32>,
    /// The segment from each crossing to the next.
    pub(crate) segments: Vec<u32>,
    /// For each crossing, which of the four cells around the edge this is, counter-clockwise around its axis.
    pub(crate) slots: Vec<u8>,
    pub(crate) region: Vec<Bound>,
}

/// All of it, in the order of the grid.
#[derive(Clone, Debug, Default)]
pub(crate) struct Complex {
    pub(crate) crossings: Vec<Crossing>,
    pub(crate) segments: Vec<Segment>,
    pub(crate) loops: Vec<Loop>,
}

/// Which of the cells around an edge has it at these bits of its two other axes.
fn slot(edge: u8) -> u8 {
    let axis = usize::from(edge / 4);
    let low = EDGE_CORNERS[usize::from(edge)][0];
    match [1, 2].map(|k| low >> ((axis + k) % 3) & 1) {
        [0, 0] => 0,
        [1, 0] => 1,
        [1, 1] => 2,
        _ => 3,
    }
}

/// The corners of a grid, numbered.
struct Corners {
    grid: Grid,
    counts: [u64; 3],
}

impl Corners {
    fn index(&self, [x, y, z]: [u32; 3]) -> u64 {
        (u64::from(z) * self.counts[1] + u64::from(y)) * self.counts[0] + u64::from(x)
    }

    /// The number of an edge of a cell.
    fn edge(&self, cell: [u32; 3], edge: u8) -> u64 {
        3 * self.index(self.corner(cell, EDGE_CORNERS[usize::from(edge)][0])) + u64::from(edge / 4)
    }

    fn corner(&self, cell: [u32; 3], c: u8) -> [u32; 3] {
        [0, 1, 2].map(|k| cell[k] + u32::from(c >> k & 1))
    }

    fn crossing(&self, number: u64, inside: &[bool]) -> Crossing {
        let (corner, axis) = (number / 3, (number % 3) as usize);
        let [width, rows, _] = self.counts;
        let low = [corner % width, corner / width % rows, corner / width / rows].map(|x| x as u32);
        let mut high = low;
        high[axis] += 1;
        let ends = [low, high].map(|c| self.grid.corner(c));
        Crossing { ends, axis, is_low_inside: inside[corner as usize] }
    }
}

/// A loop before its crossings and segments are numbered through.
struct Found {
    cell: [u32; 3],
    pattern: u8,
    case: usize,
    edges: Vec<u64>,
}

impl Complex {
    /// What a surface crosses with these sides at the corners of a grid, x first, then y, then z. Those of its border
    /// must be outside.
    pub(crate) fn new(grid: Grid, inside: &[bool]) -> Self {
        let corners = Corners { grid, counts: grid.cells.map(|n| u64::from(n) + 1) };
        let found: Vec<Found> = (0..grid.cells[2])
            .into_par_iter()
            .flat_map_iter(|z| loops_of_layer(&corners, z, inside))
            .collect();
        let mut edges: Vec<u64> = found.iter().flat_map(|l| l.edges.iter().copied()).collect();
        edges.par_sort_unstable();
        edges.dedup();
        let crossings = edges.par_iter().map(|&number| corners.crossing(number, inside)).collect();
        let number = |edge: &u64| edges.binary_search(edge).expect("every edge of a loop is there") as u32;

        let mut loops: Vec<Loop> = found.par_iter().map(|l| numbered(&corners, l, number)).collect();
        let mut sides: Vec<([u32; 2], u32, u32)> = Vec::new();
        for (l, of_cell) in (0..).zip(&loops) {
            for (i, &start) in (0..).zip(&of_cell.crossings) {
                let end = of_cell.crossings[(i as usize + 1) % of_cell.crossings.len()];
                sides.push(([start.min(end), start.max(end)], l, i));
            }
        }
        sides.par_sort_unstable();
        let mut segments: Vec<Segment> = Vec::with_capacity(sides.len() / 2);
        for (crossings, l, i) in sides {
            let (Found { cell, pattern, case, .. }, side) = (&found[l as usize], i as usize);
            let case = &cases(*pattern)[*case].segments[side];
            if segments.last().is_none_or(|last| last.crossings != crossings) {
                segments.push(Segment { crossings, normal: usize::from(case.normal), region: Vec::new() });
            }
            loops[l as usize].segments[side] = segments.len() as u32 - 1;
            let low = grid.corner(*cell);
            let bounds = case.region.iter().map(|&half| Bound::new(half, low, grid.cell));
            segments.last_mut().expect("one was added").region.extend(bounds);
        }
        Self { crossings, segments, loops }
    }
}

fn loops_of_layer(corners: &Corners, z: u32, inside: &[bool]) -> Vec<Found> {
    let [width, rows, _] = corners.grid.cells;
    let mut found = Vec::new();
    for y in 0..rows {
        for x in 0..width {
            let cell = [x, y, z];
            let base = corners.index(cell) as usize;
            let [row, layer] = [corners.counts[0], corners.counts[0] * corners.counts[1]].map(|n| n as usize);
            let places = [0, 1, row, row + 1, layer, layer + 1, layer + row, layer + row + 1];
            let pattern = (0..8).fold(0_u8, |pattern, c| pattern | u8::from(inside[base + places[c]]) << c);
            for (case, of_cell) in cases(pattern).iter().enumerate() {
                let edges = of_cell.edges.iter().map(|&e| corners.edge(cell, e)).collect();
                found.push(Found { cell, pattern, case, edges });
            }
        }
    }
    found
}

fn numbered(corners: &Corners, found: &Found, number: impl Fn(&u64) -> u32) -> Loop {
    let case = &cases(found.pattern)[found.case];
    let low = corners.grid.corner(found.cell);
    Loop {
        low,
        crossings: found.edges.iter().map(number).collect(),
        segments: vec![u32::MAX; found.edges.len()],
        slots: case.edges.iter().map(|&e| slot(e)).collect(),
        region: case.region.iter().map(|&half| Bound::new(half, low, corners.grid.cell)).collect(),
    }
}
