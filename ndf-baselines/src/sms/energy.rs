//! The energy of a simplified mesh: how far its Laplacian is from that of the input on the functions to be kept.
//!
//! E = Σᵥ mᵥ |(P Z − M̃⁻¹ L̃ P F)ᵥ|², where F are functions on the input, Z = M⁻¹ L F, and P carries functions to the
//! simplified mesh. All is kept per vertex, and changes with the faces around it.

use ndf_core::DVec3;
use ndf_mesh::halfedge::NO_HALFEDGE;
use ndf_mesh::{Face, Halfedge, Vertex};
use ndf_meshing::EditableMesh;

/// A mesh that is being simplified, and the terms of its energy.
pub(crate) struct Energy {
    pub(crate) mesh: EditableMesh,
    /// Number of functions.
    modes: usize,
    /// P F, a row a vertex.
    functions: Vec<f64>,
    /// P Z.
    images: Vec<f64>,
    /// L̃ P F.
    laplacians: Vec<f64>,
    /// M̃, a third of the area around each vertex.
    masses: Vec<f64>,
    /// The term of each vertex.
    terms: Vec<f64>,
}

/// What a triangle gives to its corners: weights of the sides opposite them, and a third of its area.
struct Element {
    weights: [f64; 3],
    mass: f64,
}

impl Element {
    fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let twice_area = (b - a).cross(c - a).length();
        let half_cotangent = |p: DVec3, q: DVec3| 0.5 * p.dot(q) / twice_area;
        let weights =
            [half_cotangent(b - a, c - a), half_cotangent(c - b, a - b), half_cotangent(a - c, b - c)];
        Self { weights, mass: twice_area / 6.0 }
    }
}

/// The surroundings of an edge as they would be without the faces at its ends, and its faces that would stay.
pub(crate) struct Surroundings {
    ends: [Vertex; 2],
    ring: Vec<Vertex>,
    laplacians: Vec<f64>,
    masses: Vec<f64>,
    /// The terms of the ring and both ends.
    before: f64,
    /// The faces that stay: their corners, with the place in the ring of each or, for the merged vertex, that after it.
    faces: Vec<[usize; 3]>,
    /// The normals of those faces as they are, as long as twice their area.
    normals: Vec<DVec3>,
}

impl Energy {
    /// The input with `modes` functions and their images, each a row of so many values a vertex.
    pub(crate) fn new(mesh: EditableMesh, modes: usize, functions: Vec<f64>, images: Vec<f64>) -> Self {
        let vertices = mesh.vertex_count();
        let mut this = Self {
            mesh,
            modes,
            laplacians: vec![0.0; functions.len()],
            functions,
            images,
            masses: vec![0.0; vertices],
            terms: vec![0.0; vertices],
        };
        for face in this.mesh.faces() {
            let corners = this.mesh.face_vertices(face);
            let element = Element::new(corners.map(|v| this.mesh.position(v)));
            let rows = corners.map(Vertex::index);
            for v in rows {
                this.masses[v] += element.mass;
            }
            let k = this.modes;
            let functions = rows.map(|v| &this.functions[v * k..][..k]);
            add(&mut this.laplacians, rows, functions, &element, 1.0);
        }
        for v in 0..vertices {
            this.terms[v] = this.term(v, &this.laplacians, this.masses[v], this.row(&this.images, v));
        }
        this
    }

    /// The energy of the mesh as it is.
    pub(crate) fn total(&self) -> f64 {
        self.mesh.vertices().filter(|&v| !self.mesh.is_vertex_hole(v)).map(|v| self.terms[v.index()]).sum()
    }

    /// The energy of the mesh by a Laplacian assembled anew.
    #[cfg(test)]
    pub(crate) fn assembled_anew(&self) -> f64 {
        let k = self.modes;
        let mut laplacians = vec![0.0; self.functions.len()];
        let mut masses = vec![0.0; self.masses.len()];
        for face in self.mesh.faces().filter(|f| !self.mesh.is_hole(f.halfedge(0))) {
            let corners = self.mesh.face_vertices(face);
            let element = Element::new(corners.map(|v| self.mesh.position(v)));
            let rows = corners.map(Vertex::index);
            rows.iter().for_each(|&v| masses[v] += element.mass);
            add(&mut laplacians, rows, rows.map(|v| &self.functions[v * k..][..k]), &element, 1.0);
        }
        let vertices = self.mesh.vertices().filter(|&v| !self.mesh.is_vertex_hole(v)).map(Vertex::index);
        vertices.map(|v| self.term(v, &laplacians, masses[v], self.row(&self.images, v))).sum()
    }

    fn row<'a>(&self, values: &'a [f64], v: usize) -> &'a [f64] {
        &values[v * self.modes..][..self.modes]
    }

    fn term(&self, place: usize, laplacians: &[f64], mass: f64, image: &[f64]) -> f64 {
        let squares = self.row(laplacians, place).iter().zip(image).map(|(l, z)| (z - l / mass).powi(2));
        mass * squares.sum::<f64>()
    }

    /// What a collapse of the edge of `h` would change.
    pub(crate) fn surroundings(&self, h: Halfedge) -> Surroundings {
        let mesh = &self.mesh;
        let ends = [mesh.tail(h), mesh.tip(h)];
        let gone =
            [h, mesh.raw_twin(h)].map(|side| if side == NO_HALFEDGE { None } else { Some(side.face()) });
        let mut ring: Vec<Vertex> = Vec::with_capacity(16);
        for v in ends.into_iter().flat_map(|end| mesh.ring(end)) {
            if !ends.contains(&v) && !ring.contains(&v) {
                ring.push(v);
            }
        }
        let modes = self.modes;
        let mut laplacians = Vec::with_capacity((ring.len() + 1) * modes);
        ring.iter().for_each(|v| laplacians.extend_from_slice(self.row(&self.laplacians, v.index())));
        laplacians.extend(std::iter::repeat_n(0.0, modes));
        let mut masses: Vec<f64> = ring.iter().map(|v| self.masses[v.index()]).collect();
        masses.push(0.0);
        let before = ring.iter().chain(&ends).map(|v| self.terms[v.index()]).sum();
        let mut faces = Vec::with_capacity(ring.len());
        let mut normals = Vec::with_capacity(ring.len());
        let place = |v: Vertex| ring.iter().position(|&w| w == v).unwrap_or(ring.len());
        // Faces around the tail, then those around the tip that are not met yet.
        let around = |end: Vertex| mesh.outgoing(end).map(Halfedge::face);
        let second = around(ends[1]).filter(|f| !gone.contains(&Some(*f)));
        for face in around(ends[0]).chain(second).collect::<Vec<Face>>() {
            let corners = mesh.face_vertices(face);
            let positions = corners.map(|v| mesh.position(v));
            let element = Element::new(positions);
            let functions = corners.map(|v| self.row(&self.functions, v.index()));
            let places = corners.map(place);
            // What is taken from the merged vertex's place is put right below.
            add(&mut laplacians, places, functions, &element, -1.0);
            for p in places {
                masses[p] -= element.mass;
            }
            if !gone.contains(&Some(face)) {
                faces.push(places);
                normals.push((positions[1] - positions[0]).cross(positions[2] - positions[0]));
            }
        }
        laplacians[ring.len() * modes..].fill(0.0);
        masses[ring.len()] = 0.0;
        Surroundings { ends, ring, laplacians, masses, before, faces, normals }
    }

    /// The place between the ends of an edge, 0 at the tail and 1 at the tip.
    pub(crate) fn placed(&self, ends: [Vertex; 2], share: f64) -> DVec3 {
        self.mesh.position(ends[0]).lerp(self.mesh.position(ends[1]), share)
    }

    fn mixed(&self, values: &[f64], ends: [Vertex; 2], share: f64) -> Vec<f64> {
        let [a, b] = ends.map(|v| self.row(values, v.index()));
        a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect()
    }

    /// The surroundings after a collapse to a place, their Laplacians and masses; none if a face would turn over or lose
    /// its area.
    fn collapsed(&self, around: &Surroundings, share: f64) -> Option<(Vec<f64>, Vec<f64>)> {
        let merged = self.placed(around.ends, share);
        let function = self.mixed(&self.functions, around.ends, share);
        let mut laplacians = around.laplacians.clone();
        let mut masses = around.masses.clone();
        for (&places, &old) in around.faces.iter().zip(&around.normals) {
            let vertex = |p: usize| around.ring.get(p);
            let corners = places.map(|p| vertex(p).map_or(merged, |&v| self.mesh.position(v)));
            let new = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            if !keeps_side(old, new) {
                return None;
            }
            let element = Element::new(corners);
            let functions = places
                .map(|p| vertex(p).map_or(function.as_slice(), |v| self.row(&self.functions, v.index())));
            add(&mut laplacians, places, functions, &element, 1.0);
            for p in places {
                masses[p] += element.mass;
            }
        }
        Some((laplacians, masses))
    }

    /// The change of the energy by a collapse to a place; infinite if a face would turn over.
    pub(crate) fn cost(&self, around: &Surroundings, share: f64) -> f64 {
        let Some((laplacians, masses)) = self.collapsed(around, share) else { return f64::INFINITY };
        let merged = self.mixed(&self.images, around.ends, share);
        let images = around.ring.iter().map(|v| self.row(&self.images, v.index()));
        let images = images.chain(std::iter::once(merged.as_slice()));
        let after: f64 =
            images.enumerate().map(|(p, image)| self.term(p, &laplacians, masses[p], image)).sum();
        let cost = after - around.before;
        if cost.is_finite() { cost } else { f64::INFINITY }
    }

    /// Collapses the edge of `h` into its tail, at a place at which it may be. Returns the vertices around it.
    pub(crate) fn collapse_at(&mut self, h: Halfedge, share: f64) -> Option<Vec<Vertex>> {
        let around = self.surroundings(h);
        let (laplacians, masses) = self.collapsed(&around, share)?;
        let (k, tail) = (self.modes, around.ends[0]);
        let [function, image] =
            [&self.functions, &self.images].map(|values| self.mixed(values, around.ends, share));
        self.functions[tail.index() * k..][..k].copy_from_slice(&function);
        self.images[tail.index() * k..][..k].copy_from_slice(&image);
        let position = self.placed(around.ends, share);
        self.mesh.collapse(h, position);
        for (p, v) in around.ring.iter().chain([&tail]).map(|v| v.index()).enumerate() {
            self.laplacians[v * k..][..k].copy_from_slice(&laplacians[p * k..][..k]);
            self.masses[v] = masses[p];
            self.terms[v] = self.term(v, &self.laplacians, masses[p], self.row(&self.images, v));
        }
        Some(around.ring)
    }
}

/// A face may turn by the angle with this cosine in one collapse.
const TURN: f64 = 0.2;

fn keeps_side(old: DVec3, new: DVec3) -> bool {
    let dot = old.dot(new);
    old == DVec3::ZERO || (dot > 0.0 && dot * dot > TURN * TURN * old.length_squared() * new.length_squared())
}

/// Adds what a triangle gives to the Laplacians in the rows of its corners.
fn add(laplacians: &mut [f64], rows: [usize; 3], functions: [&[f64]; 3], element: &Element, sign: f64) {
    let modes = functions[0].len();
    for opposite in 0..3 {
        let [a, b] = [(opposite + 1) % 3, (opposite + 2) % 3];
        let weight = sign * element.weights[opposite];
        for k in 0..modes {
            let flow = weight * (functions[a][k] - functions[b][k]);
            laplacians[rows[a] * modes + k] += flow;
            laplacians[rows[b] * modes + k] -= flow;
        }
    }
}
