//! The machine: fronts, and what is visited.

use super::super::range_coder::{Bit, Coder, Integers};

/// Steps along fronts a face. A mesh of n faces meets itself rarely and has fronts of some √n edges; a hostile file must
/// not send the machine around and around.
const STEPS_PER_FACE: usize = 1024;

/// Stands for the node of a half-edge that no front holds.
const NO_NODE: u32 = u32::MAX;

/// What lies across the gate from node `a` to node `b`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
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

/// A vertex on a front: where visited faces, on the left, meet those to come. A vertex may be several nodes.
#[derive(Clone, Copy)]
pub(super) struct Node {
    pub(super) vertex: u32,
    pub(super) next: u32,
    pub(super) previous: u32,
    /// The visited half-edge to the next node.
    pub(super) halfedge: u32,
    /// Whether that lies on the boundary.
    is_border: bool,
}

/// Why a stream is not the connectivity of a mesh.
pub(super) type Defect = &'static str;

/// Where the machine learns its steps from.
pub(super) trait Guide {
    /// What lies across the gate that begins at this node; anything, where that is to be read.
    fn across(&mut self, machine: &Machine, gate: u32) -> Step;

    /// The first face of a component is about to be visited.
    fn begin(&mut self);
}

/// Fronts and what is visited.
pub(super) struct Machine {
    nodes: Vec<Node>,
    /// A node of every front that waits.
    pub(super) waiting: Vec<u32>,
    pub(super) faces: Vec<[u32; 3]>,
    /// Faces around every vertex, as visited so far.
    pub(super) degrees: Vec<u32>,
    /// Node that holds a half-edge on a front.
    pub(super) owners: Vec<u32>,
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
    pub(super) fn new() -> Self {
        Self {
            nodes: Vec::new(),
            waiting: Vec::new(),
            faces: Vec::new(),
            degrees: Vec::new(),
            owners: Vec::new(),
            steps: 0,
        }
    }

    pub(super) fn node(&self, node: u32) -> Node {
        self.nodes[node as usize]
    }

    /// Conquers all of a mesh of `face_count` faces.
    pub(super) fn run(
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
        self.owners.extend([NO_NODE; 3]);
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
        if self.steps > most { Err("the fronts of its faces are too long") } else { Ok(()) }
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
                    let at = at.ok_or("two fronts meet, but one of them does not exist")?;
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
                return Err("a front meets itself at a node that it does not have");
            }
        }
        if s == a || s == b { Err("a front meets itself at a node that it does not have") } else { Ok(s) }
    }
}
