//! A point of a face.

use std::ops::{Add, Mul};

use ndf_core::DVec3;

use crate::{Face, Halfedge, TriangleMesh};

/// The point `Σ bᵢ vᵢ` of a face, of a mesh in space or of an intrinsic one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacePoint {
    /// The face.
    pub face: Face,
    /// Barycentric coordinates; they sum to 1.
    pub barycentric: [f64; 3],
}

/// How far barycentric coordinates may be from non-negative and from summing to 1.
const TOLERANCE: f64 = 1e-9;

impl FacePoint {
    /// The point with these coordinates, clamped and normalised; `None` if they are not finite, or further than
    /// 1e-9 from coordinates of a point of the face.
    pub fn in_face(face: Face, barycentric: [f64; 3]) -> Option<Self> {
        let sum: f64 = barycentric.iter().sum();
        // Also refuses NaN.
        let valid = (sum - 1.0).abs() <= TOLERANCE && barycentric.iter().all(|b| *b >= -TOLERANCE);
        let clamped = barycentric.map(|b| b.max(0.0));
        let sum: f64 = clamped.iter().sum();
        valid.then(|| Self { face, barycentric: clamped.map(|b| b / sum) })
    }

    /// The point `(1 − t) tail + t tip` of a half-edge.
    pub fn on_halfedge(halfedge: Halfedge, t: f64) -> Self {
        let mut barycentric = [0.0; 3];
        barycentric[halfedge.corner()] = 1.0 - t;
        barycentric[halfedge.next().corner()] = t;
        Self { face: halfedge.face(), barycentric }
    }

    /// The corner that a half-edge leaves.
    pub fn at_corner(halfedge: Halfedge) -> Self {
        Self::on_halfedge(halfedge, 0.0)
    }

    /// The centre of a face.
    pub fn center(face: Face) -> Self {
        Self { face, barycentric: [1.0 / 3.0; 3] }
    }

    /// `Σ bᵢ xᵢ` of values at the corners of the face.
    #[inline]
    pub fn interpolate<T: Mul<f64, Output = T> + Add<Output = T>>(&self, corners: [T; 3]) -> T {
        let [a, b, c] = corners;
        a * self.barycentric[0] + b * self.barycentric[1] + c * self.barycentric[2]
    }

    /// Its position on a mesh.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn position(&self, mesh: &TriangleMesh) -> DVec3 {
        self.interpolate(mesh.corner_positions(self.face))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_checked_clamped_and_normalised() {
        assert_eq!(
            FacePoint::in_face(Face(3), [0.5, 0.5, 0.0]),
            Some(FacePoint::on_halfedge(Halfedge(9), 0.5))
        );
        let near = FacePoint::in_face(Face(0), [1.0 + 5e-10, -5e-10, 0.0]).unwrap();
        assert_eq!(near, FacePoint::at_corner(Halfedge(0)));
        for refused in [[0.7, 0.7, 0.0], [1.5, -0.5, 0.0], [f64::NAN, 0.5, 0.5], [f64::INFINITY, 0.0, 0.0]] {
            assert_eq!(FacePoint::in_face(Face(0), refused), None);
        }
    }

    #[test]
    fn values_are_interpolated() {
        let point = FacePoint { face: Face(0), barycentric: [0.5, 0.25, 0.25] };
        assert_eq!(point.interpolate([4.0, 8.0, 12.0]), 7.0);
    }
}
