//! Winding numbers of closed meshes, from what rays cross.

use ndf_core::DVec3;
use ndf_mesh::TriangleTree;

use crate::pseudonormals::Pseudonormals;

/// Directions of rays, along which nothing is aligned.
const RAYS: [DVec3; 6] = [
    DVec3::new(0.331, 0.577, 0.746),
    DVec3::new(-0.813, 0.197, 0.548),
    DVec3::new(0.271, -0.921, 0.279),
    DVec3::new(-0.443, -0.391, -0.807),
    DVec3::new(0.617, -0.218, -0.756),
    DVec3::new(-0.149, 0.887, -0.437),
];

/// A ray that comes as close to an edge, in barycentric coordinates, or to the plane of a face, as a cosine, may miss a face or meet
/// one too many.
const DOUBTFUL: f64 = 1e-9;

/// The winding number of a closed mesh around `p`: the faces that a ray from there leaves through, less those it enters through.
/// O(log n), and no more memory than the tree; exact where `p` is not on the mesh.
pub(crate) fn winding_of_closed(tree: &TriangleTree, normals: &Pseudonormals, p: DVec3) -> i32 {
    let mut winding = 0;
    for ray in RAYS {
        let (mut is_sure, mut sum) = (true, 0);
        for hit in tree.hits(p, ray) {
            let across = normals.of_face(hit.at.face).dot(ray);
            is_sure &= hit.at.barycentric.into_iter().fold(across.abs(), f64::min) > DOUBTFUL;
            sum += if across > 0.0 { 1 } else { -1 };
        }
        winding = sum;
        if is_sure {
            break;
        }
    }
    winding
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::WindingNumber;
    use ndf_core::BoundingBox;
    use ndf_mesh::{TriangleMesh, shapes};

    /// Two spheres that overlap, an inner one turned inside out, and a knot.
    fn meshes() -> [TriangleMesh; 3] {
        let sphere =
            |shift: f64, scale: f64| shapes::icosphere(3).map_positions(|p| scale * p + shift * DVec3::X);
        let together = |a: TriangleMesh, b: TriangleMesh, turned: bool| {
            let ((mut positions, mut faces), (more, their)) = (a.into_parts(), b.into_parts());
            let first = positions.len() as u32;
            positions.extend(more);
            faces.extend(their.into_iter().map(|[a, b, c]| {
                let corners = if turned { [a, c, b] } else { [a, b, c] };
                corners.map(|v| v + first)
            }));
            TriangleMesh::new(positions, faces).unwrap()
        };
        [
            together(sphere(0.0, 1.0), sphere(1.0, 1.0), false),
            together(sphere(0.0, 1.0), sphere(0.1, 0.5), true),
            shapes::trefoil_knot(200, 20, 0.24),
        ]
    }

    #[test]
    fn crossings_are_winding_numbers() {
        for mesh in meshes() {
            let (tree, normals) = (TriangleTree::new(&mesh), Pseudonormals::new(&mesh));
            let winding = WindingNumber::new(&mesh);
            let BoundingBox { min, max } = mesh.bounds().padded(0.1);
            for i in 0..2000 {
                let t = (DVec3::new(0.618, 0.414, 0.732) * f64::from(i)).fract();
                let p = min + t * (max - min);
                let found = winding_of_closed(&tree, &normals, p);
                assert!((winding.at(p) - f64::from(found)).abs() < 0.02, "{p}: {found}");
            }
            // Where a corner is in the way of the first ray.
            let p = mesh.positions()[7] - 0.05 * RAYS[0];
            let found = winding_of_closed(&tree, &normals, p);
            assert!((winding.at(p) - f64::from(found)).abs() < 0.02);
        }
    }
}
