//! The coarse mesh: edges are collapsed at the cost of quadrics divided by the visibility of the new vertex, the aspect of
//! its faces and how well their normals go with those of the input.

use ndf_core::{Cancelled, DVec3, Progress};
use ndf_mesh::{Halfedge, ManifoldMesh};
use ndf_meshing::triangle_shape::{agree, cross, quality};
use ndf_meshing::{EditableMesh, Quadric};

use super::directions::max_min_visibility;
use crate::greedy::{Collapses, Greedy};

/// Exponents of visibility, aspect and correlation of normals.
const POWERS: [f64; 3] = [0.5, 0.5, 0.1];
/// None of the three may become less, unless it is no less than before: the slivers of isosurfaces would stay for ever.
const LEAST: f64 = 0.02;
/// What each counts at least in the cost.
const FLOOR: f64 = 1e-3;
/// Weight of the planes that hold the boundary, relative to those of the faces.
const BOUNDARY: f64 = 10.0;
/// Share of the sum of the planes that pulls a vertex to the middle of its edge where they leave it free.
const SOFTNESS: f64 = 1e-5;
/// What a collapse costs where the surface is flat: this times area and squared length.
const LENGTH_COST: f64 = 1e-5;
/// Rounds of the search for a direction.
const ROUNDS: u32 = 24;
/// A face may turn by the angle with this cosine in one collapse.
const TURN: f64 = 0.2;

/// A mesh decimated to so many faces, or as few as can be.
pub(crate) fn decimated(
    mesh: &ManifoldMesh,
    faces: usize,
    progress: &dyn Progress,
) -> Result<ManifoldMesh, Cancelled> {
    let mut greedy = Greedy::new(Decimation::new(mesh));
    greedy.run(faces, "coarse mesh", progress)?;
    Ok(greedy.state.mesh.into_manifold())
}

struct Decimation {
    mesh: EditableMesh,
    quadrics: Vec<Quadric>,
    /// Sums over the faces of the input that went into each vertex of their normals times a third of their area.
    normals: Vec<DVec3>,
    areas: Vec<f64>,
}

/// Faces around a vertex.
struct Faces {
    normals: Vec<DVec3>,
    aspect: f64,
    correlation: f64,
}

impl Default for Faces {
    fn default() -> Self {
        Self { normals: Vec::with_capacity(16), aspect: 1.0, correlation: 1.0 }
    }
}

impl Faces {
    /// Adds a face, given with the normals of the input at its corners.
    fn add(&mut self, corners: [DVec3; 3], of_input: [DVec3; 3]) {
        let normal = cross(corners).normalize_or_zero();
        self.correlation = of_input.into_iter().map(|n| n.dot(normal)).fold(self.correlation, f64::min);
        self.aspect = self.aspect.min(quality(corners));
        self.normals.push(normal);
    }

    /// Visibility of the vertex, aspect, and correlation of normals.
    fn parts(&self) -> [f64; 3] {
        [max_min_visibility(&self.normals, ROUNDS).1, self.aspect, self.correlation]
    }
}

impl Decimation {
    fn new(mesh: &ManifoldMesh) -> Self {
        let vertices = mesh.vertex_count();
        let mut this = Self {
            mesh: EditableMesh::new(mesh),
            quadrics: vec![Quadric::default(); vertices],
            normals: vec![DVec3::ZERO; vertices],
            areas: vec![0.0; vertices],
        };
        for face in mesh.face_indices() {
            let third = mesh.face_cross(face) / 6.0;
            let (area, normal) = (third.length(), third.normalize_or_zero());
            for v in mesh.topology().face_vertices(face) {
                this.quadrics[v.index()] += Quadric::plane(this.mesh.position(v), normal, area);
                this.normals[v.index()] += third;
                this.areas[v.index()] += area;
            }
            for h in face.halfedges().into_iter().filter(|&h| mesh.topology().twin(h).is_none()) {
                let ends = [this.mesh.tail(h), this.mesh.tip(h)];
                let [p, q] = ends.map(|v| this.mesh.position(v));
                let wall = (q - p).cross(normal).normalize_or_zero();
                let quadric = Quadric::plane(p, wall, BOUNDARY * p.distance_squared(q));
                ends.iter().for_each(|v| this.quadrics[v.index()] += quadric);
            }
        }
        this
    }

    /// How well the faces around a collapsed edge could be displaced, as the divisor of its cost; none if a face turned
    /// over or lost its shape.
    fn fitness(&self, h: Halfedge, place: DVec3) -> Option<f64> {
        let mesh = &self.mesh;
        let ends = [mesh.tail(h), mesh.tip(h)];
        let gone = [h, mesh.raw_twin(h)].map(Halfedge::face);
        let merged = ends.map(|v| self.normals[v.index()]).into_iter().sum::<DVec3>().normalize_or_zero();
        let [mut before, mut after] = [Faces::default(), Faces::default()];
        for v in ends {
            for o in mesh.outgoing(v).filter(|o| !gone.contains(&o.face())) {
                let others = [mesh.tip(o), mesh.tail(o.previous())];
                let [x, y] = others.map(|w| mesh.position(w));
                let (old, new) = ([mesh.position(v), x, y], [place, x, y]);
                if cross(old) != DVec3::ZERO && !agree(cross(old), cross(new), TURN) {
                    return None;
                }
                let [x, y] = others.map(|w| self.normals[w.index()].normalize_or_zero());
                before.add(old, [x, y, self.normals[v.index()].normalize_or_zero()]);
                after.add(new, [x, y, merged]);
            }
        }
        let parts = after.parts();
        let is_fit = parts.iter().all(|&part| part >= LEAST)
            || parts.iter().zip(before.parts()).all(|(&part, before)| part >= before.min(LEAST));
        is_fit.then(|| parts.iter().zip(POWERS).map(|(part, power)| part.max(FLOOR).powf(power)).product())
    }

    /// Where the merged vertex goes.
    fn place(&self, h: Halfedge) -> DVec3 {
        let mesh = &self.mesh;
        let (a, b) = (mesh.tail(h), mesh.tip(h));
        let (p, q) = (mesh.position(a), mesh.position(b));
        match [a, b].map(|v| mesh.is_boundary_vertex(v)) {
            [true, false] => p,
            [false, true] => q,
            _ => {
                let quadric = self.quadrics[a.index()] + self.quadrics[b.index()];
                let middle = p.midpoint(q);
                let best = quadric.minimiser(middle, SOFTNESS, 3);
                best.filter(|x| x.distance_squared(middle) <= 4.0 * p.distance_squared(q)).unwrap_or(middle)
            }
        }
    }
}

impl Collapses for Decimation {
    type Place = DVec3;

    fn mesh(&self) -> &EditableMesh {
        &self.mesh
    }

    fn cheapest(&self, h: Halfedge) -> Option<(f64, DVec3)> {
        let [a, b] = [self.mesh.tail(h), self.mesh.tip(h)];
        let place = self.place(h);
        let fitness = self.fitness(h, place)?;
        let quadric = self.quadrics[a.index()] + self.quadrics[b.index()];
        let area = self.areas[a.index()] + self.areas[b.index()];
        let length_squared = self.mesh.position(a).distance_squared(self.mesh.position(b));
        let cost = (quadric.at(place) + LENGTH_COST * area * length_squared) / fitness;
        cost.is_finite().then_some((cost, place))
    }

    fn collapse(&mut self, h: Halfedge, place: DVec3) -> Option<Vec<Halfedge>> {
        self.fitness(h, place)?;
        let [a, b] = [self.mesh.tail(h), self.mesh.tip(h)];
        self.mesh.collapse(h, place);
        let merged = self.quadrics[b.index()];
        self.quadrics[a.index()] += merged;
        self.normals[a.index()] = self.normals[a.index()] + self.normals[b.index()];
        self.areas[a.index()] += self.areas[b.index()];
        Some(self.mesh.edges_at(a).collect())
    }
}
