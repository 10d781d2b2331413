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

/// Stands for the missing twin of a half-edge on the boundary.
pub const NO_HALFEDGE: u32 = u32::MAX;

/// Stands for the tail of a half-edge whose face is gone.
const NO_VERTEX: u32 = u32::MAX;

/// What is kept of a half-edge; the three of a face lie side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Record<H> {
    /// The half-edge it is glued to or [`NO_HALFEDGE`].
    twin: u32,
    /// The vertex it starts from.
    tail: u32,
    /// Its edge.
    edge: u32,
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
    edge_halfedges: Vec<u32>,
    /// An outgoing half-edge of every vertex; at the boundary the first of the fan, counter-clockwise.
    vertex_halfedges: Vec<u32>,
}

/// The next half-edge around the same face.
#[inline]
pub fn next(halfedge: u32) -> u32 {
    if halfedge % 3 == 2 { halfedge - 2 } else { halfedge + 1 }
}

/// The previous half-edge around the same face.
#[inline]
pub fn previous(halfedge: u32) -> u32 {
    if halfedge.is_multiple_of(3) { halfedge + 2 } else { halfedge - 1 }
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
    pub fn face_vertices(&self, face: u32) -> [u32; 3] {
        [0, 1, 2].map(|c| self.tail(3 * face + c))
    }

    /// Edges of a face: side `c` runs from corner `c` to the next.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn face_edges(&self, face: u32) -> [u32; 3] {
        [0, 1, 2].map(|c| self.halfedge_edge(3 * face + c))
    }

    /// The half-edge glued to this one, or `None` on the boundary.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn twin(&self, halfedge: u32) -> Option<u32> {
        let twin = self.raw_twin(halfedge);
        (twin != NO_HALFEDGE).then_some(twin)
    }

    /// The half-edge glued to this one, or [`NO_HALFEDGE`] on the boundary: for loops in which a branch counts.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn raw_twin(&self, halfedge: u32) -> u32 {
        self.halfedges[halfedge as usize].twin
    }

    /// The next half-edge around the same face.
    #[inline]
    pub fn next(&self, halfedge: u32) -> u32 {
        next(halfedge)
    }

    /// The previous half-edge around the same face.
    #[inline]
    pub fn previous(&self, halfedge: u32) -> u32 {
        previous(halfedge)
    }

    /// The vertex a half-edge starts from.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn tail(&self, halfedge: u32) -> u32 {
        self.halfedges[halfedge as usize].tail
    }

    /// The vertex a half-edge points to.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn tip(&self, halfedge: u32) -> u32 {
        self.tail(next(halfedge))
    }

    /// The edge of a half-edge.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn halfedge_edge(&self, halfedge: u32) -> u32 {
        self.halfedges[halfedge as usize].edge
    }

    /// What is kept with a half-edge.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn data(&self, halfedge: u32) -> H {
        self.halfedges[halfedge as usize].data
    }

    /// Keeps something with a half-edge.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn set_data(&mut self, halfedge: u32, data: H) {
        self.halfedges[halfedge as usize].data = data;
    }

    /// The canonical half-edge of an edge: the one a point `(1 − t) tail + t tip` of the edge refers to.
    ///
    /// # Panics
    /// If the edge does not exist.
    #[inline]
    pub fn edge_halfedge(&self, edge: u32) -> u32 {
        self.edge_halfedges[edge as usize]
    }

    /// Tail and tip of the canonical half-edge of an edge; they may be the same vertex.
    ///
    /// # Panics
    /// If the edge does not exist.
    pub fn edge_vertices(&self, edge: u32) -> [u32; 2] {
        let h = self.edge_halfedge(edge);
        [self.tail(h), self.tip(h)]
    }

    /// An outgoing half-edge of a vertex; on the boundary the first of the fan, so that
    /// [`outgoing`](Self::outgoing) meets all faces.
    ///
    /// # Panics
    /// If the vertex does not exist.
    #[inline]
    pub fn vertex_halfedge(&self, vertex: u32) -> u32 {
        self.vertex_halfedges[vertex as usize]
    }

    /// Outgoing half-edges of a vertex, counter-clockwise, one for each of its corners. A boundary vertex has
    /// one more edge, at the end of the fan: that of `previous` of the last half-edge.
    ///
    /// # Panics
    /// If the vertex does not exist.
    #[inline]
    pub fn outgoing(&self, vertex: u32) -> impl Iterator<Item = u32> + '_ {
        let start = self.vertex_halfedge(vertex);
        std::iter::successors(Some(start), move |&h| self.twin(previous(h)).filter(|&n| n != start))
    }

    /// One half-edge of every edge at a vertex, counter-clockwise: outgoing, but for the last of a boundary vertex.
    ///
    /// # Panics
    /// If the vertex does not exist.
    pub fn edges_at(&self, vertex: u32) -> impl Iterator<Item = u32> + '_ {
        self.outgoing(vertex).flat_map(|h| {
            let last = self.raw_twin(previous(h)) == NO_HALFEDGE;
            std::iter::once(h).chain(last.then(|| previous(h)))
        })
    }

    /// The other ends of the edges at a vertex, counter-clockwise.
    ///
    /// # Panics
    /// If the vertex does not exist.
    pub fn ring(&self, vertex: u32) -> impl Iterator<Item = u32> + '_ {
        self.outgoing(vertex).flat_map(|h| {
            let last = self.raw_twin(previous(h)) == NO_HALFEDGE;
            std::iter::once(self.tip(h)).chain(last.then(|| self.tail(previous(h))))
        })
    }

    /// Whether an edge joins two vertices. O(degree).
    ///
    /// # Panics
    /// If a vertex does not exist.
    pub fn joins(&self, a: u32, b: u32) -> bool {
        self.outgoing(a).any(|h| self.tip(h) == b || self.tail(previous(h)) == b)
    }

    /// Whether a vertex lies on the boundary.
    ///
    /// # Panics
    /// If the vertex does not exist.
    #[inline]
    pub fn is_boundary_vertex(&self, vertex: u32) -> bool {
        self.raw_twin(self.vertex_halfedge(vertex)) == NO_HALFEDGE
    }

    /// Whether an edge lies on the boundary.
    ///
    /// # Panics
    /// If the edge does not exist.
    #[inline]
    pub fn is_boundary_edge(&self, edge: u32) -> bool {
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
