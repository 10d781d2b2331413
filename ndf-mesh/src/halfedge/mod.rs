//! Connectivity of a triangulated surface that need not be a simplicial complex.
//!
//! A Δ-complex (Hatcher 2002, §2.1) glues triangles along their sides. A side may be glued to another side of
//! the same triangle, the two ends of an edge may be one vertex, and two edges may join the same vertices: all
//! of this happens in intrinsic triangulations. Meshes in space are the special case that
//! [is simplicial](Topology::is_simplicial).
//!
//! Half-edges are implicit: half-edge `3 f + c` runs from corner `c` of face `f` to the next corner.

mod check;
mod collapse;
mod compact;
mod edits;
#[cfg(test)]
mod tests;

pub use check::TopologyError;
pub use compact::{Survivors, keep, numbers};

use rayon::prelude::*;

use crate::{Edge, Face, Halfedge, Vertex};

/// Stands for the missing twin of a half-edge on the boundary.
pub const NO_HALFEDGE: Halfedge = Halfedge(u32::MAX);

/// Stands for the tail of a half-edge whose face is gone.
const NO_VERTEX: Vertex = Vertex(u32::MAX);

/// Stands for the edge of a half-edge that has none.
const NO_EDGE: Edge = Edge(u32::MAX);

/// What is kept of a half-edge; the three of a face lie side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Record<H> {
    /// The half-edge it is glued to or [`NO_HALFEDGE`].
    twin: Halfedge,
    /// The vertex it starts from.
    tail: Vertex,
    /// Its edge.
    edge: Edge,
    /// What the user keeps of it.
    data: H,
}

/// An oriented Δ-complex of triangles: a surface, possibly with boundary and several components.
///
/// Invariants: the gluing is an involution without fixed points that matches tails with tips; the faces around
/// every vertex form one fan. [Collapses](Self::collapse) leave holes in the numbering until
/// [`compact`](Self::compact).
///
/// `H` is kept with every half-edge, beside it in memory, and moves with it when edits renumber.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topology<H = ()> {
    halfedges: Vec<Record<H>>,
    /// One of the half-edges of every edge.
    edge_halfedges: Vec<Halfedge>,
    /// An outgoing half-edge of every vertex; at the boundary the first of the fan, counter-clockwise.
    vertex_halfedges: Vec<Halfedge>,
}

impl<H: Copy> Topology<H> {
    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertex_halfedges.len()
    }

    /// Number of edges.
    pub fn edge_count(&self) -> usize {
        self.edge_halfedges.len()
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.halfedges.len() / 3
    }

    /// Number of half-edges: three a face.
    pub fn halfedge_count(&self) -> usize {
        self.halfedges.len()
    }

    /// All vertices, in order.
    pub fn vertices(&self) -> impl ExactSizeIterator<Item = Vertex> + Clone + use<H> {
        (0..self.vertex_count() as u32).map(Vertex)
    }

    /// All edges, in order.
    pub fn edges(&self) -> impl ExactSizeIterator<Item = Edge> + Clone + use<H> {
        (0..self.edge_count() as u32).map(Edge)
    }

    /// All faces, in order.
    pub fn faces(&self) -> impl ExactSizeIterator<Item = Face> + Clone + use<H> {
        (0..self.face_count() as u32).map(Face)
    }

    /// All half-edges, in order: face by face.
    pub fn halfedges(&self) -> impl ExactSizeIterator<Item = Halfedge> + Clone + use<H> {
        (0..self.halfedge_count() as u32).map(Halfedge)
    }

    /// [`vertices`](Self::vertices) over all threads.
    pub fn par_vertices(&self) -> impl IndexedParallelIterator<Item = Vertex> + Clone + use<H> {
        (0..self.vertex_count() as u32).into_par_iter().map(Vertex)
    }

    /// [`edges`](Self::edges) over all threads.
    pub fn par_edges(&self) -> impl IndexedParallelIterator<Item = Edge> + Clone + use<H> {
        (0..self.edge_count() as u32).into_par_iter().map(Edge)
    }

    /// [`faces`](Self::faces) over all threads.
    pub fn par_faces(&self) -> impl IndexedParallelIterator<Item = Face> + Clone + use<H> {
        (0..self.face_count() as u32).into_par_iter().map(Face)
    }

    /// [`halfedges`](Self::halfedges) over all threads.
    pub fn par_halfedges(&self) -> impl IndexedParallelIterator<Item = Halfedge> + Clone + use<H> {
        (0..self.halfedge_count() as u32).into_par_iter().map(Halfedge)
    }

    /// Number of edges with one face.
    pub fn boundary_edge_count(&self) -> usize {
        2 * self.edge_count() - self.halfedge_count()
    }

    /// V − E + F.
    pub fn euler_characteristic(&self) -> i64 {
        self.vertex_count() as i64 - self.edge_count() as i64 + self.face_count() as i64
    }

    /// Corner indices of a face.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn face_vertices(&self, face: Face) -> [Vertex; 3] {
        face.halfedges().map(|h| self.tail(h))
    }

    /// Edges of a face: side `c` runs from corner `c` to the next.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn face_edges(&self, face: Face) -> [Edge; 3] {
        face.halfedges().map(|h| self.halfedge_edge(h))
    }

    /// The half-edge glued to this one, or `None` on the boundary.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn twin(&self, halfedge: Halfedge) -> Option<Halfedge> {
        let twin = self.raw_twin(halfedge);
        (twin != NO_HALFEDGE).then_some(twin)
    }

    /// The half-edge glued to this one, or [`NO_HALFEDGE`] on the boundary: for loops in which a branch counts.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn raw_twin(&self, halfedge: Halfedge) -> Halfedge {
        self.halfedges[halfedge.index()].twin
    }

    /// The vertex a half-edge starts from.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn tail(&self, halfedge: Halfedge) -> Vertex {
        self.halfedges[halfedge.index()].tail
    }

    /// The vertex a half-edge points to.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn tip(&self, halfedge: Halfedge) -> Vertex {
        self.tail(halfedge.next())
    }

    /// The edge of a half-edge.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn halfedge_edge(&self, halfedge: Halfedge) -> Edge {
        self.halfedges[halfedge.index()].edge
    }

    /// What is kept with a half-edge.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn data(&self, halfedge: Halfedge) -> H {
        self.halfedges[halfedge.index()].data
    }

    /// Keeps something with a half-edge.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn set_data(&mut self, halfedge: Halfedge, data: H) {
        self.halfedges[halfedge.index()].data = data;
    }

    /// The canonical half-edge of an edge: the one a point `(1 − t) tail + t tip` of the edge refers to.
    ///
    /// # Panics
    /// If the edge does not exist.
    #[inline]
    pub fn edge_halfedge(&self, edge: Edge) -> Halfedge {
        self.edge_halfedges[edge.index()]
    }

    /// Tail and tip of the canonical half-edge of an edge; they may be the same vertex.
    ///
    /// # Panics
    /// If the edge does not exist.
    pub fn edge_vertices(&self, edge: Edge) -> [Vertex; 2] {
        let h = self.edge_halfedge(edge);
        [self.tail(h), self.tip(h)]
    }

    /// An outgoing half-edge of a vertex; on the boundary the first of the fan, so that
    /// [`outgoing`](Self::outgoing) meets all faces.
    ///
    /// # Panics
    /// If the vertex does not exist.
    #[inline]
    pub fn vertex_halfedge(&self, vertex: Vertex) -> Halfedge {
        self.vertex_halfedges[vertex.index()]
    }

    /// Outgoing half-edges of a vertex, counter-clockwise, one for each of its corners. A boundary vertex has
    /// one more edge, at the end of the fan: that of `previous` of the last half-edge.
    ///
    /// # Panics
    /// If the vertex does not exist.
    #[inline]
    pub fn outgoing(&self, vertex: Vertex) -> impl Iterator<Item = Halfedge> + '_ {
        let start = self.vertex_halfedge(vertex);
        std::iter::successors(Some(start), move |&h| self.twin(h.previous()).filter(|&n| n != start))
    }

    /// One half-edge of every edge at a vertex, counter-clockwise: outgoing, but for the last of a boundary vertex.
    ///
    /// # Panics
    /// If the vertex does not exist.
    pub fn edges_at(&self, vertex: Vertex) -> impl Iterator<Item = Halfedge> + '_ {
        self.outgoing(vertex).flat_map(|h| {
            let last = self.raw_twin(h.previous()) == NO_HALFEDGE;
            std::iter::once(h).chain(last.then(|| h.previous()))
        })
    }

    /// The other ends of the edges at a vertex, counter-clockwise.
    ///
    /// # Panics
    /// If the vertex does not exist.
    pub fn ring(&self, vertex: Vertex) -> impl Iterator<Item = Vertex> + '_ {
        self.outgoing(vertex).flat_map(|h| {
            let last = self.raw_twin(h.previous()) == NO_HALFEDGE;
            std::iter::once(self.tip(h)).chain(last.then(|| self.tail(h.previous())))
        })
    }

    /// Whether an edge joins two vertices. O(degree).
    ///
    /// # Panics
    /// If a vertex does not exist.
    pub fn joins(&self, a: Vertex, b: Vertex) -> bool {
        self.outgoing(a).any(|h| self.tip(h) == b || self.tail(h.previous()) == b)
    }

    /// Whether a vertex lies on the boundary.
    ///
    /// # Panics
    /// If the vertex does not exist.
    #[inline]
    pub fn is_boundary_vertex(&self, vertex: Vertex) -> bool {
        self.raw_twin(self.vertex_halfedge(vertex)) == NO_HALFEDGE
    }

    /// Whether an edge lies on the boundary.
    ///
    /// # Panics
    /// If the edge does not exist.
    #[inline]
    pub fn is_boundary_edge(&self, edge: Edge) -> bool {
        self.raw_twin(self.edge_halfedge(edge)) == NO_HALFEDGE
    }

    /// The same complex with something else kept with every half-edge.
    pub fn with_data<G: Copy>(&self, data: G) -> Topology<G> {
        let record = |&Record { twin, tail, edge, .. }: &Record<H>| Record { twin, tail, edge, data };
        Topology {
            halfedges: self.halfedges.iter().map(record).collect(),
            edge_halfedges: self.edge_halfedges.clone(),
            vertex_halfedges: self.vertex_halfedges.clone(),
        }
    }
}
