//! Stripe patterns: evenly spaced stripes along a line field (Knöppel, Crane, Pinkall and Schröder 2015, "Stripe patterns on
//! surfaces").

use std::f64::consts::TAU;

use ndf_core::Progress;
use ndf_mesh::{Face, Halfedge};
use ndf_spectral::CsrMatrix;
use num_complex::Complex64;

use crate::bundle::TangentBundle;
use crate::connection::areas;
use crate::directions::DirectionField;
use crate::eigenvector::{Form, smallest_eigenvector};
use crate::error::FieldError;

/// A pattern of stripes.
#[derive(Clone, Debug, PartialEq)]
pub struct StripePattern {
    /// The phase of every vertex as a unit number. Where the lines that the stripes cross are followed the other way it is the
    /// conjugate: its real part, which is 1 in the middle of a stripe and −1 between two, does not depend on that.
    pub phases: Vec<Complex64>,
    /// The phase at the three corners of every face in radians, which is linear in the face: the same multiple of 2π at both faces of an
    /// edge, or its negative, but for a face's [branch](Self::branches) at its last corner.
    pub corners: Vec<[f64; 3]>,
    /// The faces in which stripes begin or end, with how many, and the singular faces of the line field, with 0.
    pub branches: Vec<(Face, i32)>,
}

/// How the lines at the ends of a half-edge lie to each other and how far the phase gets along it.
struct Along {
    /// Whether the direction at the tip is the opposite of the one that continues the tail's.
    is_reversed: bool,
    /// By how much the phase of the tail's direction increases, in radians.
    advance: f64,
}

impl StripePattern {
    /// Stripes across the directions of a line field: `frequency` of them for a unit of length along the lines, which thus run
    /// perpendicular to the stripes. An eigenproblem: a factorisation of 2V rows and some tens of solves.
    ///
    /// Triangles need to be smaller than half the distance of two stripes, or phases mean nothing.
    ///
    /// # Errors
    /// If the field is no line field, has not the number of the mesh's vertices, the frequency is not positive, the iteration does not
    /// end, or the observer asks to stop.
    pub fn new(
        bundle: &TangentBundle,
        lines: &DirectionField,
        frequency: f64,
        progress: &dyn Progress,
    ) -> Result<Self, FieldError> {
        let mesh = bundle.mesh();
        let vertices = mesh.vertex_count();
        if lines.symmetry() != 2 {
            return Err(FieldError::Symmetry(lines.symmetry()));
        }
        if lines.powers().len() != vertices {
            return Err(FieldError::Count { found: lines.powers().len(), expected: vertices });
        }
        if !(frequency > 0.0 && frequency.is_finite()) {
            return Err(FieldError::NotPositive { name: "the frequency", value: frequency });
        }
        let pattern = Pattern { bundle, directions: lines.directions(), radians: TAU * frequency };
        let is_singular: Vec<bool> = mesh.faces().map(|face| lines.index(bundle, face) != 0).collect();
        let mut diagonal = vec![0.0; 2 * vertices];
        let mut couplings = Vec::with_capacity(4 * mesh.edge_count());
        for edge in mesh.edges() {
            let h = mesh.edge_halfedge(edge);
            // A singular face tells no direction to go.
            let of_face =
                |h: Halfedge| if is_singular[h.face().index()] { 0.0 } else { 0.5 * mesh.cotangent(h) };
            let weight = (of_face(h) + mesh.twin(h).map_or(0.0, of_face)).max(0.0);
            let along = pattern.along(h);
            // weight · |x − advance · y|² for the number y at the tail and x at the tip, or the conjugate of x.
            let [column, row] = [mesh.tail(h), mesh.tip(h)].map(|v| 2 * v.index());
            [row, row + 1, column, column + 1].into_iter().for_each(|part| diagonal[part] += weight);
            let Complex64 { re, im } = weight * Complex64::cis(along.advance);
            let sign = if along.is_reversed { -1.0 } else { 1.0 };
            let block = [[-re, im], [-sign * im, -sign * re]];
            for (r, c) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                couplings.push(((row + r) as u32, (column + c) as u32, block[r][c]));
            }
        }
        let form = Form::Real(CsrMatrix::symmetric(&diagonal, couplings.into_iter()));
        let (_, found) = smallest_eigenvector(&form, &areas(bundle), progress)?;
        let phases: Vec<Complex64> = found
            .iter()
            .map(|z| if z.norm() > 0.0 { z / z.norm() } else { Complex64::new(1.0, 0.0) })
            .collect();
        let mut branches = Vec::new();
        let mut corners = Vec::with_capacity(mesh.face_count());
        for face in mesh.faces() {
            let (at_corners, index) = pattern.of_face(&phases, face);
            if is_singular[face.index()] {
                branches.push((face, 0));
            } else if index != 0 {
                branches.push((face, index));
            }
            corners.push(at_corners);
        }
        Ok(Self { phases, corners, branches })
    }

    /// 1 in the middle of stripes and −1 between them, at every vertex.
    pub fn values(&self) -> Vec<f64> {
        self.phases.iter().map(|z| z.re).collect()
    }
}

struct Pattern<'a> {
    bundle: &'a TangentBundle,
    /// One of the two directions of every vertex.
    directions: Vec<Complex64>,
    /// Radians of phase for a unit of length.
    radians: f64,
}

impl Pattern<'_> {
    fn along(&self, halfedge: Halfedge) -> Along {
        let mesh = self.bundle.mesh();
        let [from, to] = [mesh.tail(halfedge), mesh.tip(halfedge)].map(|v| self.directions[v.index()]);
        let continued = self.bundle.transport(halfedge) * from;
        let is_reversed = (continued.conj() * to).re < 0.0;
        let to = if is_reversed { -to } else { to };
        let towards = |direction: Complex64, edge: f64| (direction * Complex64::cis(-edge)).re;
        let slopes = towards(from, self.bundle.direction(halfedge))
            + towards(to, self.bundle.onward_direction(halfedge));
        Along { is_reversed, advance: 0.5 * self.radians * mesh.halfedge_length(halfedge) * slopes }
    }

    /// Phases at the corners of a face, in terms of the first corner's direction, and by how many turns they fail to close up.
    fn of_face(&self, phases: &[Complex64], face: Face) -> ([f64; 3], i32) {
        let mesh = self.bundle.mesh();
        let mut at_corners = [0.0; 3];
        let mut phase = phases[mesh.face_vertices(face)[0].index()].arg();
        at_corners[0] = phase;
        let mut is_reversed = false;
        for (c, h) in face.halfedges().into_iter().enumerate() {
            let along = self.along(h);
            let advance = if is_reversed { -along.advance } else { along.advance };
            is_reversed ^= along.is_reversed;
            let found = phases[mesh.tip(h).index()];
            let found = if is_reversed { found.conj() } else { found };
            let expected = phase + advance;
            phase = expected + (found * Complex64::cis(-expected)).arg();
            if c < 2 {
                at_corners[c + 1] = phase;
            }
        }
        let turns = if is_reversed { 0 } else { ((phase - at_corners[0]) / TAU).round() as i32 };
        (at_corners, turns)
    }
}
