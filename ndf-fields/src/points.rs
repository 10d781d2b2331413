//! Points of a surface in the faces around them.

use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{FacePoint, SurfacePoint};

use crate::error::FieldError;

/// A point in all faces that it is a point of.
pub(crate) fn in_faces(mesh: &IntrinsicMesh, point: SurfacePoint) -> Result<Vec<FacePoint>, FieldError> {
    let lost = FieldError::NotOnMesh { point };
    Ok(match point {
        SurfacePoint::Vertex(v) if v.index() < mesh.vertex_count() => {
            mesh.outgoing(v).map(FacePoint::at_corner).collect()
        }
        SurfacePoint::Edge { edge, t } if edge.index() < mesh.edge_count() && (0.0..=1.0).contains(&t) => {
            let ends = mesh.edge_vertices(edge);
            if t == 0.0 || t == 1.0 {
                return in_faces(mesh, SurfacePoint::Vertex(ends[usize::from(t == 1.0)]));
            }
            let h = mesh.edge_halfedge(edge);
            let twin = mesh.twin(h).map(|twin| FacePoint::on_halfedge(twin, 1.0 - t));
            std::iter::once(FacePoint::on_halfedge(h, t)).chain(twin).collect()
        }
        SurfacePoint::Face(point) if point.face.index() < mesh.face_count() => {
            let point = FacePoint::in_face(point.face, point.barycentric).ok_or(lost)?;
            let zeros: Vec<usize> = (0..3).filter(|&c| point.barycentric[c] == 0.0).collect();
            match zeros[..] {
                [] => vec![point],
                [off] => {
                    let side = point.face.halfedge((off + 1) % 3);
                    let t = point.barycentric[(off + 2) % 3];
                    let twin = mesh.twin(side).map(|twin| FacePoint::on_halfedge(twin, 1.0 - t));
                    std::iter::once(point).chain(twin).collect()
                }
                _ => {
                    let corner = (0..3).find(|c| !zeros.contains(c)).unwrap_or(0);
                    let v = mesh.tail(point.face.halfedge(corner));
                    return in_faces(mesh, SurfacePoint::Vertex(v));
                }
            }
        }
        _ => return Err(lost),
    })
}
