//! Steps of a mesh that is there.

use super::machine::{Guide, Machine, Step};
use super::order::BaseOrder;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::NO_HALFEDGE;

/// A mesh whose connectivity is written.
pub(super) struct Writing<'a> {
    mesh: &'a ManifoldMesh,
    pub(super) order: BaseOrder,
    /// Of every face of the mesh, the half-edge in its own numbering that became the first of the new face; and that
    /// face. [`NO_HALFEDGE`] before it is visited.
    new_faces: Vec<u32>,
    new_vertices: Vec<u32>,
    next_component: u32,
}

impl<'a> Writing<'a> {
    pub(super) fn new(mesh: &'a ManifoldMesh) -> Self {
        Self {
            mesh,
            order: BaseOrder::default(),
            new_faces: vec![NO_HALFEDGE; mesh.face_count()],
            new_vertices: vec![NO_HALFEDGE; mesh.vertex_count()],
            next_component: 0,
        }
    }

    fn is_visited(&self, halfedge: u32) -> bool {
        self.new_faces[halfedge as usize / 3] != NO_HALFEDGE
    }

    /// The mesh's half-edge of the machine's.
    fn old(&self, new: u32) -> u32 {
        let first = self.order.faces[new as usize / 3];
        3 * (first / 3) + (first + new) % 3
    }

    /// The machine's half-edge of the mesh's.
    fn new_halfedge(&self, old: u32) -> u32 {
        let face = self.new_faces[old as usize / 3];
        let first = self.order.faces[face as usize];
        3 * face + (old + 3 - first % 3) % 3
    }

    fn take_face(&mut self, first: u32) {
        self.new_faces[first as usize / 3] = self.order.faces.len() as u32;
        self.order.faces.push(first);
    }

    fn take_vertex(&mut self, vertex: u32) {
        self.new_vertices[vertex as usize] = self.order.vertices.len() as u32;
        self.order.vertices.push(vertex);
    }

    /// The node of the machine at whose wedge the face to come has its corner, where half-edge `out` leaves.
    fn node_at(&self, machine: &Machine, out: u32) -> Option<u32> {
        let mesh = self.mesh;
        // Towards the faces before `out`, then towards those behind.
        let mut h = out;
        while let Some(twin) = mesh.topology().twin(h) {
            if self.is_visited(twin) {
                let before = machine.owners[self.new_halfedge(twin) as usize];
                return Some(machine.node(before).next);
            }
            h = mesh.topology().next(twin);
        }
        h = mesh.topology().previous(out);
        while let Some(twin) = mesh.topology().twin(h) {
            if self.is_visited(twin) {
                return Some(machine.owners[self.new_halfedge(twin) as usize]);
            }
            h = mesh.topology().previous(twin);
        }
        None
    }

    /// How far node s is from the gate, the shorter way, if it is on the same front.
    fn offset(machine: &Machine, a: u32, b: u32, s: u32) -> Option<i32> {
        let (mut ahead, mut behind) = (b, a);
        for steps in 1.. {
            ahead = machine.node(ahead).next;
            behind = machine.node(behind).previous;
            if ahead == s {
                return Some(steps);
            }
            if behind == s {
                return Some(-steps);
            }
            if ahead == a {
                return None;
            }
        }
        None
    }

    /// Which waiting front node s is on, and where.
    fn front(machine: &Machine, s: u32) -> Option<(i32, i32)> {
        for (front, &first) in (0..).zip(machine.waiting.iter().rev()) {
            let mut node = first;
            for offset in 0.. {
                if node == s {
                    return Some((front, offset));
                }
                node = machine.node(node).next;
                if node == first {
                    break;
                }
            }
        }
        None
    }
}

impl Guide for Writing<'_> {
    fn begin(&mut self) {
        while self.is_visited(3 * self.next_component) {
            self.next_component += 1;
        }
        self.take_face(3 * self.next_component);
        for v in self.mesh.faces()[self.next_component as usize] {
            self.take_vertex(v);
        }
    }

    fn across(&mut self, machine: &Machine, gate: u32) -> Step {
        let (a, b) = (gate, machine.node(gate).next);
        let Some(twin) = self.mesh.topology().twin(self.old(machine.node(gate).halfedge)) else {
            return Step::Border;
        };
        let out = self.mesh.topology().previous(twin);
        let vertex = self.mesh.topology().tail(out);
        if self.new_vertices[vertex as usize] == NO_HALFEDGE {
            self.take_face(twin);
            self.take_vertex(vertex);
            return Step::New;
        }
        let s = self.node_at(machine, out).expect("a vertex that was seen has a visited face");
        self.take_face(twin);
        if s == machine.node(b).next {
            Step::CloseAhead
        } else if s == machine.node(a).previous {
            Step::CloseBehind
        } else if let Some(offset) = Self::offset(machine, a, b, s) {
            Step::Split(offset)
        } else {
            let (front, offset) = Self::front(machine, s).expect("a node is on a front");
            Step::Merge(front, offset)
        }
    }
}
