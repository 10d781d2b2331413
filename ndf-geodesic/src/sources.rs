//! Points of a surface as the wavefront takes them.

use ndf_intrinsic::{IntrinsicMesh, triangle};
use ndf_mesh::SurfacePoint;

use crate::error::GeodesicError;
use crate::unfolding::Layout;

/// Barycentric coordinates may be this far from non-negative and from summing to 1.
const SLOPPINESS: f64 = 1e-9;

/// A checked point: a vertex, or a point of a face, perhaps on its rim, that is no vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    Vertex(u32),
    Face(FacePoint),
}

/// A point of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FacePoint {
    pub(crate) face: u32,
    /// Not negative; sums to 1.
    pub(crate) barycentric: [f64; 3],
}

impl Place {
    /// Checks a point of the mesh.
    ///
    /// # Errors
    /// If its element does not exist or its coordinates are no point of the element.
    pub(crate) fn of(mesh: &IntrinsicMesh, point: SurfacePoint) -> Result<Self, GeodesicError> {
        let refused = || GeodesicError::NotOnMesh { point };
        match point {
            SurfacePoint::Vertex(v) if (v as usize) < mesh.vertex_count() => Ok(Self::Vertex(v)),
            SurfacePoint::Edge { edge, t } if (edge as usize) < mesh.edge_count() => {
                let h = mesh.edge_halfedge(edge);
                let mut barycentric = [0.0; 3];
                barycentric[h as usize % 3] = 1.0 - t;
                barycentric[(h as usize + 1) % 3] = t;
                Self::in_face(mesh, h / 3, barycentric).ok_or_else(refused)
            }
            SurfacePoint::Face { face, barycentric } if (face as usize) < mesh.face_count() => {
                Self::in_face(mesh, face, barycentric).ok_or_else(refused)
            }
            _ => Err(refused()),
        }
    }

    fn in_face(mesh: &IntrinsicMesh, face: u32, barycentric: [f64; 3]) -> Option<Self> {
        let sum: f64 = barycentric.iter().sum();
        let valid = (sum - 1.0).abs() <= SLOPPINESS && barycentric.iter().all(|b| *b >= -SLOPPINESS);
        // Also refuses NaN.
        if !valid {
            return None;
        }
        let clamped = barycentric.map(|b| b.max(0.0));
        let sum: f64 = clamped.iter().sum();
        let point = FacePoint { face, barycentric: clamped.map(|b| b / sum) };
        // A point without distance from a corner is that corner.
        let corner = (0..3).find(|&c| point.corner_distance(mesh, c) == 0.0);
        Some(corner.map_or(Self::Face(point), |c| Self::Vertex(mesh.tail(3 * face + c))))
    }

    /// The point as one of a face.
    pub(crate) fn as_face_point(self, mesh: &IntrinsicMesh) -> FacePoint {
        match self {
            Self::Face(point) => point,
            Self::Vertex(v) => {
                let h = mesh.vertex_halfedge(v);
                let mut barycentric = [0.0; 3];
                barycentric[h as usize % 3] = 1.0;
                FacePoint { face: h / 3, barycentric }
            }
        }
    }
}

impl FacePoint {
    /// The point in the layout of the face above its side `side`.
    pub(crate) fn above(&self, layout: &Layout, side: u32) -> [f64; 2] {
        let [_, b, c] = [0, 1, 2].map(|i| self.barycentric[(side as usize + i) % 3]);
        [b * layout.length + c * layout.apex[0], c * layout.apex[1]]
    }

    /// Length of the straight line to a corner.
    pub(crate) fn corner_distance(&self, mesh: &IntrinsicMesh, corner: u32) -> f64 {
        let mut barycentric = [0.0; 3];
        barycentric[corner as usize] = 1.0;
        self.distance_in_face(mesh, &Self { face: self.face, barycentric })
    }

    /// Length of the straight line to a point of the same face.
    pub(crate) fn distance_in_face(&self, mesh: &IntrinsicMesh, other: &Self) -> f64 {
        let mut d = [0, 1, 2].map(|i| self.barycentric[i] - other.barycentric[i]);
        // The largest as minus the sum of the others: what it lost by rounding near a corner is still in
        // them.
        let largest = (0..3).max_by(|&i, &j| d[i].abs().total_cmp(&d[j].abs())).unwrap_or(0);
        d[largest] = -(d[(largest + 1) % 3] + d[(largest + 2) % 3]);
        triangle::displacement_length(mesh.sides(self.face), d)
    }

    /// The point as the mesh's users name it: on an edge where a coordinate is 0.
    pub(crate) fn to_surface_point(self, mesh: &IntrinsicMesh) -> SurfacePoint {
        let b = self.barycentric;
        match (0..3).find(|&c| b[c] == 0.0) {
            None => SurfacePoint::Face { face: self.face, barycentric: b },
            Some(c) => {
                let h = 3 * self.face + (c as u32 + 1) % 3;
                let t = b[(c + 2) % 3];
                let edge = mesh.halfedge_edge(h);
                SurfacePoint::Edge { edge, t: if mesh.edge_halfedge(edge) == h { t } else { 1.0 - t } }
            }
        }
    }

    /// What the distances of its face's corners say at most about its own.
    pub(crate) fn bound(&self, mesh: &IntrinsicMesh, distances: &[f64]) -> f64 {
        (0..3)
            .map(|c| distances[mesh.tail(3 * self.face + c) as usize] + self.corner_distance(mesh, c))
            .fold(f64::INFINITY, f64::min)
    }
}
