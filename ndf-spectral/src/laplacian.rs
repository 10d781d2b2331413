//! The cotangent Laplacian (Pinkall and Polthier 1993), from edge lengths alone.

use nalgebra_sparse::CsrMatrix;
use ndf_intrinsic::triangle;

use crate::assembly;
use crate::triangulation::Triangulation;

/// The stiffness matrix of linear finite elements, V × V: `uᵀ L v = ∫ ⟨∇u, ∇v⟩`.
///
/// Positive semidefinite: the entry of an edge is `−(cot α + cot β)/2` of the angles opposite to it, and rows sum to
/// zero. Entries have no unit: they do not change when lengths are scaled. Boundary conditions are natural (Neumann).
/// A side that ends where it begins contributes nothing. Not finite where a triangle has no area. O(n).
///
/// Entries off the diagonal are not positive exactly where the triangulation is Delaunay (Bobenko and Springborn
/// 2007).
pub fn cotangent_laplacian(triangulation: &Triangulation) -> CsrMatrix<f64> {
    let mut cotangents = Vec::new();
    let mut diagonal = vec![0.0; triangulation.vertex_count()];
    for (corners, sides) in triangulation.triangles() {
        let halves = triangle::cotangents(sides).map(|c| 0.5 * c);
        for (c, half) in halves.into_iter().enumerate() {
            let (i, j) = (corners[c], corners[(c + 1) % 3]);
            if i != j {
                diagonal[i as usize] += half;
                diagonal[j as usize] += half;
                cotangents.push((i, j, -half));
            }
        }
    }
    assembly::symmetric(&diagonal, cotangents.into_iter())
}
