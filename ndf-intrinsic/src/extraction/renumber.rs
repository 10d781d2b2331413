//! Numbering by place: what is near on the surface lies near in memory.
//!
//! Splits number their vertices and faces round by round, all over the surface; later passes then wait for
//! memory at every step.

use rayon::prelude::*;

use super::Surface;
use crate::delta_complex::{DeltaComplex, HalfEdge, NO_HALFEDGE};
use crate::intrinsic_mesh::IntrinsicMesh;

/// Renumbers vertices by base face, faces by their first vertex and edges by their first face. O(n log n).
pub(super) fn renumber(surface: &Surface) -> Surface {
    let Surface { mesh, origins, points } = surface;
    let mut vertices: Vec<(u32, u32)> = origins.iter().zip(0..).map(|(origin, v)| (origin.face, v)).collect();
    vertices.par_sort_unstable();
    let new_vertices = positions_of(&vertices);
    let mut faces: Vec<(u32, u32)> = (0..mesh.face_count() as u32)
        .into_par_iter()
        .map(|f| {
            let [a, b, c] = mesh.face_vertices(f).map(|v| new_vertices[v as usize]);
            (a.min(b).min(c), f)
        })
        .collect();
    faces.par_sort_unstable();
    let new_faces = positions_of(&faces);
    let new_halfedge = |h: u32| 3 * new_faces[h as usize / 3] + h % 3;

    let mut edge_halfedges = Vec::with_capacity(mesh.edge_count());
    let mut lengths = Vec::with_capacity(mesh.edge_count());
    let mut halfedges: Vec<HalfEdge> = Vec::with_capacity(mesh.halfedge_count());
    for h in faces.iter().flat_map(|&(_, f)| [3 * f, 3 * f + 1, 3 * f + 2]) {
        let at = halfedges.len() as u32;
        let twin = mesh.twin(h).map_or(NO_HALFEDGE, new_halfedge);
        let edge = if twin < at {
            halfedges[twin as usize].edge
        } else {
            edge_halfedges.push(at);
            lengths.push(mesh.halfedge_length(h));
            edge_halfedges.len() as u32 - 1
        };
        halfedges.push(HalfEdge { twin, tail: new_vertices[mesh.tail(h) as usize], edge, roundabout: 0 });
    }
    let vertex_halfedges = vertices.iter().map(|&(_, v)| new_halfedge(mesh.vertex_halfedge(v))).collect();
    Surface {
        mesh: IntrinsicMesh {
            complex: DeltaComplex { halfedges, edge_halfedges, vertex_halfedges },
            lengths,
        },
        origins: vertices.iter().map(|&(_, v)| origins[v as usize]).collect(),
        points: vertices.iter().map(|&(_, v)| points[v as usize]).collect(),
    }
}

/// Where each number stands in an order.
fn positions_of(order: &[(u32, u32)]) -> Vec<u32> {
    let mut positions = vec![0; order.len()];
    for (new, &(_, old)) in order.iter().enumerate() {
        positions[old as usize] = new as u32;
    }
    positions
}
