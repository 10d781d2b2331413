//! Steps of a mesh that is there.

use super::machine::{Guide, Machine, Step};
use super::order::BaseOrder;
use ndf_mesh::{Face, Halfedge, ManifoldMesh, Vertex};

/// Stands for the number of what is not visited yet.
const NOT_VISITED: u32 = u32::MAX;

/// A mesh whose connectivity is written. The machine numbers faces, half-edges and vertices as it visits them.
pub(super) struct Writing<'a> {
    mesh: &'a ManifoldMesh,
    pub(super) order: BaseOrder,
    /// What every face of the mesh is to the machine; [`NOT_VISITED`] before it is visited.
    new_faces: Vec<u32>,
    /// The same of every vertex.
    new_vertices: Vec<u32>,
    next_component: Face,
}

impl<'a> Writing<'a> {
    pub(super) fn new(mesh: &'a ManifoldMesh) -> Self {
        Self {
            mesh,
            order: BaseOrder::default(),
            new_faces: vec![NOT_VISITED; mesh.face_count()],
            new_vertices: vec![NOT_VISITED; mesh.vertex_count()],
            next_component: Face(0),
        }
    }

    fn is_visited(&self, halfedge: Halfedge) -> bool {
        self.new_faces[halfedge.face().index()] != NOT_VISITED
    }

    /// The mesh's half-edge of the machine's.
    fn old(&self, new: u32) -> Halfedge {
        let first = Halfedge(self.order.faces[new as usize / 3]);
        first.face().halfedge((first.corner() + new as usize) % 3)
    }

    /// The machine's half-edge of the mesh's.
    fn new_halfedge(&self, old: Halfedge) -> u32 {
        let face = self.new_faces[old.face().index()];
        let first = Halfedge(self.order.faces[face as usize]);
        3 * face + (old.corner() + 3 - first.corner()) as u32 % 3
    }

    fn take_face(&mut self, first: Halfedge) {
        self.new_faces[first.face().index()] = self.order.faces.len() as u32;
        self.order.faces.push(first.0);
    }

    fn take_vertex(&mut self, vertex: Vertex) {
        self.new_vertices[vertex.index()] = self.order.vertices.len() as u32;
        self.order.vertices.push(vertex.0);
    }

    /// The node of the machine at whose wedge the face to come has its corner, where half-edge `out` leaves.
    fn node_at(&self, machine: &Machine, out: Halfedge) -> Option<u32> {
        let mesh = self.mesh;
        // Towards the faces before `out`, then towards those behind.
        let mut h = out;
        while let Some(twin) = mesh.topology().twin(h) {
            if self.is_visited(twin) {
                let before = machine.owners[self.new_halfedge(twin) as usize];
                return Some(machine.node(before).next);
            }
            h = twin.next();
        }
        h = out.previous();
        while let Some(twin) = mesh.topology().twin(h) {
            if self.is_visited(twin) {
                return Some(machine.owners[self.new_halfedge(twin) as usize]);
            }
            h = twin.previous();
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
        while self.is_visited(self.next_component.halfedge(0)) {
            self.next_component.0 += 1;
        }
        self.take_face(self.next_component.halfedge(0));
        for v in self.mesh.topology().face_vertices(self.next_component) {
            self.take_vertex(v);
        }
    }

    fn across(&mut self, machine: &Machine, gate: u32) -> Step {
        let (a, b) = (gate, machine.node(gate).next);
        let Some(twin) = self.mesh.topology().twin(self.old(machine.node(gate).halfedge)) else {
            return Step::Border;
        };
        let out = twin.previous();
        let vertex = self.mesh.topology().tail(out);
        if self.new_vertices[vertex.index()] == NOT_VISITED {
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
