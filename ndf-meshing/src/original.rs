//! A fine mesh as the surface its decimated version is fitted to.

use ndf_core::{Answer, BoundingBox, DVec3, Foot, Miss, Query, Surface};
use ndf_mesh::triangle_tree::TriangleTree;
use ndf_mesh::{Face, ManifoldMesh};

/// Closest points of a mesh. Where a query has a normal, the closest point on faces towards the same side, so
/// that the two sides of a thin wall are told apart.
pub(crate) struct OriginalMesh {
    tree: TriangleTree,
    normals: Vec<DVec3>,
}

impl OriginalMesh {
    pub(crate) fn new(mesh: &ManifoldMesh) -> Self {
        let normals = mesh.face_indices().map(|f| mesh.face_normal(f)).collect();
        Self { tree: TriangleTree::new(mesh), normals }
    }
}

impl Surface for OriginalMesh {
    fn bounds(&self) -> BoundingBox {
        self.tree.bounds()
    }

    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        for (query, foot) in queries.iter().zip(feet) {
            if !query.point.is_finite() {
                *foot = Err(Miss::NotFinite);
                continue;
            }
            let guide = query.normal.unwrap_or(DVec3::ZERO);
            let same_side = |f: Face| self.normals[f.index()].dot(guide) >= 0.0;
            let closest = self.tree.closest_point_where(query.point, query.hint, same_side);
            let closest = closest.or_else(|| self.tree.closest_point(query.point, query.hint));
            *foot = closest.ok_or(Miss::OutOfReach).map(|c| Foot {
                point: c.point,
                normal: self.normals[c.at.face.index()],
                hint: c.hint(),
            });
        }
    }
}
