//! Flips to the intrinsic Delaunay triangulation (Fisher, Springborn, Bobenko and Schröder 2006).

use rayon::prelude::*;

use crate::integer_coordinates::IntegerCoordinates;
use crate::intrinsic_mesh::IntrinsicMesh;
use crate::intrinsic_triangulation::IntrinsicTriangulation;
use crate::quad::Quad;
use ndf_mesh::Edge;

/// What [flips to Delaunay](IntrinsicTriangulation::flip_to_delaunay) did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DelaunayReport {
    /// Number of flips.
    pub flips: usize,
    /// Edges found not to be Delaunay but not flippable either: only rounding on faces without area leaves such.
    pub stuck: usize,
    /// Whether an edge was left as it was after [`MOST_FLIPS_PER_EDGE`].
    pub stopped: bool,
}

/// The flip algorithm ends after finitely many flips in exact arithmetic; the worst case is quadratic, and meshes
/// stretched 60 times take about a hundred for each edge. Where points all but coincide, rounding makes a few edges flip in
/// circles: they are left as they are after so many flips.
pub const MOST_FLIPS_PER_EDGE: u16 = 10_000;

/// Flips for every edge, in the mean, from which on those of each are counted.
const UNCOUNTED_FLIPS: usize = 10;

/// Edges to look at, each at most once at a time.
#[derive(Clone, Debug, Default)]
pub(crate) struct EdgeQueue {
    stack: Vec<Edge>,
    queued: Vec<bool>,
}

impl EdgeQueue {
    /// These edges, the first on top.
    pub(crate) fn of(edges: &[Edge]) -> Self {
        let mut queue = Self::default();
        edges.iter().rev().for_each(|&e| queue.push(e));
        queue
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.stack.is_empty()
    }

    #[inline]
    pub(crate) fn push(&mut self, edge: Edge) {
        if edge.index() >= self.queued.len() {
            self.queued.resize(edge.index() + 1, false);
        }
        if !std::mem::replace(&mut self.queued[edge.index()], true) {
            self.stack.push(edge);
        }
    }

    #[inline]
    pub(crate) fn pop(&mut self) -> Option<Edge> {
        let edge = self.stack.pop()?;
        self.queued[edge.index()] = false;
        Some(edge)
    }
}

/// A triangulation whose edges can be flipped.
pub(crate) trait Flip {
    /// Connectivity and lengths.
    fn mesh(&self) -> &IntrinsicMesh;

    /// Whether an edge is known to need no flip at a glance.
    fn is_settled(&self, edge: Edge) -> bool;

    /// Flips an edge with two different faces, if that is allowed, and gives it a new length; whether it did.
    fn flip(&mut self, edge: Edge, length: f64) -> bool;
}

impl Flip for IntrinsicMesh {
    #[inline]
    fn mesh(&self) -> &IntrinsicMesh {
        self
    }

    #[inline]
    fn is_settled(&self, edge: Edge) -> bool {
        is_surely_delaunay(self, edge)
    }

    #[inline]
    fn flip(&mut self, edge: Edge, length: f64) -> bool {
        let h = self.edge_halfedge(edge);
        self.topology.flip(h);
        self.lengths[edge.index()] = length;
        true
    }
}

/// A mesh some of whose edges stay.
struct Held<'a> {
    mesh: &'a mut IntrinsicMesh,
    is_held: &'a [bool],
}

impl Flip for Held<'_> {
    fn mesh(&self) -> &IntrinsicMesh {
        self.mesh
    }

    fn is_settled(&self, edge: Edge) -> bool {
        self.is_held[edge.index()] || self.mesh.is_settled(edge)
    }

    fn flip(&mut self, edge: Edge, length: f64) -> bool {
        Flip::flip(self.mesh, edge, length)
    }
}

impl Flip for IntegerCoordinates<'_> {
    #[inline]
    fn mesh(&self) -> &IntrinsicMesh {
        &self.mesh
    }

    #[inline]
    fn is_settled(&self, edge: Edge) -> bool {
        is_surely_delaunay(&self.mesh, edge)
    }

    #[inline]
    fn flip(&mut self, edge: Edge, length: f64) -> bool {
        self.flip(edge, length);
        true
    }
}

/// The four edges around the two faces of an inner edge.
#[inline]
pub(crate) fn quad_edges(mesh: &IntrinsicMesh, edge: Edge) -> [Edge; 4] {
    let h = mesh.edge_halfedge(edge);
    let t = mesh.raw_twin(h);
    [h.next(), h.previous(), t.next(), t.previous()].map(|h| mesh.halfedge_edge(h))
}

/// Flips queued edges and those around them until all are Delaunay in the metric of the lengths. `flipped` is
/// told every edge after its flip.
pub(crate) fn flip_to_delaunay<T: Flip>(
    triangulation: &mut T,
    queue: &mut EdgeQueue,
    mut flipped: impl FnMut(&T, Edge),
) -> DelaunayReport {
    let mut report = DelaunayReport::default();
    let edges = triangulation.mesh().edge_count();
    let mut counts: Vec<u16> = Vec::new();
    while let Some(edge) = queue.pop() {
        if triangulation.is_settled(edge) {
            continue;
        }
        let Some(quad) = Quad::of(triangulation.mesh(), edge) else { continue };
        if !quad.is_violating() {
            continue;
        }
        if !quad.is_convex(0.0) {
            report.stuck += 1;
            continue;
        }
        if report.flips >= UNCOUNTED_FLIPS * edges {
            counts.resize(edges, 0);
            if counts[edge.index()] == MOST_FLIPS_PER_EDGE {
                report.stopped = true;
                continue;
            }
            counts[edge.index()] += 1;
        }
        triangulation.flip(edge, quad.other_diagonal());
        report.flips += 1;
        quad_edges(triangulation.mesh(), edge).into_iter().for_each(|e| queue.push(e));
        flipped(triangulation, edge);
    }
    report
}

/// Whether neither angle opposite to an edge is obtuse: then it is Delaunay, and nothing needs to be laid out.
#[inline]
pub(crate) fn is_surely_delaunay(mesh: &IntrinsicMesh, edge: Edge) -> bool {
    let h = mesh.edge_halfedge(edge);
    mesh.twin(h).is_none_or(|t| mesh.is_acute(h) && mesh.is_acute(t))
}

/// The edges that are not Delaunay, found over all threads.
pub(crate) fn violating(mesh: &IntrinsicMesh) -> EdgeQueue {
    let violates =
        |&e: &Edge| !is_surely_delaunay(mesh, e) && Quad::of(mesh, e).is_some_and(|quad| quad.is_violating());
    let edges: Vec<Edge> = mesh.par_edges().with_min_len(4096).filter(violates).collect();
    EdgeQueue::of(&edges)
}

impl IntrinsicMesh {
    /// Flips edges until the mesh is Delaunay. About O(n) on meshes met in practice, O(n²) at worst.
    pub fn flip_to_delaunay(&mut self) -> DelaunayReport {
        self.flip_to_delaunay_watched(|_, _| {})
    }

    /// The same, and tells `flipped` of every edge after its flip: what is kept with half-edges can follow
    /// ([`Topology::flip`](ndf_mesh::Topology::flip) says to which slots they move).
    pub fn flip_to_delaunay_watched(&mut self, flipped: impl FnMut(&Self, Edge)) -> DelaunayReport {
        let mut queue = violating(self);
        flip_to_delaunay(self, &mut queue, flipped)
    }

    /// The same around edges that stay: the constrained Delaunay triangulation. Edges that are not flipped keep their numbers, and faces
    /// whose three edges stay keep theirs.
    ///
    /// # Panics
    /// If there is not one answer for every edge.
    pub fn flip_to_delaunay_around(&mut self, is_held: &[bool]) -> DelaunayReport {
        assert_eq!(is_held.len(), self.edge_count());
        let mut queue = violating(self);
        flip_to_delaunay(&mut Held { mesh: self, is_held }, &mut queue, |_, _| {})
    }
}

impl IntrinsicTriangulation<'_> {
    /// Flips edges until the triangulation is Delaunay. About O(n) on meshes met in practice, O(n²) at worst.
    pub fn flip_to_delaunay(&mut self) -> DelaunayReport {
        let mut queue = violating(self.mesh());
        flip_to_delaunay(&mut self.coordinates, &mut queue, |_, _| {})
    }
}

#[cfg(test)]
mod tests {
    use ndf_core::DVec3;
    use ndf_mesh::{ManifoldMesh, TriangleMesh, Vertex};

    use super::*;

    #[test]
    fn flips_in_circles_end() {
        // Three faces of the mesh of a model, four of whose vertices all but coincide.
        let faces = vec![[0, 1, 2], [1, 0, 3], [2, 1, 4]];
        let mesh = ManifoldMesh::try_from(TriangleMesh::new(vec![DVec3::ZERO; 5], faces).unwrap()).unwrap();
        let topology = mesh.topology();
        let lengths = [
            ([0, 1], 1.3308288037003977e-12),
            ([1, 2], 2.6616576076444127e-12),
            ([0, 2], 1.3308288039440238e-12),
            ([0, 3], 8.872192025885946e-13),
            ([1, 3], 4.4360960111158755e-13),
            ([1, 4], 0.0013216228946659487),
            ([2, 4], 0.0013216228946689387),
        ];
        let length = |edge: Edge| {
            let mut ends = topology.edge_vertices(edge).map(Vertex::index);
            ends.sort_unstable();
            lengths.iter().find(|(pair, _)| *pair == ends).unwrap().1
        };
        let lengths = topology.edges().map(length).collect();
        let mut mesh = IntrinsicMesh::new(topology, lengths, f64::INFINITY).unwrap();
        let report = mesh.flip_to_delaunay();
        assert!(report.stopped && report.flips <= 3 * usize::from(MOST_FLIPS_PER_EDGE), "{report:?}");
    }
}
