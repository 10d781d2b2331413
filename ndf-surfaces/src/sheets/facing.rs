//! Sheets that face outward.

use ndf_mesh::{TriangleMesh, TriangleTree};
use rayon::prelude::*;

use super::{OFFSET, Sheets};
use crate::pseudonormals::Pseudonormals;

/// The mesh with those sheets turned that are seen from behind more than twice as well as from before: the faces of a solid that were
/// not sewn together, or to walls inside, and point anywhere. What is closed by itself stays, as do sheets that are seen
/// from both sides, and those that are not seen. The faces of a sheet should agree already, as
/// [`oriented`](ndf_mesh::repair::oriented) leaves them. O(n log n), with some million rays at most.
pub fn facing_out(mesh: &TriangleMesh) -> TriangleMesh {
    let tree = TriangleTree::new(mesh);
    let sheets = Sheets::new(mesh, &Pseudonormals::new(mesh), OFFSET * tree.bounds().diagonal());
    let open: Vec<usize> = (0..sheets.patches.len()).filter(|&p| !sheets.is_closed(p)).collect();
    let directions = sheets.directions(&open);
    let is_turned = |&p: &usize| {
        let (mut behind, mut before) = (0, 0);
        for is_before in sheets.leaving(p, &directions, &tree) {
            *if is_before { &mut before } else { &mut behind } += 1;
        }
        behind > 2 * before + sheets.through_cracks(p, &directions)
    };
    let turned: Vec<usize> = open.into_par_iter().filter(is_turned).collect();
    let mut faces = mesh.faces().to_vec();
    turned.iter().flat_map(|&p| &sheets.patches[p].faces).for_each(|&f| faces[f as usize].swap(1, 2));
    TriangleMesh::new(mesh.positions().to_vec(), faces).expect("turning faces leaves their indices in range")
}
