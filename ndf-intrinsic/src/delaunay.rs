//! Intrinsic Delaunay triangulation by edge flips (Bobenko and Springborn 2007, "A discrete Laplace–Beltrami
//! operator for simplicial surfaces"), where only the flat metric matters and not where edges run.

use crate::delta_complex::{DeltaComplex, NO_HALFEDGE};
use crate::intrinsic_mesh::IntrinsicMesh;
use crate::triangle;

/// The intrinsic Delaunay triangulation with the vertices and the metric of a mesh; the second value counts the
/// flips. Boundary edges stay. The result may be a proper Δ-complex: loops and double edges occur.
///
/// Edges between faces without area stay as they are: [`IntrinsicMesh::mollify`] first. About O(n) on real meshes.
pub fn flip_to_delaunay(mesh: &IntrinsicMesh) -> (IntrinsicMesh, usize) {
    let mut mesh = mesh.clone();
    let edges = mesh.edge_count();
    let mut pending: Vec<u32> = (0..edges as u32).filter(|&e| !mesh.is_delaunay_edge(e)).collect();
    let mut queued = vec![false; edges];
    pending.iter().for_each(|&e| queued[e as usize] = true);
    // Every flip lowers the Dirichlet energy, so that flipping ends (Rippa 1990); rounding may break this at faces
    // that are all but flat, hence a limit far above what meshes need.
    let limit = 1000 + 100 * edges;
    let mut flips = 0;
    while let Some(edge) = pending.pop() {
        queued[edge as usize] = false;
        if flips == limit || mesh.is_delaunay_edge(edge) || !flip(&mut mesh, edge) {
            continue;
        }
        flips += 1;
        let h = mesh.edge_halfedge(edge);
        for side in std::iter::once(h).chain(mesh.twin(h)) {
            for neighbour in [mesh.next(side), mesh.previous(side)].map(|h| mesh.halfedge_edge(h)) {
                if !std::mem::replace(&mut queued[neighbour as usize], true) {
                    pending.push(neighbour);
                }
            }
        }
    }
    (mesh, flips)
}

/// Turns an edge into the other diagonal of its two faces; `false`, and nothing done, where it has one face, twice
/// the same face, or where the other diagonal would have no length.
fn flip(mesh: &mut IntrinsicMesh, edge: u32) -> bool {
    let h = mesh.edge_halfedge(edge);
    let Some(t) = mesh.twin(h) else { return false };
    if h / 3 == t / 3 {
        return false;
    }
    // Both faces in the plane: h from the origin along x, its face above, the twin's face below.
    let [x, y] = triangle::apex(mesh.sides_from(h));
    let [tx, ty] = triangle::apex(mesh.sides_from(t));
    let length = (mesh.halfedge_length(h) - tx - x).hypot(y + ty);
    if !(length > 0.0 && length.is_finite()) {
        return false;
    }
    reconnect(&mut mesh.complex, h, t);
    mesh.lengths[edge as usize] = length;
    true
}

/// Replaces the diagonal i → j of the faces (i, j, k) of `h` and (j, i, l) of its twin `t` by l → k. The slots of `h`
/// and `t` take i → l and j → k, and the new diagonal lies in the slots after them.
fn reconnect(complex: &mut DeltaComplex, h: u32, t: u32) {
    let edge = complex.halfedge_edge(h);
    let (hn, tn) = (complex.next(h), complex.next(t));
    let (k, l) = (complex.tip(hn), complex.tip(tn));
    for (from, to) in [(hn, t), (tn, h)] {
        let record = complex.halfedges[from as usize];
        complex.halfedges[to as usize] = record;
        if record.twin != NO_HALFEDGE {
            complex.halfedges[record.twin as usize].twin = to;
        }
        let references = [
            &mut complex.edge_halfedges[record.edge as usize],
            &mut complex.vertex_halfedges[record.tail as usize],
        ];
        references.into_iter().filter(|r| **r == from).for_each(|r| *r = to);
    }
    for (slot, twin, tail) in [(hn, tn, l), (tn, hn, k)] {
        let record = &mut complex.halfedges[slot as usize];
        (record.twin, record.tail, record.edge) = (twin, tail, edge);
    }
    complex.edge_halfedges[edge as usize] = hn;
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use ndf_core::ManifoldMesh;
    use ndf_core::mesh::shapes;

    #[test]
    fn flips_make_meshes_delaunay_and_keep_the_metric() {
        let stretched = |p: glam::DVec3| glam::DVec3::new(4.0 * p.x, p.y, 0.2 * p.z);
        for mesh in
            [shapes::icosphere(3), shapes::torus(30, 9, 1.0, 0.4), shapes::grid(6, 5), shapes::cube(3)]
        {
            let mesh = ManifoldMesh::try_from(mesh.map_positions(stretched)).unwrap();
            let mesh = IntrinsicMesh::of_mesh(&mesh);
            let (delaunay, flips) = flip_to_delaunay(&mesh);
            delaunay.check().unwrap();
            assert!(delaunay.is_delaunay());
            assert_eq!(flips == 0, mesh.is_delaunay());
            assert_eq!(delaunay.boundary_edge_count(), mesh.boundary_edge_count());
            assert_relative_eq!(delaunay.total_area(), mesh.total_area(), max_relative = 1e-10);
            for (a, b) in delaunay.angle_sums().iter().zip(mesh.angle_sums()) {
                assert_relative_eq!(*a, b, epsilon = 1e-8);
            }
            assert_eq!(flip_to_delaunay(&delaunay).1, 0);
        }
    }

    #[test]
    fn a_sheared_torus_of_one_vertex_becomes_a_square() {
        // The lattice of (1, 0) and (3, 1): sides 1, √10 and √17; reduced, it is the square lattice.
        let complex = DeltaComplex::from_gluing(1, &[0; 6], &[3, 4, 5, 0, 1, 2]).unwrap();
        let mesh = IntrinsicMesh::new(complex, vec![1.0, 10.0_f64.sqrt(), 17.0_f64.sqrt()], 0.0).unwrap();
        let (delaunay, flips) = flip_to_delaunay(&mesh);
        assert_eq!(flips, 3);
        let mut lengths = delaunay.lengths().to_vec();
        lengths.sort_by(f64::total_cmp);
        assert_relative_eq!(lengths[..], [1.0, 1.0, 2.0_f64.sqrt()][..], max_relative = 1e-12);
    }
}
