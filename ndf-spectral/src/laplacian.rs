//! The cotangent Laplacian (Pinkall and Polthier 1993), from edge lengths alone.

use ndf_intrinsic::triangle;

use crate::assembly;
use crate::csr::CsrMatrix;
use crate::triangles::MetricTriangles;

/// The stiffness matrix of linear finite elements, V × V: `uᵀ L v = ∫ ⟨∇u, ∇v⟩`.
///
/// Positive semidefinite: the entry of an edge is `−(cot α + cot β)/2` of the angles opposite to it, and rows sum to
/// zero. Entries have no unit: they do not change when lengths are scaled. Boundary conditions are natural (Neumann).
/// A side that ends where it begins contributes nothing. Not finite where a triangle has no area. O(n).
///
/// Entries off the diagonal are not positive exactly where the triangulation is Delaunay (Bobenko and Springborn
/// 2007).
pub(crate) fn cotangent_laplacian(triangles: &MetricTriangles) -> CsrMatrix {
    let mut cotangents = Vec::new();
    let mut diagonal = vec![0.0; triangles.vertex_count()];
    for (corners, sides) in triangles.iter() {
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
