//! The connection Laplacian.

use ndf_mesh::{Halfedge, Vertex};
use ndf_spectral::{CsrMatrix, Scalar};
use num_complex::Complex64;

use crate::bundle::TangentBundle;

/// The Hermitian matrix of a quadratic form on one complex number for every place.
pub(crate) struct Couplings {
    diagonal: Vec<Complex64>,
    couplings: Vec<(u32, u32, Complex64)>,
}

impl Couplings {
    pub(crate) fn new(places: usize) -> Self {
        Self { diagonal: vec![Complex64::ZERO; places], couplings: Vec::new() }
    }

    /// Adds `weight · |x_j − rotation · x_i|²` to the form.
    pub(crate) fn couple(&mut self, [i, j]: [usize; 2], weight: f64, rotation: Complex64) {
        self.diagonal[i] += weight;
        self.diagonal[j] += weight;
        self.couplings.push((j as u32, i as u32, -weight * rotation));
    }

    /// The matrix. O(couplings).
    pub(crate) fn build(self) -> CsrMatrix<Complex64> {
        CsrMatrix::symmetric(&self.diagonal, self.couplings.into_iter())
    }
}

/// Cotangent weight of an edge: half the sum of the cotangents of the angles opposite to it, not negative on Delaunay
/// triangulations, where rounding is cut off.
pub(crate) fn weight(bundle: &TangentBundle, halfedge: Halfedge) -> f64 {
    let mesh = bundle.mesh();
    (0.5 * mesh.cotangent_sum(mesh.halfedge_edge(halfedge))).max(0.0)
}

/// The connection Laplacian of fields of symmetry `n`, V × V and Hermitian: `xᴴ L x = ∫ |∇x|²`, where x holds nth powers of directions
/// (Knöppel, Crane, Pinkall and Schröder 2013; Sharp, Soliman and Crane 2019, §4.2). Positive semidefinite. O(n).
pub fn connection_laplacian(bundle: &TangentBundle, symmetry: u32) -> CsrMatrix<Complex64> {
    let mesh = bundle.mesh();
    let mut couplings = Couplings::new(mesh.vertex_count());
    for edge in mesh.edges() {
        let h = mesh.edge_halfedge(edge);
        let ends = [mesh.tail(h), mesh.tip(h)].map(Vertex::index);
        couplings.couple(ends, weight(bundle, h), bundle.transport(h).powu(symmetry));
    }
    couplings.build()
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

/// `matrix + factor · masses` on the diagonal.
///
/// # Panics
/// If a diagonal entry is not stored.
pub(crate) fn plus_mass<T: Scalar + From<f64>>(
    matrix: &CsrMatrix<T>,
    factor: f64,
    masses: impl IntoIterator<Item = f64>,
) -> CsrMatrix<T> {
    let mut sum = matrix.clone();
    for (row, mass) in masses.into_iter().enumerate() {
        *sum.get_mut(row, row).expect("every diagonal entry is stored") += T::from(factor * mass);
    }
    sum
}
