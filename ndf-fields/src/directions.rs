//! Direction fields: the smoothest ones, and those that follow given directions (Knöppel, Crane, Pinkall and Schröder 2013,
//! "Globally optimal direction fields").

use std::f64::consts::TAU;

use ndf_core::Progress;
use ndf_mesh::{Face, Halfedge};
use ndf_spectral::SymbolicCholesky;
use num_complex::Complex64;

use crate::bundle::TangentBundle;
use crate::connection::{areas, connection_laplacian, plus_mass};
use crate::eigenvector::{Form, smallest_eigenvector};
use crate::error::FieldError;

/// `n` directions at every vertex, at angles of 2π/n: vectors for n = 1, lines for 2, crosses for 4.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectionField {
    symmetry: u32,
    /// Unit numbers: the nth powers of the directions.
    powers: Vec<Complex64>,
    /// The Dirichlet energy of the field before it was made unit, for one of norm 1: the smallest eigenvalue for the
    /// smoothest field, in inverse squared units of length.
    pub energy: f64,
}

/// The most symmetric fields that are computed; crosses have 4, hexagons 6.
const MOST_SYMMETRIC: u32 = 16;

impl DirectionField {
    /// The field of the least Dirichlet energy among those of one norm (§3.1, with the connection Laplacian). Singularities come out
    /// where the curvature wants them. An eigenproblem: a complex factorisation of V rows and some tens of solves.
    ///
    /// # Errors
    /// If the symmetry is 0 or above 16, the matrix is not positive definite to double precision, the iteration does not end, or the
    /// observer asks to stop.
    pub fn smoothest(
        bundle: &TangentBundle,
        symmetry: u32,
        progress: &dyn Progress,
    ) -> Result<Self, FieldError> {
        check(symmetry)?;
        let form = Form::Hermitian(connection_laplacian(bundle, symmetry));
        let (energy, found) = smallest_eigenvector(&form, &areas(bundle), progress)?;
        Ok(Self { symmetry, powers: unit(found), energy })
    }

    /// The field that follows directions and is smooth where they are weak: minimises the Dirichlet energy less its alignment with
    /// `powers`, the nth powers of directions times how much they count (§3.2, λ = 0). Of those only proportions matter. One
    /// complex factorisation of V rows.
    ///
    /// # Errors
    /// If the symmetry is 0 or above 16, there is not one number for every vertex, all are zero, or the matrix is not positive
    /// definite to double precision.
    pub fn aligned(
        bundle: &TangentBundle,
        symmetry: u32,
        powers: &[Complex64],
        progress: &dyn Progress,
    ) -> Result<Self, FieldError> {
        check(symmetry)?;
        let vertices = bundle.mesh().vertex_count();
        if powers.len() != vertices {
            return Err(FieldError::Count { found: powers.len(), expected: vertices });
        }
        let areas = areas(bundle);
        let norm_of = |x: &[Complex64]| -> f64 {
            x.iter().zip(&areas).map(|(z, area)| area * z.norm_sqr()).sum::<f64>().sqrt()
        };
        let norm = norm_of(powers);
        if !(norm > 0.0 && norm.is_finite()) {
            return Err(FieldError::NoAlignment);
        }
        progress.report("factoring", 0.0);
        let laplacian = connection_laplacian(bundle, symmetry);
        // Where parallel fields exist the Laplacian has a kernel.
        let typical = 4.0 * std::f64::consts::PI / areas.iter().sum::<f64>();
        let shifted = plus_mass(&laplacian, 1e-6 * typical, areas.iter().copied());
        let mut found: Vec<Complex64> =
            powers.iter().zip(&areas).map(|(z, area)| z * (area / norm)).collect();
        SymbolicCholesky::new(&shifted)?.cholesky(&shifted)?.solve(&mut [&mut found]);
        progress.check()?;
        let energy: f64 =
            laplacian.multiply(&found).iter().zip(&found).map(|(image, x)| (x.conj() * image).re).sum();
        let energy = energy / norm_of(&found).powi(2);
        Ok(Self { symmetry, powers: unit(found), energy })
    }

    /// A field of nth powers of directions, whose lengths do not matter.
    ///
    /// # Errors
    /// If the symmetry is 0 or above 16.
    pub fn from_powers(symmetry: u32, powers: Vec<Complex64>) -> Result<Self, FieldError> {
        check(symmetry)?;
        Ok(Self { symmetry, powers: unit(powers), energy: f64::NAN })
    }

    /// How many directions every vertex has.
    pub fn symmetry(&self) -> u32 {
        self.symmetry
    }

    /// The nth powers of the directions of every vertex: one unit number whichever direction it is made of.
    pub fn powers(&self) -> &[Complex64] {
        &self.powers
    }

    /// One direction of every vertex; the others are at multiples of 2π/n from it.
    pub fn directions(&self) -> Vec<Complex64> {
        let root = |z: &Complex64| Complex64::cis(z.arg() / f64::from(self.symmetry));
        self.powers.iter().map(root).collect()
    }

    /// The same field with all directions turned to the left.
    #[must_use]
    pub fn turned(mut self, radians: f64) -> Self {
        let turn = Complex64::cis(f64::from(self.symmetry) * radians);
        self.powers.iter_mut().for_each(|z| *z *= turn);
        self
    }

    /// By how much the nth power turns along a half-edge beyond parallel transport, in radians.
    pub(crate) fn rotation(&self, bundle: &TangentBundle, halfedge: Halfedge) -> f64 {
        let mesh = bundle.mesh();
        let [from, to] = [mesh.tail(halfedge), mesh.tip(halfedge)].map(|v| self.powers[v.index()]);
        (to * (bundle.transport(halfedge).powu(self.symmetry) * from).conj()).arg()
    }

    /// How often the nth power turns around a face, counter-clockwise; 0 in all but the singular ones. O(1).
    pub fn index(&self, bundle: &TangentBundle, face: Face) -> i32 {
        let turned: f64 = face.halfedges().map(|h| self.rotation(bundle, h)).iter().sum();
        ((turned + f64::from(self.symmetry) * bundle.curvature(face)) / TAU).round() as i32
    }

    /// The singular faces with their indices, as multiples of 1/n of a turn. O(n).
    pub fn singularities(&self, bundle: &TangentBundle) -> Vec<(Face, i32)> {
        let faces = bundle.mesh().faces().map(|face| (face, self.index(bundle, face)));
        faces.filter(|(_, index)| *index != 0).collect()
    }

    /// How often the nth power turns along the boundary against its tangent. By Gauss–Bonnet and Poincaré–Hopf the indices of the faces
    /// less this number are n χ. O(n).
    pub fn boundary_index(&self, bundle: &TangentBundle) -> i32 {
        let mesh = bundle.mesh();
        let on_boundary = mesh.halfedges().filter(|&h| mesh.twin(h).is_none());
        let turned: f64 = on_boundary
            .map(|h| self.rotation(bundle, h) - f64::from(self.symmetry) * bundle.boundary_turn(mesh.tail(h)))
            .sum();
        (turned / TAU).round() as i32
    }
}

fn check(symmetry: u32) -> Result<(), FieldError> {
    if (1..=MOST_SYMMETRIC).contains(&symmetry) { Ok(()) } else { Err(FieldError::Symmetry(symmetry)) }
}

/// All numbers on the unit circle; 1 for zero.
fn unit(mut numbers: Vec<Complex64>) -> Vec<Complex64> {
    for z in &mut numbers {
        let norm = z.norm();
        *z = if norm > 0.0 { *z / norm } else { Complex64::new(1.0, 0.0) };
    }
    numbers
}
