//! A manifold mesh whose edges can be collapsed, split and flipped.

use std::ops::Deref;

use ndf_core::DVec3;
use ndf_mesh::halfedge::keep;
use ndf_mesh::{Halfedge, ManifoldMesh, Topology, TriangleMesh, Vertex};

/// Positions, and a connectivity that stays simplicial if the conditions of the edits hold. Vertices and faces keep
/// their numbers: those that are gone are [holes](Topology::is_hole). Dereferences to the connectivity.
#[derive(Clone, Debug)]
pub struct EditableMesh {
    /// Places of the vertices, to be moved at will.
    pub positions: Vec<DVec3>,
    topology: Topology,
    face_count: usize,
}

impl Deref for EditableMesh {
    type Target = Topology;

    fn deref(&self) -> &Topology {
        &self.topology
    }
}

impl EditableMesh {
    /// A mesh to edit.
    pub fn new(mesh: &ManifoldMesh) -> Self {
        let (positions, topology) = (mesh.positions().to_vec(), mesh.topology().clone());
        Self { positions, topology, face_count: mesh.face_count() }
    }

    /// The mesh without the holes that collapses left; what remains keeps its order.
    pub fn into_manifold(mut self) -> ManifoldMesh {
        let survivors = self.topology.compact();
        keep(&mut self.positions, &survivors.vertices);
        let twins: Vec<Halfedge> = self.halfedges().map(|h| self.raw_twin(h)).collect();
        ManifoldMesh::with_twins(self.to_triangle_mesh(), &twins).expect("edits keep a manifold")
    }

    /// The mesh as it is; only where no face or vertex is gone.
    pub fn to_triangle_mesh(&self) -> TriangleMesh {
        let faces = self.topology.faces().map(|f| self.face_vertices(f).map(u32::from)).collect();
        TriangleMesh::new(self.positions.clone(), faces).expect("no face is gone")
    }

    /// Number of faces that are there.
    pub fn face_count(&self) -> usize {
        self.face_count
    }

    /// Where a vertex is.
    pub fn position(&self, v: Vertex) -> DVec3 {
        self.positions[v.index()]
    }

    /// Corners of the face of a half-edge, from its tail.
    pub fn corners(&self, h: Halfedge) -> [Vertex; 3] {
        [h, h.next(), h.previous()].map(|h| self.tail(h))
    }

    /// The half-edge that stands for both of its edge.
    pub fn canonical(&self, h: Halfedge) -> Halfedge {
        h.min(self.raw_twin(h))
    }

    /// Collapses the edge of `h` into its tail, which moves to `position`. The edge must be
    /// [collapsible](Topology::is_collapsible).
    pub fn collapse(&mut self, h: Halfedge, position: DVec3) {
        let tail = self.tail(h);
        self.face_count -= 1 + usize::from(self.twin(h).is_some());
        self.topology.collapse(h);
        self.positions[tail.index()] = position;
    }

    /// Splits the edge of `h`, from a to b, at a new vertex, which is returned. Afterwards `h` runs from a to it.
    pub fn split(&mut self, h: Halfedge, position: DVec3) -> Vertex {
        self.face_count += 1 + usize::from(self.twin(h).is_some());
        self.topology.split_edge(h);
        self.positions.push(position);
        Vertex::new(self.positions.len() - 1)
    }

    /// Replaces the edge of `h`, from a to b, by the edge from d to c between the opposite corners: c left of
    /// `h`, d right of it. The edge must be [flippable](Topology::is_flippable). Afterwards `h` runs from d to c.
    pub fn flip(&mut self, h: Halfedge) {
        let faces = [h, self.raw_twin(h)].map(Halfedge::face);
        self.topology.flip(h);
        faces.into_iter().for_each(|f| self.topology.rotate_face(f));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::shapes;

    #[test]
    fn collapses_keep_topology_until_none_is_possible() {
        for shape in
            [shapes::icosphere(2), shapes::torus(12, 8, 1.0, 0.4), shapes::grid(5, 4), shapes::cube(2)]
        {
            let manifold = ManifoldMesh::try_from(shape).unwrap();
            let mut mesh = EditableMesh::new(&manifold);
            loop {
                let open = mesh.halfedges().filter(|&h| !mesh.is_hole(h));
                let Some(h) = open.into_iter().find(|&h| mesh.is_collapsible(h)) else { break };
                mesh.collapse(h, mesh.position(mesh.tail(h)));
            }
            let [before, open] = [
                manifold.topology().euler_characteristic(),
                manifold.topology().boundary_edge_count() as i64,
            ];
            let fewest = match (before, open) {
                (2, 0) => 4,
                (0, 0) => 14,
                _ => 1,
            };
            // Greedy collapses may stop a little short of the smallest triangulation of a torus.
            assert!((fewest..=fewest + 8).contains(&mesh.face_count()), "{}", mesh.face_count());
            let faces = mesh.face_count();
            let rest = mesh.into_manifold();
            assert_eq!((rest.face_count(), rest.topology().euler_characteristic()), (faces, before));
        }
    }

    #[test]
    fn splits_keep_the_surface() {
        for shape in [shapes::icosphere(1), shapes::grid(4, 3), shapes::torus(7, 6, 1.0, 0.4)] {
            let manifold = ManifoldMesh::try_from(shape).unwrap();
            let mut mesh = EditableMesh::new(&manifold);
            for k in 0..300_u32 {
                let h = Halfedge(k.wrapping_mul(2_654_435_761) % mesh.halfedge_count() as u32);
                let middle = mesh.position(mesh.tail(h)).midpoint(mesh.position(mesh.tip(h)));
                let (tail, m) = (mesh.tail(h), mesh.split(h, middle));
                assert_eq!((mesh.tail(h), mesh.tip(h)), (tail, m));
            }
            let faces = mesh.face_count();
            let split = mesh.into_manifold();
            assert_eq!(split.face_count(), faces);
            assert!((split.area() - manifold.area()).abs() < 1e-9);
        }
    }

    #[test]
    fn a_flipped_half_edge_runs_between_the_opposite_corners() {
        let mut mesh = EditableMesh::new(&ManifoldMesh::try_from(shapes::grid(4, 4)).unwrap());
        let flippable = |mesh: &EditableMesh, h: Halfedge| mesh.canonical(h) == h && mesh.is_flippable(h);
        for h in mesh.halfedges() {
            if flippable(&mesh, h) {
                let [c, d] = [h, mesh.raw_twin(h)].map(|h| mesh.tail(h.previous()));
                mesh.flip(h);
                assert_eq!([mesh.tail(h), mesh.tip(h)], [d, c]);
            }
        }
        mesh.check().unwrap();
    }
}
