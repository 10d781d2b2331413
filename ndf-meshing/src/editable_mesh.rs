//! A manifold mesh whose edges can be collapsed, split and flipped.

use std::ops::Deref;

use ndf_core::DVec3;
use ndf_mesh::halfedge::keep;
use ndf_mesh::{Face, Halfedge, ManifoldMesh, NO_HALFEDGE, Topology, TriangleMesh, Vertex};

use crate::triangle_shape::cross;

/// Positions, and a connectivity that stays simplicial if the conditions of the edits hold. Vertices and faces keep
/// their numbers: those that are gone are [holes](Topology::is_hole). Dereferences to the connectivity.
#[derive(Clone, Debug)]
pub struct EditableMesh {
    /// Places of the vertices, to be moved at will.
    pub positions: Vec<DVec3>,
    topology: Topology,
    face_count: usize,
    /// Whether the edge of a half-edge is a crease; empty as long as none is marked.
    creases: Vec<bool>,
}

/// The two directions of a crease at a vertex have a sum of this length where it turns by 60°; where it turns more is a corner.
const STRAIGHT: f64 = 1.0;

/// What edits must keep at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Constraint {
    /// Nothing.
    Free,
    /// It is on a boundary, and no crease ends there.
    Border,
    /// It is between two edges of a crease.
    Crease,
    /// Creases end, meet or turn there.
    Corner,
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
        Self { positions, topology, face_count: mesh.face_count(), creases: Vec::new() }
    }

    /// Marks as creases the inner edges at which the faces meet at more than this angle, in radians, between their normals.
    /// Collapses, splits and flips keep the marks from then on. O(n).
    pub fn mark_creases(&mut self, angle: f64) {
        let normals: Vec<DVec3> = self
            .faces()
            .map(|f| cross(self.face_vertices(f).map(|v| self.position(v))).normalize_or_zero())
            .collect();
        let normal = |h: Halfedge| normals[h.face().index()];
        let is_sharp = |h: Halfedge| {
            let across = self.twin(h)?;
            // Of a face without area nothing is known.
            let has_normals = normal(h) != DVec3::ZERO && normal(across) != DVec3::ZERO;
            Some(has_normals && normal(h).angle_between(normal(across)) > angle)
        };
        let creases: Vec<bool> = self.halfedges().map(|h| is_sharp(h) == Some(true)).collect();
        self.creases = if creases.contains(&true) { creases } else { Vec::new() };
    }

    /// Whether the edge of a half-edge is marked as a crease.
    pub fn is_crease(&self, h: Halfedge) -> bool {
        self.creases.get(h.index()).is_some_and(|&is_crease| is_crease)
    }

    /// What edits must keep at a vertex.
    pub fn constraint(&self, v: Vertex) -> Constraint {
        let (mut creases, mut sum) = (0, DVec3::ZERO);
        if !self.creases.is_empty() {
            for h in self.edges_at(v).filter(|&h| self.is_crease(h)) {
                let other = if self.tail(h) == v { self.tip(h) } else { self.tail(h) };
                creases += 1;
                sum += (self.position(other) - self.position(v)).normalize_or_zero();
            }
        }
        match (creases, self.is_boundary_vertex(v)) {
            (0, false) => Constraint::Free,
            (0, true) => Constraint::Border,
            (2, false) if sum.length() <= STRAIGHT => Constraint::Crease,
            _ => Constraint::Corner,
        }
    }

    /// Whether the edge of `h` may be collapsed without creases joining or ending elsewhere, as far as the marks go. If it
    /// may, the end that must stay where it is, or none.
    pub fn anchor(&self, h: Halfedge) -> Option<Option<Vertex>> {
        use Constraint::{Border, Corner, Crease, Free};
        let (a, b) = (self.tail(h), self.tip(h));
        let anchor = match (self.constraint(a), self.constraint(b)) {
            (Free, Free) | (Border, Border) => None,
            (Free, _) => Some(b),
            (_, Free) => Some(a),
            (Crease, Crease) if self.is_crease(h) => None,
            (Corner, Crease) if self.is_crease(h) => Some(a),
            (Crease, Corner) if self.is_crease(h) => Some(b),
            (Corner, Border) if self.twin(h).is_none() => Some(a),
            (Border, Corner) if self.twin(h).is_none() => Some(b),
            _ => return None,
        };
        // Of three creases around a face none may vanish.
        let joins = |side: Halfedge| {
            side != NO_HALFEDGE && self.is_crease(side.next()) && self.is_crease(side.previous())
        };
        (!joins(h) && !joins(self.raw_twin(h))).then_some(anchor)
    }

    /// Marks the sides of the faces at `v`: those at it as `inner` says, by their other end, the others as their twins are.
    fn mark_around(&mut self, v: Vertex, inner: impl Fn(Vertex) -> bool) {
        if self.creases.is_empty() {
            return;
        }
        self.creases.resize(self.topology.halfedge_count(), false);
        for h in self.topology.outgoing(v).collect::<Vec<_>>() {
            let [along, outer, back] = [h, h.next(), h.previous()];
            self.creases[along.index()] = inner(self.tip(along));
            self.creases[back.index()] = inner(self.tail(back));
            self.creases[outer.index()] = self.twin(outer).is_some_and(|twin| self.is_crease(twin));
        }
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
        if !self.creases.is_empty() {
            // The other two edges of a face that goes become one.
            for side in [h, self.raw_twin(h)].into_iter().filter(|&side| side != NO_HALFEDGE) {
                let is_crease = self.is_crease(side.next()) || self.is_crease(side.previous());
                for outer in [side.next(), side.previous()].map(|h| self.raw_twin(h)) {
                    if outer != NO_HALFEDGE {
                        self.creases[outer.index()] = is_crease;
                    }
                }
            }
        }
        self.topology.collapse(h);
        self.positions[tail.index()] = position;
    }

    /// Splits the edge of `h`, from a to b, at a new vertex, which is returned. Afterwards `h` runs from a to it.
    pub fn split(&mut self, h: Halfedge, position: DVec3) -> Vertex {
        self.face_count += 1 + usize::from(self.twin(h).is_some());
        let (ends, is_crease) = ([self.tail(h), self.tip(h)], self.is_crease(h));
        self.topology.split_edge(h);
        self.positions.push(position);
        let middle = Vertex::new(self.positions.len() - 1);
        self.mark_around(middle, |v| is_crease && ends.contains(&v));
        middle
    }

    /// Replaces the edge of `h`, from a to b, by the edge from d to c between the opposite corners: c left of
    /// `h`, d right of it. The edge must be [flippable](Topology::is_flippable) and no crease. Afterwards `h` runs from d to c.
    pub fn flip(&mut self, h: Halfedge) {
        let faces = [h, self.raw_twin(h)].map(Halfedge::face);
        self.topology.flip(h);
        faces.into_iter().for_each(|f| self.topology.rotate_face(f));
        if !self.creases.is_empty() {
            for side in faces.into_iter().flat_map(Face::halfedges) {
                self.creases[side.index()] = self.twin(side).is_some_and(|twin| self.is_crease(twin));
            }
            [h, self.raw_twin(h)].into_iter().for_each(|side| self.creases[side.index()] = false);
        }
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
