//! Algebraic multigrid by smoothed aggregation: solves with `L + σM` in memory proportional to the mesh.
//!
//! Vertices that are strongly coupled are gathered into aggregates, whose indicators, smoothed once, span the next coarser
//! level (Vaněk, Mandel and Brezina 1996). A cycle over the levels, with polynomials of Chebyshev for smoothers (Adams, Brezina,
//! Hu and Tuminaro 2003), preconditions conjugate gradients. Four right-hand sides go together, so that a matrix is read once for
//! all; everything but the coarsest level runs on all threads, in an order that does not depend on their number.

use crate::csr::CsrMatrix;
use crate::error::SpectralError;
use crate::factorisation::{Cholesky, Inverse, SymbolicCholesky};
use crate::orthonormal::Random;
use crate::panel::{Panel, Row, WIDTH, add_scaled, inner_products, multiply, scale_rows, scaled_sum};

/// Levels of fewer rows are factored.
const COARSEST: usize = 2000;
/// Couplings weaker than this part of the geometric mean of the diagonal entries are not aggregated along, on the finest level;
/// half as much on each coarser one (Vaněk, Mandel and Brezina 1996).
const STRONG: f64 = 0.08;
/// Degree of the smoothers.
const DEGREE: usize = 3;
/// Smoothers reduce what belongs to eigenvalues of the scaled matrix from this part of the largest one on.
const SMOOTHED: f64 = 0.1;
/// Applications by which the largest eigenvalue is estimated, and what may be missing of it.
const ESTIMATE: usize = 12;
const SAFETY: f64 = 1.1;
/// Iterations before giving up.
const MAX_ITERATIONS: usize = 300;

/// A positive definite matrix with the hierarchy that makes conjugate gradients fast.
pub(crate) struct Multigrid {
    levels: Vec<Level>,
    coarsest: Cholesky,
    /// The rows in their order.
    rows: Vec<usize>,
    /// The part of the right-hand side that residuals may have.
    tolerance: f64,
}

/// A level and how it hangs together with the next coarser one.
struct Level {
    matrix: CsrMatrix,
    inverse_diagonal: Vec<f64>,
    /// An upper bound of the eigenvalues of the matrix scaled by its diagonal.
    largest: f64,
    prolongation: CsrMatrix,
    restriction: CsrMatrix,
}

impl Multigrid {
    /// Levels for a positive definite matrix. O(n).
    ///
    /// # Errors
    /// If the coarsest level cannot be factored.
    pub(crate) fn new(matrix: CsrMatrix, tolerance: f64) -> Result<Self, SpectralError> {
        let rows = (0..matrix.row_count()).collect();
        let mut levels = Vec::new();
        let mut matrix = matrix;
        let mut strong = STRONG;
        while matrix.row_count() > COARSEST {
            let (aggregates, count) = aggregates(&matrix, strong);
            // As good as none are coupled.
            if count * 5 > matrix.row_count() * 4 {
                break;
            }
            let level = Level::new(matrix, &aggregates, count);
            matrix = level.coarse();
            levels.push(level);
            strong *= 0.5;
        }
        let coarsest = SymbolicCholesky::new(&matrix)?.cholesky(&matrix)?;
        Ok(Self { levels, coarsest, rows, tolerance })
    }

    /// Approximately solves on a level, by a cycle from it downwards.
    fn cycle(&self, level: usize, right: &Panel) -> Panel {
        let Some(here) = self.levels.get(level) else {
            let (order, position) = self.coarsest.order();
            let mut panel: Panel = order.iter().map(|&row| right[row]).collect();
            self.coarsest.solve_panel(&mut panel);
            return position.iter().map(|&row| panel[row]).collect();
        };
        let mut residual = right.clone();
        let mut solution = vec![Row::default(); right.len()];
        here.smooth(&mut solution, &mut residual, true);
        let mut coarse = Panel::new();
        multiply(&here.restriction, &residual, &mut coarse);
        let correction = self.cycle(level + 1, &coarse);
        let (mut fine, mut image) = (Panel::new(), Panel::new());
        multiply(&here.prolongation, &correction, &mut fine);
        add_scaled(&mut solution, Row([1.0; WIDTH]), &fine);
        multiply(&here.matrix, &fine, &mut image);
        add_scaled(&mut residual, Row([-1.0; WIDTH]), &image);
        here.smooth(&mut solution, &mut residual, false);
        solution
    }

    /// Conjugate gradients for each right-hand side, side by side. Returns the number of iterations.
    fn solve(&self, panel: &mut Panel) -> Result<usize, SpectralError> {
        let Some(finest) = self.levels.first() else {
            *panel = self.cycle(0, panel);
            return Ok(0);
        };
        let mut residual = std::mem::replace(panel, vec![Row::default(); panel.len()]);
        let mut direction = vec![Row::default(); residual.len()];
        let mut image = Panel::new();
        let goal = inner_products(&residual, &residual).0.map(|square| self.tolerance * square.sqrt());
        let mut before = [f64::INFINITY; WIDTH];
        for iterations in 0..MAX_ITERATIONS {
            let sizes = inner_products(&residual, &residual).0.map(f64::sqrt);
            if (0..WIDTH).all(|c| sizes[c] <= goal[c]) {
                return Ok(iterations);
            }
            let preconditioned = self.cycle(0, &residual);
            let energies = inner_products(&residual, &preconditioned).0;
            // What has converged stays: its next direction would be round-off.
            let going = |c: usize| sizes[c] > goal[c] && energies[c] > 0.0;
            let kept = std::array::from_fn(|c| if going(c) { energies[c] / before[c] } else { 0.0 });
            before = energies;
            scaled_sum(&mut direction, Row(kept), &preconditioned);
            multiply(&finest.matrix, &direction, &mut image);
            let curvatures = inner_products(&direction, &image).0;
            let step = std::array::from_fn(|c| if going(c) { energies[c] / curvatures[c] } else { 0.0 });
            add_scaled(panel, Row(step), &direction);
            add_scaled(&mut residual, Row(step.map(|x| -x)), &image);
        }
        let sizes = inner_products(&residual, &residual).0.map(f64::sqrt);
        let worst = (0..WIDTH).map(|c| self.tolerance * sizes[c] / goal[c]).fold(0.0, f64::max);
        Err(SpectralError::SolveNotConverged(worst))
    }
}

impl Inverse for Multigrid {
    fn order(&self) -> (&[usize], &[usize]) {
        (&self.rows, &self.rows)
    }

    fn solve_in_order(&self, panel: &mut Panel) -> Result<(), SpectralError> {
        self.solve(panel).map(|_| ())
    }
}

impl Level {
    fn new(matrix: CsrMatrix, aggregates: &[u32], count: usize) -> Self {
        let diagonal = |row| matrix.get(row, row).expect("a positive definite matrix has a diagonal");
        let inverse_diagonal: Vec<f64> = (0..matrix.row_count()).map(|row| 1.0 / diagonal(row)).collect();
        let largest = SAFETY * largest_eigenvalue(&matrix, &inverse_diagonal);
        let prolongation = smoothed(&matrix, &inverse_diagonal, 4.0 / 3.0 / largest, aggregates, count);
        let restriction = prolongation.transposed();
        Self { matrix, inverse_diagonal, largest, prolongation, restriction }
    }

    /// The matrix of the next coarser level: that of the same energy on what the aggregates span.
    fn coarse(&self) -> CsrMatrix {
        self.restriction.times(&self.matrix.times(&self.prolongation))
    }

    /// Adds to a solution a polynomial of the scaled matrix applied to the residual, which is kept up to date if asked for.
    fn smooth(&self, solution: &mut Panel, residual: &mut Panel, update: bool) {
        let (low, high) = (SMOOTHED * self.largest, self.largest);
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let sigma = middle / half;
        let mut rho = 1.0 / sigma;
        let mut direction = vec![Row::default(); residual.len()];
        let mut image = Panel::new();
        scale_rows(&mut direction, 0.0, 1.0 / middle, &self.inverse_diagonal, residual);
        for degree in 1..=DEGREE {
            add_scaled(solution, Row([1.0; WIDTH]), &direction);
            if degree == DEGREE && !update {
                return;
            }
            multiply(&self.matrix, &direction, &mut image);
            add_scaled(residual, Row([-1.0; WIDTH]), &image);
            let next = 1.0 / (2.0 * sigma - rho);
            scale_rows(&mut direction, next * rho, 2.0 * next / half, &self.inverse_diagonal, residual);
            rho = next;
        }
    }
}

/// The aggregate of every row, and how many there are: neighbourhoods of strong couplings that do not touch, then rows beside
/// them, then what is left.
fn aggregates(matrix: &CsrMatrix, strong: f64) -> (Vec<u32>, usize) {
    const NONE: u32 = u32::MAX;
    let rows = matrix.row_count();
    let diagonal: Vec<f64> = (0..rows).map(|row| matrix.get(row, row).unwrap_or(0.0)).collect();
    let neighbours = |row: usize| {
        let (columns, values) = matrix.row(row);
        columns.iter().zip(values).map(|(&column, &value)| (column, value)).filter({
            let diagonal = &diagonal;
            move |&(column, value)| {
                column != row && value * value > strong * strong * diagonal[row] * diagonal[column]
            }
        })
    };
    let mut of_row = vec![NONE; rows];
    let mut count = 0_u32;
    for row in 0..rows {
        if of_row[row] == NONE && neighbours(row).all(|(column, _)| of_row[column] == NONE) {
            of_row[row] = count;
            neighbours(row).for_each(|(column, _)| of_row[column] = count);
            count += 1;
        }
    }
    let roots = of_row.clone();
    for row in (0..rows).filter(|&row| roots[row] == NONE) {
        let beside = neighbours(row).filter(|(column, _)| roots[*column] != NONE);
        if let Some((column, _)) = beside.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) {
            of_row[row] = roots[column];
        }
    }
    for row in 0..rows {
        if of_row[row] == NONE {
            of_row[row] = count;
            for (column, _) in neighbours(row) {
                if of_row[column] == NONE {
                    of_row[column] = count;
                }
            }
            count += 1;
        }
    }
    (of_row, count as usize)
}

/// Indicators of aggregates, smoothed by a step of Jacobi's method with a damping.
fn smoothed(
    matrix: &CsrMatrix,
    inverse_diagonal: &[f64],
    damping: f64,
    aggregates: &[u32],
    count: usize,
) -> CsrMatrix {
    let mut offsets = vec![0];
    let (mut columns, mut values) = (Vec::new(), Vec::new());
    let mut entries: Vec<(u32, f64)> = Vec::new();
    for row in 0..matrix.row_count() {
        entries.clear();
        entries.push((aggregates[row], 1.0));
        let (neighbours, couplings) = matrix.row(row);
        let factor = -damping * inverse_diagonal[row];
        entries.extend(neighbours.iter().zip(couplings).map(|(&j, x)| (aggregates[j], factor * x)));
        entries.sort_by_key(|(aggregate, _)| *aggregate);
        for same in entries.chunk_by(|a, b| a.0 == b.0) {
            columns.push(same[0].0 as usize);
            values.push(same.iter().map(|(_, value)| value).sum());
        }
        offsets.push(columns.len());
    }
    CsrMatrix::new(count, offsets, columns, values).expect("aggregates ascend")
}

/// About the largest eigenvalue of a matrix scaled by its diagonal, from below.
fn largest_eigenvalue(matrix: &CsrMatrix, inverse_diagonal: &[f64]) -> f64 {
    let mut random = Random::default();
    let mut functions: Panel =
        inverse_diagonal.iter().map(|_| Row(std::array::from_fn(|_| random.next()))).collect();
    let mut image = Panel::new();
    let mut largest = 0.0_f64;
    for _ in 0..ESTIMATE {
        let sizes = inner_products(&functions, &functions).0.map(f64::sqrt);
        multiply(matrix, &functions, &mut image);
        scale_rows(&mut functions, 0.0, 1.0, inverse_diagonal, &image);
        let grown = inner_products(&functions, &functions).0.map(f64::sqrt);
        largest = (0..WIDTH).map(|c| grown[c] / sizes[c]).fold(0.0, f64::max);
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laplace_beltrami::{LaplaceBeltrami, OperatorOptions};
    use ndf_intrinsic::IntrinsicMesh;
    use ndf_mesh::{ManifoldMesh, TriangleMesh, shapes};

    fn shifted(mesh: TriangleMesh) -> CsrMatrix {
        let mesh = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh).unwrap());
        let operator = LaplaceBeltrami::new(&mesh, OperatorOptions::default()).unwrap();
        operator.laplacian().plus(1e-3, operator.mass())
    }

    fn random(rows: usize) -> Panel {
        let mut random = Random::default();
        (0..rows).map(|_| Row(std::array::from_fn(|_| random.next()))).collect()
    }

    fn size(panel: &Panel) -> f64 {
        inner_products(panel, panel).0.iter().sum::<f64>().sqrt()
    }

    #[test]
    fn solutions_solve() {
        // Fine, stretched, knotted; with a boundary; smaller than the coarsest level.
        let stretched = shapes::icosphere(5).map_positions(|p| p * ndf_core::DVec3::new(1.0, 30.0, 1000.0));
        let meshes = [
            shapes::icosphere(5),
            stretched,
            shapes::rope_knot(300, 20, 0.1),
            shapes::grid(80, 60),
            shapes::cube(5),
        ];
        for mesh in meshes {
            let matrix = shifted(mesh);
            let right = random(matrix.row_count());
            let multigrid = Multigrid::new(matrix.clone(), 1e-10).unwrap();
            let mut solution = right.clone();
            multigrid.solve_in_order(&mut solution).unwrap();
            let mut residual = Panel::new();
            multiply(&matrix, &solution, &mut residual);
            add_scaled(&mut residual, Row([-1.0; WIDTH]), &right);
            assert!(size(&residual) < 1.1e-10 * size(&right));
        }
    }

    #[test]
    fn a_cycle_is_symmetric_and_positive_and_its_quality_does_not_depend_on_the_mesh() {
        let mut iterations = Vec::new();
        for levels in [5, 6, 7] {
            let matrix = shifted(shapes::icosphere(levels));
            let rows = matrix.row_count();
            let multigrid = Multigrid::new(matrix.clone(), 1e-8).unwrap();
            let a = random(rows);
            let b: Panel = a.iter().rev().map(|row| Row(row.0.map(|x| x * x - 0.3))).collect();
            let (ca, cb) = (multigrid.cycle(0, &a), multigrid.cycle(0, &b));
            let (ab, ba) = (inner_products(&ca, &b), inner_products(&a, &cb));
            let energy = inner_products(&a, &ca);
            for c in 0..WIDTH {
                assert!((ab.0[c] - ba.0[c]).abs() < 1e-9 * energy.0[c], "{ab:?} {ba:?}");
                assert!(energy.0[c] > 0.0);
            }
            iterations.push(multigrid.solve(&mut a.clone()).unwrap());
        }
        assert!(iterations.iter().all(|&n| n <= 20), "{iterations:?}");
    }
}
