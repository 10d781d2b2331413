//! Decimation by quadric error metrics (Garland and Heckbert 1997) that keeps the topology.
//!
//! Edges are collapsed, the cheapest first, under the link condition (Dey et al. 1999), so that the Euler
//! characteristic, the components, the boundary loops and the orientation stay what they are. A collapse must
//! not turn a face over nor make a needle. Boundaries are held by planes perpendicular to the faces along them.

mod blocks;
mod seams;

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use ndf_core::{Cancelled, DVec3, Progress, Sparingly};
use ndf_mesh::NO_HALFEDGE;
use ndf_mesh::{Face, Halfedge, ManifoldMesh};

use self::blocks::Reduced;
use self::seams::Seams;
use crate::editable_mesh::EditableMesh;
use crate::quadric::Quadric;
use crate::triangle_shape::{agree, cross, quality};

/// How far to decimate and what to keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecimationOptions {
    /// Number of faces to reach.
    pub faces: usize,
    /// Weight of the planes that hold the boundary, relative to those of the faces.
    pub boundary_weight: f64,
    /// No face gets a quality (4 √3 area / sum of squared sides, 1 for an equilateral triangle) below this, unless
    /// it comes from faces that were worse. From 0 to 1; larger values cost closeness.
    pub min_quality: f64,
    /// Leave the boundary as it is: all of its vertices, where they are.
    pub keep_boundary: bool,
    /// Keep creases: edges at which the normals of the faces are farther apart than this angle, in radians. Their vertices go
    /// only along them, and where creases end or meet stay.
    pub crease_angle: Option<f64>,
}

impl DecimationOptions {
    /// The usual options for so many faces.
    pub fn to_faces(faces: usize) -> Self {
        Self { faces, boundary_weight: 10.0, min_quality: 0.1, keep_boundary: false, crease_angle: None }
    }
}

/// A decimated mesh.
#[derive(Clone, Debug)]
pub struct Decimated {
    /// The mesh: the same topology with fewer faces.
    pub mesh: ManifoldMesh,
    /// The face of the input that each of its faces has been.
    pub births: Vec<Face>,
    /// Whether it has no more faces than asked for. Otherwise no further edge could be collapsed without a change of
    /// topology, a fold or a needle, or the work was cancelled.
    pub reached: bool,
    /// Number of edges collapsed.
    pub collapses: usize,
    /// Largest cost of a collapse: squared distance times area.
    pub largest_cost: f64,
}

/// Share of the sum of the planes that pulls a vertex to the middle of its edge where they leave it free.
const SOFTNESS: f64 = 1e-5;
/// Cost of collapsing a long edge where the surface is flat: area times squared length times this. It makes
/// the choice among collapses without error one of shape.
const LENGTH_COST: f64 = 1e-5;
/// A face may turn by the angle with this cosine in one collapse.
const TURN: f64 = 0.2;
/// Collapses between two reports.
const REPORT: usize = 2048;
/// Edges queued between two questions whether to stop.
const ASKED: u32 = 4096;

/// Decimates a mesh. Deterministic; O(n log n), on the calling thread. Meshes of a million faces and more are first decimated in
/// blocks of some ten thousand, on all threads.
///
/// The result has the topology of the input, and no face without area unless the input had it. Which place comes off worst
/// depends on the order of collapses: vertices moved by a hundred-thousandth of the diagonal change the largest distance from the
/// input by a tenth or more, up or down, and so do blocks. If the input
/// has no more faces than asked for it is returned as it is.
pub fn decimate(mesh: &ManifoldMesh, options: &DecimationOptions, progress: &dyn Progress) -> Decimated {
    if mesh.face_count() <= options.faces {
        let births = mesh.face_indices().collect();
        return Decimated { mesh: mesh.clone(), births, reached: true, collapses: 0, largest_cost: 0.0 };
    }
    // What is stopped has come as far as it has.
    let Some(reduced) = blocks::reduced(mesh, options, progress) else {
        let mut work = Decimation::new(mesh, options);
        let _ = work.run(options.faces, progress);
        return work.decimated();
    };
    decimated_further(reduced, mesh.bounds().center(), options, progress)
}

/// What blocks left, decimated as a whole; `center` is that of the input.
fn decimated_further(
    reduced: Reduced,
    center: DVec3,
    options: &DecimationOptions,
    progress: &dyn Progress,
) -> Decimated {
    let Reduced { mesh, births, quadrics, areas, collapses, largest_cost } = reduced;
    let mut work = Decimation::around(&mesh, options, center);
    drop(mesh);
    (work.quadrics, work.areas) = (quadrics, areas);
    (work.collapses, work.largest_cost) = (collapses, largest_cost);
    work.gather_quadrics(false, true);
    let _ = work.run(options.faces, &blocks::rest(progress));
    let mut found = work.decimated();
    found.births.iter_mut().for_each(|face| *face = births[face.index()]);
    found
}

/// A collapse in the queue: bits of its cost (which order like the cost, as it is not negative), canonical
/// half-edge, and the state of that edge it was computed for.
type Entry = Reverse<(u64, Halfedge, u32)>;

/// A decimation on its way.
#[derive(Clone)]
pub(crate) struct Decimation<'a> {
    options: &'a DecimationOptions,
    /// Positions are relative to `center`.
    mesh: EditableMesh,
    center: DVec3,
    quadrics: Vec<Quadric>,
    /// Sum of areas behind each quadric.
    areas: Vec<f64>,
    queue: BinaryHeap<Entry>,
    /// Current state of every edge, at its canonical half-edge; entries of other states are stale.
    states: Vec<u32>,
    /// Where the collapse in the queue puts the vertex.
    placements: Vec<DVec3>,
    /// Edges whose collapse was refused since the queue was last filled.
    refused: Vec<Halfedge>,
    collapses: usize,
    largest_cost: f64,
    /// What must stay as it is for other blocks, if this is one.
    seams: Option<Seams>,
}

impl<'a> Decimation<'a> {
    pub(crate) fn new(mesh: &ManifoldMesh, options: &'a DecimationOptions) -> Self {
        let mut this = Self::around(mesh, options, mesh.bounds().center());
        this.gather_quadrics(true, true);
        this
    }

    /// A decimation that computes relative to `center`, of a mesh whose quadrics are still to be set.
    fn around(mesh: &ManifoldMesh, options: &'a DecimationOptions, center: DVec3) -> Self {
        let mut work = EditableMesh::new(mesh);
        work.positions.iter_mut().for_each(|p| *p -= center);
        if let Some(angle) = options.crease_angle {
            work.mark_creases(angle);
        }
        let (halfedges, vertices) = (work.halfedge_count(), work.vertex_count());
        Self {
            options,
            mesh: work,
            center,
            quadrics: vec![Quadric::default(); vertices],
            areas: vec![0.0; vertices],
            queue: BinaryHeap::new(),
            states: vec![0; halfedges],
            placements: vec![DVec3::ZERO; halfedges],
            refused: Vec::new(),
            collapses: 0,
            largest_cost: 0.0,
            seams: None,
        }
    }

    /// Queues all edges.
    fn fill(&mut self, progress: &dyn Progress) -> Result<(), Cancelled> {
        let mut asked = Sparingly::new(progress, ASKED);
        let edges: Vec<Halfedge> = self.mesh.halfedges().filter(|&h| self.mesh.canonical(h) == h).collect();
        let mut entries = Vec::with_capacity(edges.len());
        for h in edges {
            asked.check()?;
            entries.extend(self.entry(h));
        }
        self.queue = BinaryHeap::from(entries);
        Ok(())
    }

    /// Adds the planes of the faces, and the walls along what holds them, to the quadrics.
    fn gather_quadrics(&mut self, planes: bool, walls: bool) {
        for face in self.mesh.faces() {
            let corners = self.mesh.face_vertices(face);
            let positions = corners.map(|v| self.mesh.position(v));
            let cross = cross(positions);
            let (area, normal) = (0.5 * cross.length(), cross.normalize_or_zero());
            let quadric = Quadric::plane(positions[0], normal, area / 3.0);
            for v in corners.into_iter().filter(|_| planes) {
                self.quadrics[v.index()] += quadric;
                self.areas[v.index()] += area / 3.0;
            }
            let is_held = |h: &Halfedge| self.mesh.twin(*h).is_none() || self.mesh.is_crease(*h);
            for h in face.halfedges().into_iter().filter(|h| walls && is_held(h)) {
                let ends = [self.mesh.tail(h), self.mesh.tip(h)];
                let [p, q] = ends.map(|v| self.mesh.position(v));
                let wall = (q - p).cross(normal).normalize_or_zero();
                let weight = self.options.boundary_weight * p.distance_squared(q);
                let quadric = Quadric::plane(p, wall, weight);
                ends.iter().for_each(|&v| self.quadrics[v.index()] += quadric);
            }
        }
    }

    /// The best collapse of an edge, as it enters the queue; `None` if it may not be collapsed, which is remembered.
    fn entry(&mut self, h: Halfedge) -> Option<Entry> {
        let Some([placement, ..]) = self.placements_of(h) else {
            self.refused.push(h);
            return None;
        };
        Some(self.entry_at(h, placement))
    }

    fn entry_at(&mut self, h: Halfedge, placement: DVec3) -> Entry {
        self.placements[h.index()] = placement;
        Reverse((self.cost(h, placement).to_bits(), h, self.states[h.index()]))
    }

    fn cost(&self, h: Halfedge, placement: DVec3) -> f64 {
        let (a, b) = (self.mesh.tail(h), self.mesh.tip(h));
        let quadric = self.quadrics[a.index()] + self.quadrics[b.index()];
        let area = self.areas[a.index()] + self.areas[b.index()];
        let length_squared = self.mesh.position(a).distance_squared(self.mesh.position(b));
        quadric.at(placement) + LENGTH_COST * area * length_squared
    }

    /// Where the merged vertex may go, the best first, if anywhere. Boundary and creases do not move aside: a collapse onto
    /// them ends where they are.
    fn placements_of(&self, h: Halfedge) -> Option<[DVec3; 4]> {
        let (a, b) = (self.mesh.tail(h), self.mesh.tip(h));
        if self.options.keep_boundary && self.mesh.is_boundary_vertex(a) && self.mesh.is_boundary_vertex(b) {
            return None;
        }
        if let Some(anchor) = self.mesh.anchor(h)? {
            return Some([self.mesh.position(anchor); 4]);
        }
        let (p, q) = (self.mesh.position(a), self.mesh.position(b));
        let quadric = self.quadrics[a.index()] + self.quadrics[b.index()];
        let middle = p.midpoint(q);
        let mut simple = [middle, p, q];
        simple.sort_by(|&x, &y| quadric.at(x).total_cmp(&quadric.at(y)));
        let reach = 4.0 * p.distance_squared(q);
        let best = quadric.minimiser(middle, SOFTNESS, 3);
        let best = best.filter(|x| x.distance_squared(middle) <= reach).unwrap_or(simple[0]);
        Some([best, simple[0], simple[1], simple[2]])
    }

    /// The mesh as it is now.
    pub(crate) fn decimated(&self) -> Decimated {
        let mut mesh = self.mesh.clone();
        mesh.positions.iter_mut().for_each(|p| *p += self.center);
        Decimated {
            births: mesh.faces().filter(|face| !mesh.is_hole(face.halfedge(0))).collect(),
            reached: mesh.face_count() <= self.options.faces,
            collapses: self.collapses,
            largest_cost: self.largest_cost,
            mesh: mesh.into_manifold(),
        }
    }

    /// Decimates to so many faces, from where it is.
    pub(crate) fn run(&mut self, faces: usize, progress: &dyn Progress) -> Result<(), Cancelled> {
        progress.report("decimation", 0.0);
        if self.queue.is_empty() && self.refused.is_empty() {
            self.fill(progress)?;
        }
        let faces_before = self.mesh.face_count();
        let to_remove = faces_before.saturating_sub(faces) as f64;
        while self.mesh.face_count() > faces {
            let Some(Reverse((bits, h, state))) = self.queue.pop() else {
                if self.refill() { continue } else { break }
            };
            let current =
                !self.mesh.is_hole(h) && self.mesh.canonical(h) == h && self.states[h.index()] == state;
            if !current {
                continue;
            }
            if !self.may_collapse(h) {
                self.refused.push(h);
                continue;
            }
            let placement = self.placements[h.index()];
            if !self.is_sound(h, placement) {
                self.retry(h, placement);
                continue;
            }
            self.largest_cost = self.largest_cost.max(f64::from_bits(bits));
            self.collapse(h, placement);
            if self.collapses.is_multiple_of(REPORT) {
                progress.report("decimation", (faces_before - self.mesh.face_count()) as f64 / to_remove);
                progress.check()?;
            }
        }
        progress.report("decimation", 1.0);
        Ok(())
    }

    /// Queues the edge once more with the best of its other placements that is sound.
    fn retry(&mut self, h: Halfedge, failed: DVec3) {
        let all = self.placements_of(h).into_iter().flatten();
        let other = all.into_iter().find(|&x| x != failed && self.is_sound(h, x));
        if let Some(placement) = other {
            self.states[h.index()] += 1;
            let entry = self.entry_at(h, placement);
            self.queue.push(entry);
        } else {
            self.refused.push(h);
        }
    }

    /// Queues what was refused, for its surroundings may have changed; false if that is of no use.
    fn refill(&mut self) -> bool {
        let mut refused = std::mem::take(&mut self.refused);
        refused.retain(|&h| !self.mesh.is_hole(h) && self.mesh.canonical(h) == h);
        refused.sort_unstable();
        refused.dedup();
        for h in refused {
            let mut placements = self.placements_of(h).into_iter().flatten();
            if self.may_collapse(h) && placements.any(|x| self.is_sound(h, x)) {
                self.enqueue(h);
            } else {
                self.refused.push(h);
            }
        }
        !self.queue.is_empty()
    }

    /// Whether the topology, and that of what this is a block of, stays as it is when an edge is collapsed.
    fn may_collapse(&self, h: Halfedge) -> bool {
        self.mesh.is_collapsible(h) && self.seams.as_ref().is_none_or(|seams| seams.allow(&self.mesh, h))
    }

    /// Whether the faces around an edge, but for those that go, keep their side and shape when both its ends
    /// move to `placement`.
    fn is_sound(&self, h: Halfedge, placement: DVec3) -> bool {
        let (mesh, ends) = (&self.mesh, [self.mesh.tail(h), self.mesh.tip(h)]);
        let gone = [h, mesh.raw_twin(h)].map(Halfedge::face);
        let (mut worst_before, mut worst_after) = (f64::INFINITY, f64::INFINITY);
        for v in ends {
            for o in mesh.outgoing(v).filter(|o| !gone.contains(&o.face())) {
                let [x, y] = [mesh.tip(o), mesh.tail(o.previous())].map(|v| mesh.position(v));
                let (before, after) = ([mesh.position(v), x, y], [placement, x, y]);
                let (old, new) = (cross(before), cross(after));
                // A face without area has no side to keep.
                if old != DVec3::ZERO && !agree(old, new, TURN) {
                    return false;
                }
                worst_before = worst_before.min(quality(before));
                worst_after = worst_after.min(quality(after));
            }
        }
        // Not even where all faces around were worse may a face lose its area.
        worst_after > 1e-6 && (worst_after >= self.options.min_quality || worst_after >= worst_before)
    }

    fn collapse(&mut self, h: Halfedge, placement: DVec3) {
        let (a, b) = (self.mesh.tail(h), self.mesh.tip(h));
        for side in [h, self.mesh.raw_twin(h)].into_iter().filter(|&s| s != NO_HALFEDGE) {
            for gone in side.face().halfedges() {
                self.states[gone.index()] += 1;
            }
        }
        if let Some(seams) = &mut self.seams {
            seams.merge(a, b);
        }
        self.mesh.collapse(h, placement);
        self.collapses += 1;
        let merged = self.quadrics[b.index()];
        self.quadrics[a.index()] += merged;
        self.areas[a.index()] += self.areas[b.index()];
        let edges: Vec<Halfedge> = self.mesh.edges_at(a).map(|h| self.mesh.canonical(h)).collect();
        edges.into_iter().for_each(|h| self.enqueue(h));
    }

    /// Queues the best collapse of an edge in place of earlier ones.
    fn enqueue(&mut self, h: Halfedge) {
        self.states[h.index()] += 1;
        let entry = self.entry(h);
        self.queue.extend(entry);
    }
}

#[cfg(test)]
mod tests;
