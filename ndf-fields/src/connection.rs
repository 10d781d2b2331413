//! The connection Laplacian, and its smallest eigenvector.

use ndf_core::Progress;
use ndf_mesh::{Halfedge, Vertex};
use ndf_spectral::faer::{Mat, Side, c64};
use ndf_spectral::{CsrMatrix, SymbolicCholesky};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::bundle::TangentBundle;
use crate::error::FieldError;

/// Vectors that are iterated at once.
const BLOCK: usize = 4;

/// The iteration ends when a round gains less than this part of the energy. An eigenvector may be thousands of times smaller in one part of
/// a surface than in another, and is wrong there by the root of it: directions must be right there, too.
const SETTLED: f64 = 1e-14;

/// Rounds before the iteration is given up.
const MOST_ROUNDS: usize = 500;

/// A Hermitian operator on one complex number a vertex, in real form: the rows 2v and 2v + 1 stand for the real and the imaginary part
/// of vertex v.
pub(crate) struct Builder {
    /// Of both parts.
    diagonal: Vec<f64>,
    couplings: Vec<(u32, u32, Block)>,
}

/// What the two parts of a column add to those of a row.
type Block = [[f64; 2]; 2];

impl Builder {
    pub(crate) fn new(vertices: usize) -> Self {
        Self { diagonal: vec![0.0; vertices], couplings: Vec::new() }
    }

    /// Adds `weight · |x_j − rotation · x_i|²` to the quadratic form; with `conjugate`, of the conjugate of x_j.
    pub(crate) fn couple(&mut self, [i, j]: [usize; 2], weight: f64, rotation: Complex64, conjugate: bool) {
        self.diagonal[i] += weight;
        self.diagonal[j] += weight;
        let Complex64 { re, im } = weight * rotation;
        let sign = if conjugate { -1.0 } else { 1.0 };
        self.couplings.push((j as u32, i as u32, [[-re, im], [-sign * im, -sign * re]]));
    }

    /// The matrix, of whole blocks. O(couplings).
    pub(crate) fn build(self) -> CsrMatrix {
        let n = self.diagonal.len();
        // The diagonal has a block in every row.
        let mut starts: Vec<usize> = (0..=n).map(|row| usize::from(row > 0)).collect();
        for &(i, j, _) in &self.couplings {
            starts[i as usize + 1] += 1;
            starts[j as usize + 1] += 1;
        }
        for row in 0..n {
            starts[row + 1] += starts[row];
        }
        let mut next = starts.clone();
        let mut blocks = vec![(0, Block::default()); starts[n]];
        let mut put = |row: u32, column: u32, block: Block| {
            let slot = &mut next[row as usize];
            blocks[*slot] = (column, block);
            *slot += 1;
        };
        for (row, &weight) in self.diagonal.iter().enumerate() {
            put(row as u32, row as u32, [[weight, 0.0], [0.0, weight]]);
        }
        for (i, j, block) in self.couplings {
            put(i, j, block);
            put(j, i, [0, 1].map(|r| [0, 1].map(|c| block[c][r])));
        }
        let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        let mut merged: Vec<(u32, Block)> = Vec::new();
        for ends in starts.windows(2) {
            let row = &mut blocks[ends[0]..ends[1]];
            row.sort_by_key(|(column, _)| *column);
            merged.clear();
            for &(column, block) in &*row {
                match merged.last_mut() {
                    Some((last, sum)) if *last == column => {
                        sum.as_flattened_mut()
                            .iter_mut()
                            .zip(block.as_flattened())
                            .for_each(|(s, x)| *s += x);
                    }
                    _ => merged.push((column, block)),
                }
            }
            for part in 0..2 {
                for &(column, block) in &merged {
                    columns.extend([2 * column as usize, 2 * column as usize + 1]);
                    values.extend(block[part]);
                }
                offsets.push(columns.len());
            }
        }
        CsrMatrix::new(2 * n, offsets, columns, values).expect("columns ascend within every row")
    }
}

/// Cotangent weight of an edge: half the sum of the cotangents of the angles opposite to it, not negative on Delaunay
/// triangulations, where rounding is cut off.
pub(crate) fn weight(bundle: &TangentBundle, halfedge: Halfedge) -> f64 {
    let mesh = bundle.mesh();
    (0.5 * mesh.cotangent_sum(mesh.halfedge_edge(halfedge))).max(0.0)
}

/// The connection Laplacian of fields of symmetry `n`, 2V × 2V: `xᵀ L x = ∫ |∇x|²`, where x holds nth powers of directions
/// (Knöppel, Crane, Pinkall and Schröder 2013; Sharp, Soliman and Crane 2019, §4.2). Positive semidefinite. O(n).
pub fn connection_laplacian(bundle: &TangentBundle, symmetry: u32) -> CsrMatrix {
    let mesh = bundle.mesh();
    let mut builder = Builder::new(mesh.vertex_count());
    for edge in mesh.edges() {
        let h = mesh.edge_halfedge(edge);
        let ends = [mesh.tail(h), mesh.tip(h)].map(Vertex::index);
        builder.couple(ends, weight(bundle, h), bundle.transport(h).powu(symmetry), false);
    }
    builder.build()
}

/// A third of the area of its faces for every vertex. O(n).
pub(crate) fn areas(bundle: &TangentBundle) -> Vec<f64> {
    let mesh = bundle.mesh();
    let mut areas = vec![0.0; mesh.vertex_count()];
    for face in mesh.faces() {
        let third = mesh.area(face) / 3.0;
        mesh.face_vertices(face).iter().for_each(|v| areas[v.index()] += third);
    }
    areas
}

/// `matrix + factor · areas` on the diagonal of both parts.
pub(crate) fn plus_mass(matrix: &CsrMatrix, factor: f64, areas: &[f64]) -> CsrMatrix {
    let mut sum = matrix.clone();
    for row in 0..sum.row_count() {
        *sum.get_mut(row, row).expect("every diagonal entry is stored") += factor * areas[row / 2];
    }
    sum
}

/// Real and imaginary parts in turns.
pub(crate) fn interleaved(values: &[Complex64]) -> Vec<f64> {
    values.iter().flat_map(|z| [z.re, z.im]).collect()
}

/// The inverse of [`interleaved`].
pub(crate) fn complex(values: &[f64]) -> Vec<Complex64> {
    values.chunks_exact(2).map(|pair| Complex64::new(pair[0], pair[1])).collect()
}

/// Whether an operator commutes with the multiplication by i. Then eigenvectors come in complex lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Numbers {
    Complex,
    Real,
}

/// The vector of the smallest eigenvalue of `L x = λ M x`, of norm 1 in the mass M, and λ, both to about the
/// rounding of the matrix. One of them where the eigenvalue is multiple.
///
/// By locally optimal block conjugate gradients (Knyazev 2001) with the inverse of L + σM as their preconditioner: a round solves for
/// a block of vectors and takes the best of the span of these, of the block and of the block before.
///
/// # Errors
/// If the matrix cannot be factored, or the iteration does not end.
pub(crate) fn smallest_eigenvector(
    laplacian: &CsrMatrix,
    areas: &[f64],
    numbers: Numbers,
    progress: &dyn Progress,
) -> Result<(f64, Vec<Complex64>), FieldError> {
    let typical = 4.0 * std::f64::consts::PI / areas.iter().sum::<f64>();
    progress.report("factoring", 0.0);
    let shifted = plus_mass(laplacian, 1e-6 * typical, areas);
    let inverse = SymbolicCholesky::of_pairs(&shifted)?.cholesky(&shifted)?;
    progress.check()?;
    let rows = laplacian.row_count();
    let columns = BLOCK.min(rows / 2).max(1);
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let noise = |_| (0..rows).map(|_| random.random::<f64>() - 0.5).collect();
    let mut block: Vec<Vec<f64>> = (0..columns).map(noise).collect();
    let mut before: Vec<Vec<f64>> = Vec::new();
    let mut energy = f64::INFINITY;
    let mut gained = f64::INFINITY;
    for round in 0..MOST_ROUNDS {
        progress.check()?;
        progress.report("smoothest field", round as f64 / MOST_ROUNDS as f64);
        let mut solved: Vec<Vec<f64>> = block.iter().map(|x| massed(x, areas)).collect();
        inverse.solve(&mut solved.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>());
        let span = orthonormal(solved.into_iter().chain(block.iter().cloned()).chain(before), areas, numbers);
        let (lowest, improved) = best_of(laplacian, span, columns, numbers)?;
        before = std::mem::replace(&mut block, improved);
        gained = (energy - lowest) / lowest.max(typical);
        energy = lowest;
        if round > 0 && gained < SETTLED {
            return Ok((energy.max(0.0), complex(&block[0])));
        }
    }
    Err(FieldError::NotConverged(MOST_ROUNDS, gained))
}

fn massed(x: &[f64], areas: &[f64]) -> Vec<f64> {
    x.iter().enumerate().map(|(row, x)| areas[row / 2] * x).collect()
}

/// The vectors of a span, given by an orthonormal basis, with the least energies, and the least.
fn best_of(
    laplacian: &CsrMatrix,
    span: Vec<Vec<f64>>,
    count: usize,
    numbers: Numbers,
) -> Result<(f64, Vec<Vec<f64>>), FieldError> {
    let k = span.len();
    let images: Vec<Vec<f64>> = span.iter().map(|x| laplacian.multiply(x)).collect();
    let entry = |i: usize, j: usize| inner(&span[i], &images[j], None, numbers);
    let projected = Mat::<c64>::from_fn(k, k, |i, j| 0.5 * (entry(i, j) + entry(j, i).conj()));
    let eigen =
        projected.self_adjoint_eigen(Side::Lower).map_err(|_| FieldError::NotConverged(0, f64::NAN))?;
    let column = |c: usize| combination(&span, &(0..k).map(|r| eigen.U()[(r, c)]).collect::<Vec<_>>());
    Ok((eigen.S()[0].re, (0..count.min(k)).map(column).collect()))
}

/// The inner product, conjugate in the first; in the mass if there are areas.
fn inner(a: &[f64], b: &[f64], areas: Option<&[f64]>, numbers: Numbers) -> Complex64 {
    let pairs = a.chunks_exact(2).zip(b.chunks_exact(2));
    let product = |(a, b): (&[f64], &[f64])| Complex64::new(a[0], a[1]).conj() * Complex64::new(b[0], b[1]);
    let sum: Complex64 = match areas {
        Some(areas) => pairs.zip(areas).map(|(pair, area)| product(pair) * area).sum(),
        None => pairs.map(product).sum(),
    };
    match numbers {
        Numbers::Complex => sum,
        Numbers::Real => sum.re.into(),
    }
}

/// The sum of vectors times numbers.
fn combination(vectors: &[Vec<f64>], factors: &[Complex64]) -> Vec<f64> {
    let mut sum = vec![0.0; vectors[0].len()];
    for (vector, factor) in vectors.iter().zip(factors) {
        for (s, x) in sum.chunks_exact_mut(2).zip(vector.chunks_exact(2)) {
            let Complex64 { re, im } = factor * Complex64::new(x[0], x[1]);
            s[0] += re;
            s[1] += im;
        }
    }
    sum
}

/// Gram–Schmidt, twice; vectors that depend on others are left out.
fn orthonormal(vectors: impl Iterator<Item = Vec<f64>>, areas: &[f64], numbers: Numbers) -> Vec<Vec<f64>> {
    let product = |a: &[f64], b: &[f64]| inner(a, b, Some(areas), numbers);
    let mut basis: Vec<Vec<f64>> = Vec::new();
    'vectors: for mut vector in vectors {
        for _ in 0..2 {
            let before = product(&vector, &vector).re.sqrt();
            if !basis.is_empty() {
                let parts: Vec<Complex64> = basis.iter().map(|b| -product(b, &vector)).collect();
                vector.iter_mut().zip(combination(&basis, &parts)).for_each(|(x, along)| *x += along);
            }
            let norm = product(&vector, &vector).re.sqrt();
            if norm <= 1e-10 * before {
                continue 'vectors;
            }
            vector.iter_mut().for_each(|x| *x /= norm);
        }
        basis.push(vector);
    }
    basis
}

#[cfg(test)]
mod tests {
    use ndf_core::{DVec3, NoProgress};
    use ndf_intrinsic::IntrinsicMesh;
    use ndf_mesh::{ManifoldMesh, shapes};

    use super::*;

    /// A drop whose field of crosses is small in its thick end.
    fn drop_shaped() -> TangentBundle {
        let drawn = |p: DVec3| DVec3::new(p.x, p.y, 4.0 * p.z) * (0.15 + 0.5 * (p.z + 1.0));
        let mesh = shapes::icosphere(5).map_positions(drawn);
        TangentBundle::new(&IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh).unwrap()))
    }

    #[test]
    fn the_smallest_eigenvector_is_one_wherever_it_is_small() {
        let bundle = drop_shaped();
        let areas = areas(&bundle);
        for n in [1, 2, 4] {
            let laplacian = connection_laplacian(&bundle, n);
            let (energy, found) =
                smallest_eigenvector(&laplacian, &areas, Numbers::Complex, &NoProgress).unwrap();
            let image = complex(&laplacian.multiply(&interleaved(&found)));
            let square = |z: Complex64, area: f64| z.norm_sqr() * area;
            let left: f64 =
                (0..found.len()).map(|v| square(image[v] / areas[v] - energy * found[v], areas[v])).sum();
            assert!(left.sqrt() < 1e-5 * energy, "n = {n}: {:.1e}", left.sqrt() / energy);
        }
    }
}
