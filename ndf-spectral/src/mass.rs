//! Mass matrices: the L² inner product of piecewise linear functions.

use ndf_intrinsic::triangle;

use crate::assembly;
use crate::csr::CsrMatrix;
use crate::triangles::MetricTriangles;

/// Which discretisation of `∫ u v`. Each sums to the area of the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mass {
    /// Diagonal: a third of the area of every triangle to each of its corners.
    #[default]
    Barycentric,
    /// Diagonal: the part of every triangle nearest to a corner; in an obtuse triangle half of the area to the obtuse
    /// corner and a quarter to each other (Meyer, Desbrun, Schröder and Barr 2003, §3.3).
    MixedVoronoi,
    /// Exact for piecewise linear functions: a sixth of the area of every triangle on the diagonal, a twelfth beside it.
    Consistent,
}

/// The mass matrix, V × V, in squared units of length; positive definite where every vertex has a triangle with an
/// area. O(n).
pub(crate) fn mass_matrix(triangles: &MetricTriangles, mass: Mass) -> CsrMatrix {
    let mut diagonal = vec![0.0; triangles.vertex_count()];
    let mut couplings = Vec::new();
    for (corners, sides) in triangles.iter() {
        let shares = match mass {
            Mass::Barycentric => [triangle::area(sides) / 3.0; 3],
            Mass::MixedVoronoi => mixed_voronoi_areas(sides),
            Mass::Consistent => {
                let twelfth = triangle::area(sides) / 12.0;
                couplings.extend([0, 1, 2].map(|c| (corners[c], corners[(c + 1) % 3], twelfth)));
                [2.0 * twelfth; 3]
            }
        };
        for (&v, share) in corners.iter().zip(shares) {
            diagonal[v as usize] += share;
        }
    }
    assembly::symmetric(&diagonal, couplings.into_iter())
}

/// Areas that belong to the three corners of a triangle.
fn mixed_voronoi_areas(sides: [f64; 3]) -> [f64; 3] {
    let area = triangle::area(sides);
    let cotangents = triangle::cotangents(sides);
    if let Some(side) = (0..3).find(|&side| cotangents[side] < 0.0) {
        let mut shares = [0.25 * area; 3];
        shares[(side + 2) % 3] = 0.5 * area;
        return shares;
    }
    // Each side gives |side|² cot / 8 to both of its ends.
    let eighths = [0, 1, 2].map(|side| sides[side] * sides[side] * cotangents[side] / 8.0);
    [0, 1, 2].map(|corner| eighths[corner] + eighths[(corner + 2) % 3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use ndf_intrinsic::IntrinsicMesh;
    use ndf_mesh::ManifoldMesh;
    use ndf_mesh::shapes;

    #[test]
    fn every_mass_sums_to_the_area() {
        let mesh = ManifoldMesh::try_from(shapes::torus(11, 5, 1.0, 0.4)).unwrap();
        let mesh = IntrinsicMesh::from_mesh(&mesh);
        for mass in [Mass::Barycentric, Mass::MixedVoronoi, Mass::Consistent] {
            let matrix = mass_matrix(&MetricTriangles::from(&mesh), mass);
            let total: f64 = matrix.values().iter().sum();
            assert_relative_eq!(total, mesh.total_area(), max_relative = 1e-12);
            assert!(matrix.values().iter().all(|&v| v > 0.0));
        }
    }

    #[test]
    fn voronoi_areas_of_right_and_obtuse_triangles() {
        assert_relative_eq!(
            mixed_voronoi_areas([3.0, 4.0, 5.0])[..],
            [1.5, 3.0, 1.5][..],
            max_relative = 1e-12
        );
        let obtuse = [1.0, 1.0, 1.9];
        let area = triangle::area(obtuse);
        assert_relative_eq!(mixed_voronoi_areas(obtuse)[..], [0.25 * area, 0.5 * area, 0.25 * area][..]);
    }
}
