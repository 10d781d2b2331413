//! Connectivity of a triangulated surface that need not be a simplicial complex.
//!
//! A Δ-complex (Hatcher 2002, §2.1) glues triangles along their sides. A side may be glued to another side of
//! the same triangle, the two ends of an edge may be one vertex, and two edges may join the same vertices: all
//! of this happens in intrinsic triangulations.
//!
//! Half-edges are implicit as in [`ManifoldMesh`]: half-edge `3 f + c` runs from corner `c` of face `f` to the
//! next corner.

use ndf_mesh::ManifoldMesh;
use rayon::prelude::*;

pub use ndf_mesh::NO_HALFEDGE;

/// What is kept of a half-edge; the three of a face lie side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct HalfEdge {
    /// The half-edge it is glued to or [`NO_HALFEDGE`].
    pub(crate) twin: u32,
    /// The vertex it starts from.
    pub(crate) tail: u32,
    /// Its edge.
    pub(crate) edge: u32,
    /// The first curve at or counter-clockwise after it around its tail: see
    /// [`normal_coordinates`](crate::normal_coordinates). Kept here so that it moves with the half-edge.
    pub(crate) roundabout: u32,
}

/// An oriented Δ-complex of triangles: a surface, possibly with boundary and several components.
///
/// Invariants: the gluing is an involution without fixed points that matches tails with tips; the faces around
/// every vertex form one fan.
#[derive(Clone, Debug)]
pub struct DeltaComplex {
    pub(crate) halfedges: Vec<HalfEdge>,
    /// One of the half-edges of every edge.
    pub(crate) edge_halfedges: Vec<u32>,
    /// An outgoing half-edge of every vertex; at the boundary the first of the fan, counter-clockwise.
    pub(crate) vertex_halfedges: Vec<u32>,
}

/// Why a gluing is not a surface.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TopologyError {
    /// The numbers of tails and twins differ or are no multiple of three.
    #[error("{tails} tails and {twins} twins do not form triangles")]
    Counts {
        /// How many tails.
        tails: usize,
        /// How many twins.
        twins: usize,
    },
    /// A tail is not a vertex.
    #[error("half-edge {0} starts at a vertex that does not exist")]
    Tail(u32),
    /// A twin does not exist, is the half-edge itself, or has another twin.
    #[error("half-edge {0} is not paired with exactly one other half-edge")]
    Twin(u32),
    /// Twins do not run between the same vertices in opposite directions.
    #[error("half-edge {0} and its twin do not share both vertices in opposite order")]
    Ends(u32),
    /// A vertex has no face, or its faces form more than one fan.
    #[error("the faces around vertex {0} do not form one fan")]
    Fan(u32),
}

impl DeltaComplex {
    /// The connectivity of a mesh, with its numbering of half-edges, edges, vertices and faces. O(n).
    pub fn of_mesh(mesh: &ManifoldMesh) -> Self {
        let halfedges = (0..mesh.halfedge_count() as u32)
            .map(|h| HalfEdge {
                twin: mesh.twin(h).unwrap_or(NO_HALFEDGE),
                tail: mesh.tail(h),
                edge: mesh.halfedge_edge(h),
                roundabout: 0,
            })
            .collect();
        Self {
            halfedges,
            edge_halfedges: (0..mesh.edge_count() as u32).map(|e| mesh.edge_halfedge(e)).collect(),
            vertex_halfedges: (0..mesh.vertex_count() as u32).map(|v| mesh.vertex_halfedge(v)).collect(),
        }
    }

    /// The complex of a gluing: tail and twin ([`NO_HALFEDGE`] on the boundary) of every half-edge. Edges are
    /// numbered by their lower half-edge. O(n).
    ///
    /// # Errors
    /// If the gluing is not an oriented surface with the vertices `0 … vertex_count`.
    pub fn from_gluing(vertex_count: usize, tails: &[u32], twins: &[u32]) -> Result<Self, TopologyError> {
        if tails.len() != twins.len() || !tails.len().is_multiple_of(3) {
            return Err(TopologyError::Counts { tails: tails.len(), twins: twins.len() });
        }
        let halfedges = tails
            .iter()
            .zip(twins)
            .map(|(&tail, &twin)| HalfEdge { twin, tail, edge: u32::MAX, roundabout: 0 })
            .collect();
        let mut complex =
            Self { halfedges, edge_halfedges: Vec::new(), vertex_halfedges: vec![NO_HALFEDGE; vertex_count] };
        for h in 0..complex.halfedges.len() as u32 {
            let HalfEdge { twin, tail, .. } = complex.halfedges[h as usize];
            if tail as usize >= vertex_count {
                return Err(TopologyError::Tail(h));
            }
            if twin != NO_HALFEDGE {
                let back = complex.halfedges.get(twin as usize).map(|t| t.twin);
                if twin == h || back != Some(h) {
                    return Err(TopologyError::Twin(h));
                }
                if complex.tail(twin) != complex.tip(h) || complex.tip(twin) != tail {
                    return Err(TopologyError::Ends(h));
                }
            }
            if twin == NO_HALFEDGE || h < twin {
                let edge = complex.edge_halfedges.len() as u32;
                complex.edge_halfedges.push(h);
                complex.halfedges[h as usize].edge = edge;
                if twin != NO_HALFEDGE {
                    complex.halfedges[twin as usize].edge = edge;
                }
            }
        }
        for h in (0..complex.halfedges.len() as u32).rev() {
            let current = &mut complex.vertex_halfedges[complex.halfedges[h as usize].tail as usize];
            // Nothing lies clockwise of a half-edge without twin: it begins the fan.
            if *current == NO_HALFEDGE || complex.halfedges[*current as usize].twin != NO_HALFEDGE {
                *current = h;
            }
        }
        complex.check_fans()?;
        Ok(complex)
    }

    /// Whether the fans of all vertices together meet every corner once. Gluing and ends are right already: then
    /// fans meet corners of their own vertex only, each once, and it is enough to count.
    fn check_fans(&self) -> Result<(), TopologyError> {
        let vertices = (0..self.vertex_count() as u32).into_par_iter().with_min_len(4096);
        if let Some(v) = vertices.clone().find_first(|&v| self.vertex_halfedge(v) == NO_HALFEDGE) {
            return Err(TopologyError::Fan(v));
        }
        if vertices.map(|v| self.outgoing(v).count()).sum::<usize>() == self.halfedge_count() {
            return Ok(());
        }
        let mut met = vec![false; self.halfedge_count()];
        (0..self.vertex_count() as u32).flat_map(|v| self.outgoing(v)).for_each(|h| met[h as usize] = true);
        let missed = met.iter().position(|&met| !met).expect("fewer corners are met than there are");
        Err(TopologyError::Fan(self.tail(missed as u32)))
    }

    /// Checks every invariant; for tests and for complexes of doubtful origin. Over all threads, O(n).
    ///
    /// # Errors
    /// With the first violation.
    pub fn check(&self) -> Result<(), TopologyError> {
        let halfedges = (0..self.halfedge_count() as u32).into_par_iter().with_min_len(4096);
        halfedges.map(|h| self.check_halfedge(h)).find_first(Result::is_err).unwrap_or(Ok(()))?;
        let vertices = (0..self.vertex_count() as u32).into_par_iter().with_min_len(4096);
        let stray = vertices.filter(|&v| {
            let h = self.vertex_halfedge(v);
            h as usize >= self.halfedge_count() || self.tail(h) != v
        });
        stray.min().map_or(Ok(()), |v| Err(TopologyError::Fan(v)))?;
        self.check_fans()
    }

    fn check_halfedge(&self, h: u32) -> Result<(), TopologyError> {
        if self.tail(h) as usize >= self.vertex_count() {
            return Err(TopologyError::Tail(h));
        }
        if let Some(t) = self.twin(h) {
            if t == h || self.halfedges.get(t as usize).map(|t| t.twin) != Some(h) {
                return Err(TopologyError::Twin(h));
            }
            let same_edge = self.halfedge_edge(t) == self.halfedge_edge(h);
            if self.tail(t) != self.tip(h) || self.tip(t) != self.tail(h) || !same_edge {
                return Err(TopologyError::Ends(h));
            }
        }
        let canonical = self.edge_halfedge(self.halfedge_edge(h));
        if canonical != h && Some(canonical) != self.twin(h) {
            return Err(TopologyError::Twin(h));
        }
        Ok(())
    }

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
        let twin = self.halfedges[halfedge as usize].twin;
        (twin != NO_HALFEDGE).then_some(twin)
    }

    /// The next half-edge around the same face.
    #[inline]
    pub fn next(&self, halfedge: u32) -> u32 {
        if halfedge % 3 == 2 { halfedge - 2 } else { halfedge + 1 }
    }

    /// The previous half-edge around the same face.
    #[inline]
    pub fn previous(&self, halfedge: u32) -> u32 {
        if halfedge.is_multiple_of(3) { halfedge + 2 } else { halfedge - 1 }
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
        self.tail(self.next(halfedge))
    }

    /// The edge of a half-edge.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn halfedge_edge(&self, halfedge: u32) -> u32 {
        self.halfedges[halfedge as usize].edge
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
    pub fn outgoing(&self, vertex: u32) -> impl Iterator<Item = u32> + '_ {
        let start = self.vertex_halfedge(vertex);
        std::iter::successors(Some(start), move |&h| self.twin(self.previous(h)).filter(|&n| n != start))
    }

    /// Whether a vertex lies on the boundary.
    ///
    /// # Panics
    /// If the vertex does not exist.
    pub fn is_boundary_vertex(&self, vertex: u32) -> bool {
        self.twin(self.vertex_halfedge(vertex)).is_none()
    }

    /// Whether an edge lies on the boundary.
    ///
    /// # Panics
    /// If the edge does not exist.
    pub fn is_boundary_edge(&self, edge: u32) -> bool {
        self.twin(self.edge_halfedge(edge)).is_none()
    }

    /// Whether no edge ends where it begins and no two edges join the same vertices: whether the complex can be
    /// given by the corners of its faces alone. O(n · degree).
    pub fn is_simplicial(&self) -> bool {
        (0..self.vertex_count() as u32)
            .into_par_iter()
            .with_min_len(1024)
            .map_init(Vec::new, |ring, v| {
                ring.clear();
                let mut last = 0;
                for h in self.outgoing(v) {
                    ring.push(self.tip(h));
                    last = self.previous(h);
                }
                if self.twin(last).is_none() {
                    ring.push(self.tail(last));
                }
                ring.sort_unstable();
                !ring.contains(&v) && ring.windows(2).all(|pair| pair[0] != pair[1])
            })
            .all(|simplicial| simplicial)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::shapes;

    #[test]
    fn meshes_become_complexes_with_the_same_numbers() {
        for mesh in [shapes::icosphere(2), shapes::torus(9, 7, 1.0, 0.4), shapes::grid(4, 3)] {
            let mesh = ManifoldMesh::try_from(mesh).unwrap();
            let complex = DeltaComplex::of_mesh(&mesh);
            complex.check().unwrap();
            assert!(complex.is_simplicial());
            assert_eq!(complex.euler_characteristic(), mesh.euler_characteristic());
            assert_eq!(complex.boundary_edge_count(), mesh.boundary_edge_count());
            let tails: Vec<u32> = (0..mesh.halfedge_count() as u32).map(|h| mesh.tail(h)).collect();
            let twins: Vec<u32> =
                (0..mesh.halfedge_count() as u32).map(|h| mesh.twin(h).unwrap_or(NO_HALFEDGE)).collect();
            let again = DeltaComplex::from_gluing(mesh.vertex_count(), &tails, &twins).unwrap();
            assert_eq!(again.edge_halfedges, complex.edge_halfedges);
            assert_eq!(again.vertex_halfedges, complex.vertex_halfedges);
        }
    }

    #[test]
    fn a_torus_of_two_triangles_with_one_vertex() {
        let complex = DeltaComplex::from_gluing(1, &[0; 6], &[3, 4, 5, 0, 1, 2]).unwrap();
        complex.check().unwrap();
        assert_eq!(complex.euler_characteristic(), 0);
        assert_eq!(complex.outgoing(0).count(), 6);
        assert!(!complex.is_simplicial());
    }

    #[test]
    fn bad_gluings_are_refused() {
        let error = |v, tails: &[u32], twins: &[u32]| DeltaComplex::from_gluing(v, tails, twins).unwrap_err();
        const N: u32 = NO_HALFEDGE;
        assert_eq!(error(3, &[0, 1], &[N, N]), TopologyError::Counts { tails: 2, twins: 2 });
        assert_eq!(error(2, &[0, 1, 2], &[N, N, N]), TopologyError::Tail(2));
        assert_eq!(error(3, &[0, 1, 2], &[0, N, N]), TopologyError::Twin(0));
        assert_eq!(error(3, &[0, 1, 2], &[7, N, N]), TopologyError::Twin(0));
        assert_eq!(error(4, &[0, 1, 2, 0, 1, 3], &[3, N, N, 0, N, N]), TopologyError::Ends(0));
        assert_eq!(error(4, &[0, 1, 2], &[N, N, N]), TopologyError::Fan(3));
        // Two triangles that share a vertex and nothing else.
        assert!(matches!(error(5, &[0, 1, 2, 0, 3, 4], &[N; 6]), TopologyError::Fan(0)));
    }
}
