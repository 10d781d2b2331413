//! Connectivity of a manifold mesh in one or two bits a vertex: the mesh is conquered face by face, and at every step
//! the coder says what lies across the *gate*, an edge between conquered faces and those to come.
//!
//! This is the cut-border machine of Gumhold & Straßer (1998) with the order of Touma & Gotsman (1998): faces around
//! one vertex, the *pivot*, are conquered before its neighbour's. Whether a face closes the fan around the pivot is
//! coded in the light of how many faces it has already, which costs as much as coding the valences of the vertices.
//! What needs offsets, fronts that meet themselves (genus 0: a few, by chance) or one another (handles), is rare in this
//! order. Edges of the boundary are told when they become gates.
//!
//! Encoder and decoder are one machine; only where it takes its steps from differs.

use super::range_coder::{Bit, Coder, Integers};
use crate::ManifoldMesh;
use crate::mesh::NO_HALFEDGE;

/// More faces than any base mesh has; so much may be allocated before a hostile file is found out.
const MOST_FACES: usize = 1 << 21;

/// Steps along fronts a face. A mesh of n faces meets itself rarely and has fronts of some √n edges; a hostile file must
/// not send the machine around and around.
const STEPS_PER_FACE: usize = 1024;

/// What lies across the gate from node `a` to node `b`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// A face with a vertex not seen before.
    New,
    /// A face with the edge behind b: b is surrounded.
    CloseAhead,
    /// A face with the edge before a: a is surrounded.
    CloseBehind,
    /// Nothing: the gate lies on the boundary.
    Border,
    /// A face with another vertex of the same front: the node so many edges behind b, or, negative, before a.
    Split(i32),
    /// A face with a vertex of another front: which, counted from the last one put aside, and how many edges from its
    /// first node.
    Merge(i32, i32),
}

/// A vertex on a front: where conquered faces, on the left, meet those to come. A vertex may be several nodes.
#[derive(Clone, Copy)]
struct Node {
    vertex: u32,
    next: u32,
    previous: u32,
    /// The conquered half-edge to the next node.
    halfedge: u32,
    /// Whether that lies on the boundary.
    is_border: bool,
}

/// Why a stream is not the connectivity of a mesh.
pub(super) type Defect = &'static str;

/// Where the machine learns its steps from.
trait Guide {
    /// What lies across the gate that begins at this node; anything, where that is to be read.
    fn across(&mut self, machine: &Machine, gate: u32) -> Step;

    /// The first face of a component is about to be conquered.
    fn begin(&mut self);
}

/// Fronts and what is conquered.
struct Machine {
    nodes: Vec<Node>,
    /// A node of every front that waits.
    waiting: Vec<u32>,
    faces: Vec<[u32; 3]>,
    /// Faces around every vertex, as conquered so far.
    degrees: Vec<u32>,
    /// Node that holds a half-edge on a front.
    owners: Vec<u32>,
    steps: usize,
}

/// Degrees of the pivot that are told apart.
const DEGREES: usize = 16;

/// The probabilities, by whether the gate leads to the pivot and by its degree.
struct Models {
    is_new: [[Bit; DEGREES]; 2],
    is_ahead: [[Bit; DEGREES]; 2],
    is_behind: [[Bit; DEGREES]; 2],
    is_border: [[Bit; DEGREES]; 2],
    is_split: Bit,
    offset: Integers,
    front: Integers,
}

impl Models {
    fn new() -> Self {
        let fresh = [[Bit::NEW; DEGREES]; 2];
        Self {
            is_new: fresh,
            is_ahead: fresh,
            is_behind: fresh,
            is_border: fresh,
            is_split: Bit::NEW,
            offset: Integers::new(),
            front: Integers::new(),
        }
    }

    fn code(&mut self, coder: &mut impl Coder, to_pivot: bool, degree: u32, step: Step) -> Step {
        let (side, degree) = (usize::from(to_pivot), (degree as usize).min(DEGREES - 1));
        let mut ask =
            |models: &mut [[Bit; DEGREES]; 2], is: Step| coder.bit(&mut models[side][degree], step == is);
        if ask(&mut self.is_new, Step::New) {
            Step::New
        } else if ask(&mut self.is_ahead, Step::CloseAhead) {
            Step::CloseAhead
        } else if ask(&mut self.is_border, Step::Border) {
            Step::Border
        } else if ask(&mut self.is_behind, Step::CloseBehind) {
            Step::CloseBehind
        } else {
            let (front, offset) = match step {
                Step::Merge(front, offset) => (Some(front), offset),
                Step::Split(offset) => (None, offset),
                _ => (None, 0),
            };
            if coder.bit(&mut self.is_split, front.is_none()) {
                Step::Split(self.offset.code(coder, offset))
            } else {
                let front = self.front.code(coder, front.unwrap_or_default());
                Step::Merge(front, self.offset.code(coder, offset))
            }
        }
    }
}

impl Machine {
    fn new() -> Self {
        Self {
            nodes: Vec::new(),
            waiting: Vec::new(),
            faces: Vec::new(),
            degrees: Vec::new(),
            owners: Vec::new(),
            steps: 0,
        }
    }

    fn node(&self, node: u32) -> Node {
        self.nodes[node as usize]
    }

    /// Conquers all of a mesh of `face_count` faces.
    fn run(
        &mut self,
        coder: &mut impl Coder,
        guide: &mut impl Guide,
        face_count: usize,
    ) -> Result<(), Defect> {
        let mut models = Models::new();
        while self.faces.len() < face_count {
            guide.begin();
            let first = self.begin();
            self.waiting.push(first);
            while let Some(pivot) = self.waiting.pop() {
                self.conquer(pivot, coder, guide, &mut models, face_count)?;
            }
        }
        Ok(())
    }

    /// The first face of a component; returns a node of the front around it.
    fn begin(&mut self) -> u32 {
        let [a, b, c] = [0; 3].map(|_| self.new_vertex());
        let first = self.nodes.len() as u32;
        let halfedge = self.add_face([a, b, c]);
        for (i, vertex) in (0..).zip([a, b, c]) {
            let (next, previous) = (first + (i + 1) % 3, first + (i + 2) % 3);
            self.nodes.push(Node { vertex, next, previous, halfedge: 0, is_border: false });
            self.hold(first + i, halfedge + i);
        }
        first
    }

    fn new_vertex(&mut self) -> u32 {
        self.degrees.push(0);
        self.degrees.len() as u32 - 1
    }

    /// Returns its first half-edge.
    fn add_face(&mut self, face: [u32; 3]) -> u32 {
        face.iter().for_each(|&v| self.degrees[v as usize] += 1);
        self.owners.extend([NO_HALFEDGE; 3]);
        self.faces.push(face);
        3 * (self.faces.len() as u32 - 1)
    }

    fn hold(&mut self, node: u32, halfedge: u32) {
        self.nodes[node as usize].halfedge = halfedge;
        self.nodes[node as usize].is_border = false;
        self.owners[halfedge as usize] = node;
    }

    fn join(&mut self, a: u32, b: u32) {
        self.nodes[a as usize].next = b;
        self.nodes[b as usize].previous = a;
    }

    /// Counts a step along a front.
    fn step(&mut self) -> Result<(), Defect> {
        self.steps += 1;
        let most = STEPS_PER_FACE * (self.faces.len() + 1024);
        if self.steps > most { Err("the fronts of its faces are absurdly long") } else { Ok(()) }
    }

    /// Takes the front of this node as far as it goes; what is split off waits.
    fn conquer(
        &mut self,
        mut pivot: u32,
        coder: &mut impl Coder,
        guide: &mut impl Guide,
        models: &mut Models,
        face_count: usize,
    ) -> Result<(), Defect> {
        while let Some((gate, to_pivot)) = self.gate(&mut pivot)? {
            let degree = self.degrees[self.node(pivot).vertex as usize];
            let known = guide.across(self, gate);
            let step = models.code(coder, to_pivot, degree, known);
            if coder.is_exhausted() {
                return Err("it ends too early");
            }
            if step == Step::Border {
                self.nodes[gate as usize].is_border = true;
                continue;
            }
            if self.faces.len() == face_count {
                return Err("it has more faces than it says");
            }
            let (a, b) = (gate, self.node(gate).next);
            match step {
                Step::CloseAhead => {
                    let c = self.node(b).next;
                    if self.node(b).is_border || c == a {
                        return Err("a face is closed where there is nothing to close");
                    }
                    let halfedge = self.face_at(a, c);
                    if self.node(c).next == a {
                        if self.node(c).is_border {
                            return Err("a face is closed over the boundary");
                        }
                        return Ok(());
                    }
                    self.join(a, c);
                    self.hold(a, halfedge + 1);
                    if to_pivot {
                        pivot = c;
                    }
                }
                Step::CloseBehind => {
                    let c = self.node(a).previous;
                    // A front of three is closed ahead.
                    if self.node(c).is_border || self.node(c).previous == b || c == b {
                        return Err("a face is closed where there is nothing to close");
                    }
                    let halfedge = self.face_at(a, c);
                    self.join(c, b);
                    self.hold(c, halfedge + 2);
                    if !to_pivot {
                        pivot = c;
                    }
                }
                Step::New => {
                    let vertex = self.new_vertex();
                    let node = self.add_node(vertex);
                    let halfedge = self.face_at(a, node);
                    self.join(a, node);
                    self.join(node, b);
                    self.hold(a, halfedge + 1);
                    self.hold(node, halfedge + 2);
                }
                Step::Split(offset) => {
                    let s = self.along_front(a, b, offset)?;
                    self.attach(a, b, s);
                    self.waiting.push(if to_pivot { a } else { b });
                }
                Step::Merge(front, offset) => {
                    let at = usize::try_from(front).ok().filter(|&front| front < self.waiting.len());
                    let at = at.ok_or("fronts meet of which one is not there")?;
                    let mut s = self.waiting.remove(self.waiting.len() - 1 - at);
                    for _ in 0..offset {
                        self.step()?;
                        s = self.node(s).next;
                    }
                    self.attach(a, b, s);
                }
                Step::Border => unreachable!("handled above"),
            }
        }
        Ok(())
    }

    /// The next gate of a front, as the node it begins at, and whether it leads to the pivot. The pivot moves on where
    /// the boundary is on both sides of it. `None` when the front is all boundary.
    fn gate(&mut self, pivot: &mut u32) -> Result<Option<(u32, bool)>, Defect> {
        let first = *pivot;
        loop {
            let previous = self.node(*pivot).previous;
            if !self.node(previous).is_border {
                return Ok(Some((previous, true)));
            }
            if !self.node(*pivot).is_border {
                return Ok(Some((*pivot, false)));
            }
            *pivot = self.node(*pivot).next;
            if *pivot == first {
                return Ok(None);
            }
            self.step()?;
        }
    }

    fn add_node(&mut self, vertex: u32) -> u32 {
        self.nodes.push(Node { vertex, next: 0, previous: 0, halfedge: 0, is_border: false });
        self.nodes.len() as u32 - 1
    }

    /// Adds the face across the gate from a, with the vertex of node c. Its half-edges: along the gate, from a to c, from
    /// c to b.
    fn face_at(&mut self, a: u32, c: u32) -> u32 {
        let b = self.node(a).next;
        self.add_face([b, a, c].map(|node| self.node(node).vertex))
    }

    /// Adds the face across the gate from a to b with node s, which is cut in two: what was one front is then two, or the
    /// other way about.
    fn attach(&mut self, a: u32, b: u32, s: u32) {
        let halfedge = self.face_at(a, s);
        let before = self.node(s).previous;
        let end = self.add_node(self.node(s).vertex);
        self.join(before, end);
        self.join(end, b);
        self.join(a, s);
        self.hold(a, halfedge + 1);
        self.hold(end, halfedge + 2);
    }

    /// The node `offset` edges behind b, or before a; neither of these themselves.
    fn along_front(&mut self, a: u32, b: u32, offset: i32) -> Result<u32, Defect> {
        let mut s = if offset > 0 { b } else { a };
        for _ in 0..offset.unsigned_abs() {
            self.step()?;
            s = if offset > 0 { self.node(s).next } else { self.node(s).previous };
            if s == a || s == b {
                return Err("a front meets itself where it is not");
            }
        }
        if s == a || s == b { Err("a front meets itself where it is not") } else { Ok(s) }
    }
}

/// A mesh whose connectivity is written.
struct Writing<'a> {
    mesh: &'a ManifoldMesh,
    order: Order,
    /// Of every face of the mesh, the half-edge in its own numbering that became the first of the new face; and that
    /// face. [`NO_HALFEDGE`] before it is conquered.
    new_faces: Vec<u32>,
    new_vertices: Vec<u32>,
    next_component: u32,
}

/// In which order the machine came by the parts of a mesh.
pub(super) struct Order {
    /// The half-edge of the mesh that became the first of every face.
    pub(super) faces: Vec<u32>,
    /// The vertex of the mesh that became every vertex.
    pub(super) vertices: Vec<u32>,
}

impl<'a> Writing<'a> {
    fn new(mesh: &'a ManifoldMesh) -> Self {
        Self {
            mesh,
            order: Order { faces: Vec::new(), vertices: Vec::new() },
            new_faces: vec![NO_HALFEDGE; mesh.face_count()],
            new_vertices: vec![NO_HALFEDGE; mesh.vertex_count()],
            next_component: 0,
        }
    }

    fn is_conquered(&self, halfedge: u32) -> bool {
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
        while let Some(twin) = mesh.twin(h) {
            if self.is_conquered(twin) {
                let before = machine.owners[self.new_halfedge(twin) as usize];
                return Some(machine.node(before).next);
            }
            h = mesh.next(twin);
        }
        h = mesh.previous(out);
        while let Some(twin) = mesh.twin(h) {
            if self.is_conquered(twin) {
                return Some(machine.owners[self.new_halfedge(twin) as usize]);
            }
            h = mesh.previous(twin);
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
        while self.is_conquered(3 * self.next_component) {
            self.next_component += 1;
        }
        self.take_face(3 * self.next_component);
        for v in self.mesh.faces()[self.next_component as usize] {
            self.take_vertex(v);
        }
    }

    fn across(&mut self, machine: &Machine, gate: u32) -> Step {
        let (a, b) = (gate, machine.node(gate).next);
        let Some(twin) = self.mesh.twin(self.old(machine.node(gate).halfedge)) else { return Step::Border };
        let out = self.mesh.previous(twin);
        let vertex = self.mesh.tail(out);
        if self.new_vertices[vertex as usize] == NO_HALFEDGE {
            self.take_face(twin);
            self.take_vertex(vertex);
            return Step::New;
        }
        let s = self.node_at(machine, out).expect("a vertex that was seen has a conquered face");
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

/// Steps are read; there is nothing to know.
struct Reading;

impl Guide for Reading {
    fn begin(&mut self) {}

    fn across(&mut self, _: &Machine, _: u32) -> Step {
        Step::Border
    }
}

/// Writes the connectivity of a mesh; the order in which it will be read. `None` for meshes beyond what will be read.
///
/// Deterministic, and the order of what has been read is the identity.
pub(super) fn encode(coder: &mut impl Coder, mesh: &ManifoldMesh) -> Option<Order> {
    if mesh.face_count() > MOST_FACES {
        return None;
    }
    let mut writing = Writing::new(mesh);
    Machine::new().run(coder, &mut writing, mesh.face_count()).ok()?;
    Some(writing.order)
}

/// Faces of a mesh of `face_count` faces, and how many vertices it has. Whether it is a manifold is still to be seen.
///
/// # Errors
/// If the stream ends early or does not make sense. O(faces) memory, of the faces that are really there.
pub(super) fn decode(coder: &mut impl Coder, face_count: usize) -> Result<(Vec<[u32; 3]>, usize), Defect> {
    if face_count > MOST_FACES {
        return Err("it has absurdly many faces");
    }
    let mut machine = Machine::new();
    machine.run(coder, &mut Reading, face_count)?;
    Ok((machine.faces, machine.degrees.len()))
}

#[cfg(test)]
mod tests {
    use super::super::range_coder::{Decoder, Encoder};
    use super::*;
    use crate::TriangleMesh;
    use crate::mesh::shapes;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    /// The mesh's faces in the order and with the vertices of what was read.
    fn round_trip(mesh: &ManifoldMesh) -> (usize, Order, Vec<[u32; 3]>) {
        let mut encoder = Encoder::new();
        let order = encode(&mut encoder, mesh).unwrap();
        let bytes = encoder.finish();
        let mut decoder = Decoder::new(&bytes);
        let (faces, vertices) = decode(&mut decoder, mesh.face_count()).unwrap();
        assert_eq!(vertices, mesh.vertex_count());
        for (face, &first) in faces.iter().zip(&order.faces) {
            let corners = [first, mesh.next(first), mesh.previous(first)].map(|h| mesh.tail(h));
            assert_eq!(face.map(|v| order.vertices[v as usize]), corners);
        }
        (bytes.len(), order, faces)
    }

    fn check(mesh: TriangleMesh, what: &str) -> f64 {
        let mesh = ManifoldMesh::try_from(mesh).unwrap();
        let (bytes, order, faces) = round_trip(&mesh);
        let mut seen = order.vertices.clone();
        seen.sort_unstable();
        assert!(seen.iter().copied().eq(0..mesh.vertex_count() as u32), "{what}");
        // Reading gives the order that is written again.
        let positions = order.vertices.iter().map(|&v| mesh.positions()[v as usize]).collect();
        let read = ManifoldMesh::try_from(TriangleMesh::new(positions, faces.clone()).unwrap()).unwrap();
        let (_, again, faces_again) = round_trip(&read);
        assert!(again.vertices.iter().copied().eq(0..mesh.vertex_count() as u32), "{what}");
        assert!(again.faces.iter().copied().eq((0..mesh.face_count() as u32).map(|f| 3 * f)), "{what}");
        assert_eq!(faces_again, faces, "{what}");
        8.0 * bytes as f64 / mesh.vertex_count() as f64
    }

    /// What is left of a mesh without some of its faces, where that is a manifold.
    fn without(mesh: &TriangleMesh, share: f64, rng: &mut ChaCha8Rng) -> Option<TriangleMesh> {
        let faces: Vec<[u32; 3]> = mesh.faces().iter().copied().filter(|_| !rng.random_bool(share)).collect();
        let mut used: Vec<u32> = faces.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let index = |v: u32| used.binary_search(&v).unwrap() as u32;
        let positions = used.iter().map(|&v| mesh.positions()[v as usize]).collect();
        let faces: Vec<[u32; 3]> = faces.into_iter().map(|f| f.map(index)).collect();
        let left = TriangleMesh::new(positions, faces).unwrap();
        ManifoldMesh::try_from(left.clone()).is_ok().then_some(left)
    }

    fn shifted(mesh: &TriangleMesh, faces: &mut Vec<[u32; 3]>, positions: &mut Vec<glam::DVec3>) {
        let offset = positions.len() as u32;
        positions.extend(mesh.positions());
        faces.extend(mesh.faces().iter().map(|f| f.map(|v| v + offset)));
    }

    #[test]
    fn closed_bounded_and_many_handled_surfaces_come_back() {
        let one = TriangleMesh::new(vec![glam::DVec3::ZERO, glam::DVec3::X, glam::DVec3::Y], vec![[0, 1, 2]]);
        check(one.unwrap(), "one face");
        for level in 0..4 {
            check(shapes::icosphere(level), "sphere");
        }
        check(shapes::torus(7, 5, 1.0, 0.3), "torus");
        check(shapes::torus(60, 30, 1.0, 0.3), "torus");
        check(shapes::trefoil_knot(200, 12, 0.1), "knot");
        check(shapes::grid(1, 1), "grid");
        check(shapes::grid(20, 13), "grid");
        check(shapes::cube(5), "cube");
        let (mut faces, mut positions) = (Vec::new(), Vec::new());
        for mesh in [shapes::icosphere(1), shapes::grid(3, 4), shapes::torus(5, 4, 1.0, 0.2)] {
            shifted(&mesh, &mut faces, &mut positions);
        }
        check(TriangleMesh::new(positions, faces).unwrap(), "three components");
    }

    /// Fronts that meet themselves and one another around holes of all kinds.
    #[test]
    fn surfaces_with_random_holes_come_back() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let wholes = [shapes::icosphere(2), shapes::torus(16, 9, 1.0, 0.3), shapes::grid(12, 12)];
        let mut tried = 0;
        while tried < 300 {
            let whole = &wholes[rng.random_range(0..wholes.len())];
            let share = rng.random_range(0.001..0.12);
            if let Some(mesh) = without(whole, share, &mut rng) {
                check(mesh, "holes");
                tried += 1;
            }
        }
    }

    /// Vertices and faces in random order, corners turned: the size is the same within the first face's freedom.
    #[test]
    fn a_regular_mesh_costs_less_than_two_bits_a_vertex() {
        let (torus, sphere) =
            (check(shapes::torus(80, 40, 1.0, 0.3), "torus"), check(shapes::icosphere(4), "sphere"));
        assert!(torus < 1.0 && sphere < 1.0, "{torus} {sphere}");
    }

    #[test]
    fn random_bytes_give_faces_or_an_error() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut encoder = Encoder::new();
        let mesh = ManifoldMesh::try_from(shapes::torus(30, 20, 1.0, 0.3)).unwrap();
        encode(&mut encoder, &mesh).unwrap();
        let good = encoder.finish();
        for round in 0..2000 {
            let mut bytes = good.clone();
            if round % 2 == 0 {
                bytes.iter_mut().for_each(|b| *b = rng.random());
            } else {
                let at = rng.random_range(0..bytes.len());
                bytes[at] = rng.random();
            }
            let faces = rng.random_range(0..3000);
            if let Ok((faces, vertices)) = decode(&mut Decoder::new(&bytes), faces) {
                assert!(faces.iter().flatten().all(|&v| (v as usize) < vertices));
            }
        }
        assert!(decode(&mut Decoder::new(&[]), usize::MAX).is_err());
    }
}
