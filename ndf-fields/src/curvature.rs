//! Principal curvatures of embedded meshes as fields to align with.

use ndf_core::DVec3;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Face, ManifoldMesh};
use num_complex::Complex64;

use crate::bundle::TangentBundle;

/// The squares of the principal directions of the largest curvature at every vertex, in the planes of a [`TangentBundle`], as long as
/// the principal curvatures differ: their mean difference around the vertex, in inverse units of length. From the dihedral angles of the
/// edges (Cohen-Steiner and Morvan 2003; the Hopf differential of Knöppel et al. 2013, §6.1.2). O(n).
pub fn principal_directions(mesh: &ManifoldMesh) -> Vec<Complex64> {
    let bundle = TangentBundle::as_given(IntrinsicMesh::from_mesh(mesh));
    let topology = mesh.topology();
    let positions = mesh.positions();
    let normal = |face: Face| mesh.face_normal(face);
    let mut sums = vec![Complex64::default(); mesh.vertex_count()];
    let mut areas = vec![0.0; mesh.vertex_count()];
    for face in topology.faces() {
        let area = mesh.face_area(face) / 3.0;
        topology.face_vertices(face).iter().for_each(|v| areas[v.index()] += area);
    }
    for edge in topology.edges() {
        let h = topology.edge_halfedge(edge);
        let Some(twin) = topology.twin(h) else { continue };
        let along: DVec3 = positions[topology.tip(h).index()] - positions[topology.tail(h).index()];
        let length = along.length();
        if length <= 0.0 {
            continue;
        }
        let (left, right) = (normal(h.face()), normal(twin.face()));
        // Positive where the surface bends away from its normals.
        let dihedral = (along / length).dot(left.cross(right)).atan2(left.dot(right));
        for h in [h, twin] {
            // The surface bends across the edge; half of it belongs to either end.
            let square = Complex64::cis(2.0 * bundle.direction(h));
            sums[topology.tail(h).index()] -= square * (0.5 * length * dihedral);
        }
    }
    sums.iter()
        .zip(areas)
        .map(|(sum, area)| if area > 0.0 { sum / area } else { Complex64::default() })
        .collect()
}
