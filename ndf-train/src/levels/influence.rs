//! How the points of a level surface move with its numbers: the columns of the subdivision matrices.

use nalgebra_sparse::{CooMatrix, CscMatrix, CsrMatrix};
use ndf_model::levels::Hierarchy;

/// Of every vertex that is new on a level, the points of the finest level that it moves, and how far.
#[derive(Clone, Debug)]
pub(super) struct Influence {
    starts: Vec<usize>,
    entries: Vec<(u32, f32)>,
}

impl Influence {
    /// The influences of the vertices of all levels but the finest, on the points of the finest level in the limit and
    /// after these once more on those of `boundary`.
    pub(super) fn of(hierarchy: &Hierarchy, boundary: &[u32]) -> Vec<Self> {
        let finest = hierarchy.level(hierarchy.levels());
        let mut matrix =
            assembled(finest.vertex_count(), finest.vertex_count(), |entry| finest.limit_entries(entry));
        let mut again = vec![None; if boundary.is_empty() { 0 } else { finest.vertex_count() }];
        boundary
            .iter()
            .zip(finest.vertex_count() as u32..)
            .for_each(|(&v, row)| again[v as usize] = Some(row));
        let mut influences = Vec::new();
        for level in (0..hierarchy.levels()).rev() {
            let coarse = hierarchy.level(level);
            let rows = coarse.vertex_count() + coarse.edges().len();
            let rule = assembled(rows, coarse.vertex_count(), |entry| coarse.subdivision_entries(entry));
            matrix = &matrix * &rule;
            let old = level.checked_sub(1).map_or(0, |below| hierarchy.level(below).vertex_count());
            influences.push(Self::columns(&CscMatrix::from(&matrix), old, &again));
        }
        influences.reverse();
        influences
    }

    /// Columns from `first` on, with the rows that stand for a row again.
    fn columns(matrix: &CscMatrix<f64>, first: usize, again: &[Option<u32>]) -> Self {
        let (offsets, rows, values) = matrix.csc_data();
        let (mut starts, mut entries) = (vec![0], Vec::with_capacity(rows.len() - offsets[first]));
        for column in offsets[first..].windows(2) {
            for (&row, &x) in rows[column[0]..column[1]].iter().zip(&values[column[0]..column[1]]) {
                entries.push((row as u32, x as f32));
                entries.extend(again.get(row).copied().flatten().map(|row| (row, x as f32)));
            }
            starts.push(entries.len());
        }
        Self { starts, entries }
    }

    /// Number of vertices.
    pub(super) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// The rows that vertex j moves: points, and after them those of the boundary.
    pub(super) fn of_vertex(&self, j: usize) -> &[(u32, f32)] {
        &self.entries[self.starts[j]..self.starts[j + 1]]
    }
}

/// The matrix with these entries.
fn assembled(
    rows: usize,
    columns: usize,
    entries: impl FnOnce(&mut dyn FnMut(u32, u32, f64)),
) -> CsrMatrix<f64> {
    let mut matrix = CooMatrix::new(rows, columns);
    entries(&mut |row, column, x| matrix.push(row as usize, column as usize, x));
    CsrMatrix::from(&matrix)
}
