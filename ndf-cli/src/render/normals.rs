//! Normals that are smooth across soft edges and break at sharp ones.

use ndf_core::DVec3;
use ndf_mesh::{Face, FacePoint, TriangleMesh};

/// Faces meeting at a larger angle than this are not smoothed into each other.
const CREASE_DEGREES: f64 = 38.0;

/// A unit normal for every corner of every face: the mean, weighted by angle, of the faces around the vertex
/// that lie within the crease angle of this one.
#[derive(Debug)]
pub(super) struct CornerNormals(Vec<[DVec3; 3]>);

impl CornerNormals {
    /// O(n) for bounded valences.
    pub(super) fn of(mesh: &TriangleMesh) -> Self {
        let mut starts = vec![0_usize; mesh.vertex_count() + 1];
        mesh.faces().iter().flatten().for_each(|&v| starts[v as usize + 1] += 1);
        for v in 0..mesh.vertex_count() {
            starts[v + 1] += starts[v];
        }
        let mut ends = starts.clone();
        let mut around = vec![(Face(0), 0.0); 3 * mesh.face_count()];
        let normals: Vec<DVec3> = mesh.face_indices().map(|f| mesh.face_normal(f)).collect();
        for (f, face) in mesh.face_indices().zip(mesh.faces()) {
            let p = mesh.corner_positions(f);
            for (c, &v) in face.iter().enumerate() {
                let angle = (p[(c + 1) % 3] - p[c]).angle_between(p[(c + 2) % 3] - p[c]);
                around[ends[v as usize]] = (f, if angle.is_finite() { angle } else { 0.0 });
                ends[v as usize] += 1;
            }
        }
        let least = CREASE_DEGREES.to_radians().cos();
        let corner = |f: usize, v: u32| {
            // A vertex thousands of faces share is the tip of a fan; its normals would cost their square.
            let faces = &around[starts[v as usize]..ends[v as usize]];
            let near = faces.iter().take(256).filter(|(g, _)| normals[g.index()].dot(normals[f]) >= least);
            let sum: DVec3 = near.map(|&(g, angle)| normals[g.index()] * angle).sum();
            sum.try_normalize().unwrap_or(normals[f])
        };
        Self(mesh.faces().iter().enumerate().map(|(f, face)| face.map(|v| corner(f, v))).collect())
    }

    /// The unit normal at a point of a face; zero where the face has none.
    pub(super) fn at(&self, point: &FacePoint) -> DVec3 {
        point.interpolate(self.0[point.face.index()]).normalize_or_zero()
    }
}
