//! Tangent fields with a vector in the middle of every edge, linear in faces in between (Crouzeix and Raviart 1973). The real axis of an
//! edge is its canonical half-edge.

use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Face, Halfedge};
use ndf_spectral::{Cholesky, SymbolicCholesky};
use num_complex::Complex64;

use crate::connection::{Couplings, plus_mass};
use crate::error::FieldError;
use crate::faces::direction_in_face;

/// The rotation that takes vectors in the layout of a half-edge's face to the axes of its edge.
pub(super) fn to_edge(mesh: &IntrinsicMesh, halfedge: Halfedge) -> Complex64 {
    let rotation = Complex64::cis(-direction_in_face(mesh, halfedge));
    let is_canonical = mesh.edge_halfedge(mesh.halfedge_edge(halfedge)) == halfedge;
    if is_canonical { rotation } else { -rotation }
}

/// A vector of a face for each of its edges, in the axes of the edge: what is added to a field.
pub(super) fn add(mesh: &IntrinsicMesh, field: &mut [Complex64], face: Face, vectors: [Complex64; 3]) {
    for (h, vector) in face.halfedges().into_iter().zip(vectors) {
        field[mesh.halfedge_edge(h).index()] += to_edge(mesh, h) * vector;
    }
}

/// The sum of the vectors of a face's edges in its layout: three times the value at its centre.
pub(super) fn sum(mesh: &IntrinsicMesh, field: &[Complex64], face: Face) -> Complex64 {
    let vector = |h: Halfedge| to_edge(mesh, h).conj() * field[mesh.halfedge_edge(h).index()];
    face.halfedges().map(vector).iter().sum()
}

/// The operator `M + t L`, divided by t and factorised, where `xᴴ L x = ∫ |∇x|²` in the faces, which are flat.
#[derive(Debug)]
pub(super) struct EdgeDiffusion(Cholesky<Complex64>);

impl EdgeDiffusion {
    /// # Errors
    /// If the matrix is not positive definite to double precision.
    pub(super) fn new(mesh: &IntrinsicMesh, time: f64) -> Result<Self, FieldError> {
        let mut couplings = Couplings::new(mesh.edge_count());
        let mut areas = vec![0.0; mesh.edge_count()];
        for face in mesh.faces() {
            let third = mesh.area(face) / 3.0;
            let sides = face.halfedges();
            for c in 0..3 {
                let (h, next) = (sides[c], sides[(c + 1) % 3]);
                let ends = [h, next].map(|h| mesh.halfedge_edge(h).index());
                areas[ends[0]] += third;
                // The gradients of the two functions are those of hats, times −2: the weight is that of the edge opposite to the corner
                // between them, times 4.
                let weight = 2.0 * mesh.cotangent(sides[(c + 2) % 3]);
                couplings.couple(ends, weight, to_edge(mesh, next) * to_edge(mesh, h).conj());
            }
        }
        let matrix = plus_mass(&couplings.build(), time.recip(), areas);
        Ok(Self(SymbolicCholesky::new(&matrix)?.cholesky(&matrix)?))
    }

    /// A field that has diffused.
    pub(super) fn of(&self, field: &[Complex64]) -> Vec<Complex64> {
        let mut solution = field.to_vec();
        self.0.solve(&mut [&mut solution]);
        solution
    }
}
