//! Points of a surface as the wavefront takes them.

use ndf_intrinsic::{IntrinsicMesh, triangle};
use ndf_mesh::{FacePoint, SurfacePoint, Vertex};

use crate::error::GeodesicError;
use crate::unfolding::Layout;

/// A checked point: a vertex, or a point of a face, perhaps on its rim, that is no vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    Vertex(Vertex),
    Face(FacePoint),
}

impl Place {
    /// Checks a point of the mesh.
    ///
    /// # Errors
    /// If its element does not exist or its coordinates are no point of the element.
    pub(crate) fn of(mesh: &IntrinsicMesh, point: SurfacePoint) -> Result<Self, GeodesicError> {
        let refused = || GeodesicError::NotOnMesh { point };
        match point {
            SurfacePoint::Vertex(v) if v.index() < mesh.vertex_count() => Ok(Self::Vertex(v)),
            SurfacePoint::Edge { edge, t } if edge.index() < mesh.edge_count() => {
                Self::in_face(mesh, FacePoint::on_halfedge(mesh.edge_halfedge(edge), t)).ok_or_else(refused)
            }
            SurfacePoint::Face(point) if point.face.index() < mesh.face_count() => {
                Self::in_face(mesh, point).ok_or_else(refused)
            }
            _ => Err(refused()),
        }
    }

    fn in_face(mesh: &IntrinsicMesh, point: FacePoint) -> Option<Self> {
        let point = FacePoint::in_face(point.face, point.barycentric)?;
        // A point without distance from a corner is that corner.
        let corner = (0..3).find(|&c| corner_distance(mesh, &point, c) == 0.0);
        Some(corner.map_or(Self::Face(point), |c| Self::Vertex(mesh.tail(point.face.halfedge(c)))))
    }

    /// The point as one of a face.
    pub(crate) fn as_face_point(self, mesh: &IntrinsicMesh) -> FacePoint {
        match self {
            Self::Face(point) => point,
            Self::Vertex(v) => FacePoint::at_corner(mesh.vertex_halfedge(v)),
        }
    }
}

/// The point in the layout of the face above its side `side`.
pub(crate) fn above(point: &FacePoint, layout: &Layout, side: usize) -> [f64; 2] {
    let [_, b, c] = [0, 1, 2].map(|i| point.barycentric[(side + i) % 3]);
    [b * layout.length + c * layout.apex[0], c * layout.apex[1]]
}

/// Length of the straight line from a point of a face to a corner.
pub(crate) fn corner_distance(mesh: &IntrinsicMesh, point: &FacePoint, corner: usize) -> f64 {
    distance_in_face(mesh, point, &FacePoint::at_corner(point.face.halfedge(corner)))
}

/// Length of the straight line between two points of the same face.
pub(crate) fn distance_in_face(mesh: &IntrinsicMesh, from: &FacePoint, to: &FacePoint) -> f64 {
    let mut d = [0, 1, 2].map(|i| from.barycentric[i] - to.barycentric[i]);
    // The largest as minus the sum of the others: what it lost by rounding near a corner is still in
    // them.
    let largest = (0..3).max_by(|&i, &j| d[i].abs().total_cmp(&d[j].abs())).unwrap_or(0);
    d[largest] = -(d[(largest + 1) % 3] + d[(largest + 2) % 3]);
    // In coordinates: squared lengths of sides would cancel in flat faces.
    let sides = mesh.sides(from.face);
    let [x, y] = triangle::apex(sides);
    (d[1] * sides[0] + d[2] * x).hypot(d[2] * y)
}

/// The point as the mesh's users name it: on an edge where a coordinate is 0.
pub(crate) fn to_surface_point(mesh: &IntrinsicMesh, point: FacePoint) -> SurfacePoint {
    let b = point.barycentric;
    match (0..3).find(|&c| b[c] == 0.0) {
        None => SurfacePoint::Face(point),
        Some(c) => {
            let h = point.face.halfedge((c + 1) % 3);
            let t = b[(c + 2) % 3];
            let edge = mesh.halfedge_edge(h);
            SurfacePoint::Edge { edge, t: if mesh.edge_halfedge(edge) == h { t } else { 1.0 - t } }
        }
    }
}

/// What the distances of its face's corners say at most about that of a point.
pub(crate) fn bound(mesh: &IntrinsicMesh, point: &FacePoint, distances: &[f64]) -> f64 {
    (0..3)
        .map(|c| distances[mesh.tail(point.face.halfedge(c)).index()] + corner_distance(mesh, point, c))
        .fold(f64::INFINITY, f64::min)
}
