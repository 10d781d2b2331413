//! The discrete Laplace–Beltrami operator `M⁻¹ L` of a surface.

use ndf_intrinsic::{IntrinsicMesh, triangle};
use ndf_mesh::{TriangleMesh, Vertex};

use crate::components::Components;
use crate::csr::CsrMatrix;
use crate::error::SpectralError;
use crate::laplacian::cotangent_laplacian;
use crate::mass::{Mass, mass_matrix};
use crate::triangles::MetricTriangles;
use crate::tufted_cover::TuftedCover;

/// Faces flatter than this are mollified: `a + b − c` below this fraction of the mean length. The lengths of all
/// edges then change in the tenth digit.
const MOLLIFICATION: f64 = 1e-10;

/// Smaller areas are not those of their faces: the products of four lengths that they come from underflow.
const MIN_AREA: f64 = 1e-150;

/// How an operator is built from a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OperatorOptions {
    /// The mass matrix.
    pub mass: Mass,
    /// Whether to flip to the intrinsic Delaunay triangulation first: all weights are then non-negative, the maximum
    /// principle holds, and modes are better on bad meshes. Otherwise the triangles are taken as they are.
    pub delaunay: bool,
}

impl Default for OperatorOptions {
    /// Lumped barycentric mass, intrinsic Delaunay.
    fn default() -> Self {
        Self { mass: Mass::Barycentric, delaunay: true }
    }
}

/// Stiffness and mass matrix of linear finite elements on a surface.
#[derive(Clone, Debug)]
pub struct LaplaceBeltrami {
    laplacian: CsrMatrix,
    mass: CsrMatrix,
    components: Components,
    /// Of the surface, with all its vertices.
    area: f64,
}

impl LaplaceBeltrami {
    /// The operator of an intrinsic mesh. Faces without area are [mollified](IntrinsicMesh::mollify). O(n).
    ///
    /// # Errors
    /// If no face has an area, or a vertex has none around it.
    pub fn new(mesh: &IntrinsicMesh, options: OperatorOptions) -> Result<Self, SpectralError> {
        Self::from_lengths(&MetricTriangles::from(&prepared(mesh, options.delaunay)?), options.mass)
    }

    /// The operator of triangles as they are, neither mollified nor flipped. O(n).
    ///
    /// # Errors
    /// If a vertex has no area around it, or an entry is not finite since a triangle has no area.
    pub fn from_lengths(triangles: &MetricTriangles, mass: Mass) -> Result<Self, SpectralError> {
        Self::from_matrices(cotangent_laplacian(triangles), mass_matrix(triangles, mass))
    }

    /// The operator of any set of triangles, manifold or not: half that of its [tufted cover](TuftedCover). With
    /// `delaunay` off it is the plain cotangent Laplacian. O(n log n).
    ///
    /// # Errors
    /// If no face has an area, or a vertex has none around it, or a length is not finite.
    pub fn from_triangle_mesh(mesh: &TriangleMesh, options: OperatorOptions) -> Result<Self, SpectralError> {
        let cover = TuftedCover::new(mesh)?;
        let surface = prepared(&cover.mesh, options.delaunay)?;
        let original = |v: Vertex| cover.original[v.index()];
        let triangles = MetricTriangles::new(
            mesh.vertex_count(),
            surface.faces().map(|f| surface.face_vertices(f).map(original)).collect(),
            surface.faces().map(|f| surface.sides(f)).collect(),
        );
        let half = |mut matrix: CsrMatrix| {
            matrix.values_mut().iter_mut().for_each(|value| *value *= 0.5);
            matrix
        };
        Self::from_matrices(
            half(cotangent_laplacian(&triangles)),
            half(mass_matrix(&triangles, options.mass)),
        )
    }

    /// The operator of given matrices: a symmetric positive semidefinite Laplacian whose rows sum to zero, and a
    /// symmetric positive definite mass matrix whose pattern is part of the Laplacian's.
    ///
    /// # Errors
    /// If an entry is not finite or a diagonal entry of the mass is not positive.
    ///
    /// # Panics
    /// If the matrices are not square and of one size.
    pub fn from_matrices(laplacian: CsrMatrix, mass: CsrMatrix) -> Result<Self, SpectralError> {
        let n = laplacian.row_count();
        assert!([laplacian.column_count(), mass.row_count(), mass.column_count()] == [n; 3]);
        for v in 0..n {
            if mass.get(v, v).is_none_or(|m| m.is_nan() || m <= 0.0) {
                return Err(SpectralError::NoArea(v));
            }
            if !laplacian.row(v).1.iter().chain(mass.row(v).1).all(|x| x.is_finite()) {
                return Err(SpectralError::NotFinite(v));
            }
        }
        let components = Components::new(&laplacian, &mass);
        let area = components.areas().iter().sum();
        Ok(Self { laplacian, mass, components, area })
    }

    /// The stiffness matrix `L`, positive semidefinite.
    pub fn laplacian(&self) -> &CsrMatrix {
        &self.laplacian
    }

    /// The mass matrix `M`.
    pub fn mass(&self) -> &CsrMatrix {
        &self.mass
    }

    /// Connected components.
    pub fn components(&self) -> &Components {
        &self.components
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.laplacian.row_count()
    }

    /// The operator on functions that are zero at held vertices (Dirichlet): its rows and columns of the others, in their order. Its
    /// kernel are the constants on components without held vertices.
    ///
    /// # Panics
    /// If there is not one mark for every vertex.
    pub(crate) fn holding(&self, held: &[bool]) -> Self {
        let free: Vec<bool> = held.iter().map(|held| !held).collect();
        Self {
            laplacian: self.laplacian.restricted(&free),
            mass: self.mass.restricted(&free),
            components: self.components.without(held),
            area: self.area,
        }
    }

    /// Subtracts from a function its mean over every component.
    ///
    /// # Panics
    /// If there is not one value for every vertex.
    pub fn remove_means(&self, u: &mut [f64]) {
        let means = self.components.means(&self.mass.multiply(u));
        u.iter_mut().zip(self.components.labels()).for_each(|(u, &c)| *u -= means[c as usize]);
    }

    /// The stiffness matrix with one vertex of every component pulled towards 0, which makes it definite. A right-hand side that sums
    /// to zero over a component gives that vertex the value 0 exactly, and the function is otherwise a solution of `L u = b`.
    pub fn grounded(&self) -> CsrMatrix {
        let mut matrix = self.laplacian.clone();
        let mut pulled = vec![false; self.components.count()];
        for (v, &component) in self.components.labels().iter().enumerate() {
            if !std::mem::replace(&mut pulled[component as usize], true)
                && let Some(diagonal) = matrix.get_mut(v, v)
            {
                *diagonal += diagonal.max(1.0);
            }
        }
        matrix
    }

    /// Total area.
    pub fn area(&self) -> f64 {
        self.area
    }
}

/// The mesh without flat faces, and intrinsic Delaunay if asked.
///
/// Mollification makes a surface of anything, so that one without area is refused before.
fn prepared(mesh: &IntrinsicMesh, delaunay: bool) -> Result<IntrinsicMesh, SpectralError> {
    let has_area = |face| {
        let sides = mesh.sides(face);
        let longest = sides[0].max(sides[1]).max(sides[2]);
        triangle::slack(sides) > 4.0 * f64::EPSILON * longest && triangle::area(sides) > MIN_AREA
    };
    if mesh.face_count() > 0 && !mesh.faces().any(has_area) {
        return Err(SpectralError::NoSurface);
    }
    let mut mesh = mesh.clone();
    mesh.mollify(MOLLIFICATION);
    if delaunay && !mesh.is_delaunay() {
        mesh.flip_to_delaunay();
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_core::DVec3;
    use ndf_mesh::{ManifoldMesh, shapes};

    #[test]
    fn surfaces_without_area_are_refused() {
        let sphere = shapes::icosphere(1);
        let turned = DVec3::new(0.3, -0.5, 0.8);
        let refused = |mesh: &TriangleMesh| {
            let intrinsic = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh.clone()).unwrap());
            let options = OperatorOptions::default();
            let [a, b] = [
                LaplaceBeltrami::new(&intrinsic, options),
                LaplaceBeltrami::from_triangle_mesh(mesh, options),
            ]
            .map(|operator| matches!(operator, Err(SpectralError::NoSurface)));
            assert_eq!(a, b);
            a
        };
        assert!(refused(&sphere.map_positions(|_| turned)), "a point");
        assert!(refused(&sphere.map_positions(|p| turned * p.x)), "a line");
        assert!(refused(&sphere.map_positions(|p| p * 1e-200)), "squares of lengths underflow");
        assert!(!refused(&sphere.map_positions(|p| DVec3::new(p.x, 1e-6 * p.y, p.z * 1e-6))), "a needle");
        assert!(!refused(&sphere.map_positions(|p| p * 1e-60)));
        let half = |p: DVec3| if p.x > 0.0 { DVec3::X } else { p };
        assert!(!refused(&sphere.map_positions(half)), "faces without area among others");
    }
}
