//! Gradients and divergences in the faces of an intrinsic mesh.

use std::f64::consts::PI;

use ndf_intrinsic::{IntrinsicMesh, triangle};
use ndf_mesh::{Face, Halfedge};
use num_complex::Complex64;

/// A face in the plane, its first half-edge on the x axis from the origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// Length of the first side.
    length: f64,
    apex: Complex64,
}

impl Layout {
    pub(crate) fn of(mesh: &IntrinsicMesh, face: Face) -> Self {
        let sides = mesh.sides(face);
        let [x, y] = triangle::apex(sides);
        Self { length: sides[0], apex: Complex64::new(x, y) }
    }

    pub(crate) fn corners(&self) -> [Complex64; 3] {
        [Complex64::default(), self.length.into(), self.apex]
    }

    pub(crate) fn area(&self) -> f64 {
        0.5 * self.length * self.apex.im
    }

    /// The sides as vectors, from each corner to the next.
    pub(crate) fn sides(&self) -> [Complex64; 3] {
        let [a, b, c] = self.corners();
        [b - a, c - b, a - c]
    }

    /// Twice the area times the gradient of the function that is 1 at a corner and 0 at the others: the opposite side turned to the
    /// left.
    pub(crate) fn hats(&self) -> [Complex64; 3] {
        let sides = self.sides();
        [1, 2, 0].map(|c| sides[c] * Complex64::i())
    }

    /// The gradient of the linear function with these values at the corners; zero in a face without area.
    pub(crate) fn gradient(&self, values: [f64; 3]) -> Complex64 {
        let area = self.area();
        if area <= 0.0 {
            return Complex64::default();
        }
        let sum: Complex64 = self.hats().iter().zip(values).map(|(hat, value)| hat * value).sum();
        sum / (2.0 * area)
    }
}

/// The direction of a half-edge in the layout of its face, in radians.
pub(crate) fn direction_in_face(mesh: &IntrinsicMesh, halfedge: Halfedge) -> f64 {
    let face = halfedge.face();
    let angle = |c: usize| mesh.corner_angle(face.halfedge(c));
    match halfedge.corner() {
        0 => 0.0,
        1 => PI - angle(1),
        _ => 2.0 * PI - angle(1) - angle(2),
    }
}

/// The weak divergence of a vector in every face: `∫ ⟨X, ∇ψ⟩` for the hat function ψ of every vertex, so that the function whose
/// gradient fits X best solves `L u =` this.
pub(crate) fn weak_divergence(mesh: &IntrinsicMesh, vectors: &[Complex64]) -> Vec<f64> {
    let mut divergence = vec![0.0; mesh.vertex_count()];
    for (face, vector) in mesh.faces().zip(vectors) {
        let hats = Layout::of(mesh, face).hats();
        for (v, hat) in mesh.face_vertices(face).into_iter().zip(hats) {
            divergence[v.index()] += 0.5 * dot(hat, *vector);
        }
    }
    divergence
}

pub(crate) fn dot(a: Complex64, b: Complex64) -> f64 {
    a.re * b.re + a.im * b.im
}

/// The direction of a number; 0 of 0.
pub(crate) fn unit(z: Complex64) -> Complex64 {
    let square = z.norm_sqr();
    if (f64::MIN_POSITIVE / f64::EPSILON..f64::INFINITY).contains(&square) {
        return z / square.sqrt();
    }
    // Heat decays by e an edge: the squares of its norm underflow long before itself.
    let largest = z.re.abs().max(z.im.abs());
    if largest > 0.0 {
        let scaled = z / largest;
        scaled / scaled.norm_sqr().sqrt()
    } else {
        Complex64::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_are_those_of_linear_functions() {
        let layout = Layout { length: 2.0, apex: Complex64::new(0.5, 1.5) };
        let slope = Complex64::new(0.3, -0.7);
        let found = layout.gradient(layout.corners().map(|p| dot(p, slope)));
        approx::assert_relative_eq!((found - slope).norm(), 0.0, epsilon = 1e-14);
        approx::assert_relative_eq!(layout.area(), 1.5);
    }
}
