//! The two faces of an edge in the plane: what decides about its flip.

use crate::intrinsic_mesh::{DELAUNAY_TOLERANCE, IntrinsicMesh};
use crate::planar::{Point, cross, distance, dot, minus, orientation};
use crate::triangle;
use ndf_mesh::Edge;

/// The two faces of an edge in the plane.
pub(crate) struct Quad {
    tail: Point,
    tip: Point,
    left: Point,
    right: Point,
}

impl Quad {
    /// Lays out the faces of an edge; `None` where it has not two different ones.
    #[inline]
    pub(crate) fn of(mesh: &IntrinsicMesh, edge: Edge) -> Option<Self> {
        let h = mesh.edge_halfedge(edge);
        let t = mesh.twin(h)?;
        if t.face() == h.face() {
            return None;
        }
        let sides = mesh.sides_from(h);
        let (tail, tip) = ([0.0, 0.0], [sides[0], 0.0]);
        let left = triangle::apex(sides);
        let apex = triangle::apex(mesh.sides_from(t));
        let right = [sides[0] - apex[0], -apex[1]];
        Some(Self { tail, tip, left, right })
    }

    /// Whether the angles opposite to the edge sum to more than π: the sine of the sum is negative, by more than
    /// a tolerance that corresponds to [`DELAUNAY_TOLERANCE`] on cotangents.
    #[inline]
    pub(crate) fn is_violating(&self) -> bool {
        let at = |apex: Point, from: Point, to: Point| {
            let (u, v) = (minus(from, apex), minus(to, apex));
            (dot(u, v), cross(u, v))
        };
        let (cos_left, sin_left) = at(self.left, self.tail, self.tip);
        let (cos_right, sin_right) = at(self.right, self.tip, self.tail);
        cos_left * sin_right + cos_right * sin_left < -0.5 * DELAUNAY_TOLERANCE * sin_left * sin_right
    }

    /// Whether the quad is strictly convex at the ends of the edge: the sines of the turns there are greater than
    /// `straight`. With 0 the signs are exact for the quad as laid out.
    #[inline]
    pub(crate) fn is_convex(&self, straight: f64) -> bool {
        let turns = |a, b, c| {
            let tolerance = if straight == 0.0 { 0.0 } else { straight * distance(a, b) * distance(a, c) };
            orientation(a, b, c) > tolerance
        };
        turns(self.tail, self.right, self.left) && turns(self.tip, self.left, self.right)
    }

    /// Length of the other diagonal.
    #[inline]
    pub(crate) fn other_diagonal(&self) -> f64 {
        distance(self.left, self.right)
    }
}
