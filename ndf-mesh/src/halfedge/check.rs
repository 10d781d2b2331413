//! Making a complex from a gluing, and checking it. All checks run over all threads.

use rayon::prelude::*;

use super::{NO_EDGE, NO_HALFEDGE, Record, Topology};
use crate::{Edge, Halfedge, Vertex};

/// Elements a thread takes at a time.
const CHUNK: usize = 4096;

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
    Tail(Halfedge),
    /// A twin does not exist, is the half-edge itself, or has another twin.
    #[error("half-edge {0} is not paired with exactly one other half-edge")]
    Twin(Halfedge),
    /// Twins do not run between the same vertices in opposite directions.
    #[error("half-edge {0} and its twin do not share both vertices in opposite order")]
    Ends(Halfedge),
    /// A vertex has no face, or its faces form more than one fan.
    #[error("the faces around vertex {0} do not form one fan")]
    Fan(Vertex),
}

impl<H: Copy + Default + Send + Sync> Topology<H> {
    /// The complex of a gluing: tail and twin ([`NO_HALFEDGE`] on the boundary) of every half-edge. Edges are
    /// numbered by their lower half-edge. O(n).
    ///
    /// # Errors
    /// If the gluing is not an oriented surface with the vertices `0 … vertex_count`.
    pub fn from_gluing(
        vertex_count: usize,
        tails: &[u32],
        twins: &[Halfedge],
    ) -> Result<Self, TopologyError> {
        let complex = Self::glued(vertex_count, tails, twins)?;
        complex.check_fans()?;
        Ok(complex)
    }

    /// As [`from_gluing`](Self::from_gluing), but for the fans.
    pub(crate) fn glued(
        vertex_count: usize,
        tails: &[u32],
        twins: &[Halfedge],
    ) -> Result<Self, TopologyError> {
        if tails.len() != twins.len() || !tails.len().is_multiple_of(3) {
            return Err(TopologyError::Counts { tails: tails.len(), twins: twins.len() });
        }
        let tip = |h: Halfedge| tails[h.next().index()];
        let check = |h: Halfedge| {
            let (tail, twin) = (tails[h.index()], twins[h.index()]);
            if tail as usize >= vertex_count {
                return Err(TopologyError::Tail(h));
            }
            if twin == NO_HALFEDGE {
                return Ok(());
            }
            if twin == h || twins.get(twin.index()) != Some(&h) {
                return Err(TopologyError::Twin(h));
            }
            let ends_meet = tails[twin.index()] == tip(h) && tip(twin) == tail;
            if ends_meet { Ok(()) } else { Err(TopologyError::Ends(h)) }
        };
        first_error((0..tails.len() as u32).into_par_iter().with_min_len(CHUNK).map(|h| check(Halfedge(h))))?;
        Ok(Self::from_trusted_gluing(
            vertex_count,
            tails.par_iter().zip(twins).map(|(&tail, &twin)| (Vertex(tail), twin)),
        ))
    }

    /// The complex of a gluing that is one by construction: tail and twin of every half-edge, in order. Nothing is
    /// checked. O(n).
    ///
    /// # Panics
    /// If a tail or twin does not exist.
    pub fn from_trusted_gluing(
        vertex_count: usize,
        gluing: impl ParallelIterator<Item = (Vertex, Halfedge)>,
    ) -> Self {
        let record = |(tail, twin)| Record { twin, tail, edge: NO_EDGE, data: H::default() };
        let mut halfedges: Vec<Record<H>> = gluing.map(record).collect();
        let mut edge_halfedges = Vec::with_capacity(halfedges.len() / 2 + 1);
        let mut vertex_halfedges = vec![NO_HALFEDGE; vertex_count];
        for h in (0..halfedges.len()).map(Halfedge::new) {
            let Record { twin, tail, .. } = halfedges[h.index()];
            // Edges are numbered by their lower half-edge, so that the numbering follows the faces.
            if h < twin {
                let edge = Edge::new(edge_halfedges.len());
                edge_halfedges.push(h);
                halfedges[h.index()].edge = edge;
                if twin != NO_HALFEDGE {
                    halfedges[twin.index()].edge = edge;
                }
            }
            // Nothing lies clockwise of a half-edge without twin: it begins the fan.
            let first = &mut vertex_halfedges[tail.index()];
            if *first == NO_HALFEDGE || twin == NO_HALFEDGE {
                *first = h;
            }
        }
        Self { halfedges, edge_halfedges, vertex_halfedges }
    }
}

impl<H: Copy + Sync> Topology<H> {
    /// Checks every invariant; for tests and for complexes of doubtful origin. O(n).
    ///
    /// # Errors
    /// With the first violation.
    pub fn check(&self) -> Result<(), TopologyError> {
        let halfedges = self.par_halfedges().with_min_len(CHUNK);
        first_error(halfedges.map(|h| self.check_halfedge(h)))?;
        let is_wrong = |&v: &Vertex| {
            let h = self.vertex_halfedge(v);
            h.index() >= self.halfedge_count() || self.tail(h) != v
        };
        let vertices = self.par_vertices().with_min_len(CHUNK);
        vertices.find_first(is_wrong).map_or(Ok(()), |v| Err(TopologyError::Fan(v)))?;
        self.check_fans()
    }

    fn check_halfedge(&self, h: Halfedge) -> Result<(), TopologyError> {
        if self.tail(h).index() >= self.vertex_count() {
            return Err(TopologyError::Tail(h));
        }
        if let Some(t) = self.twin(h) {
            if t == h || self.halfedges.get(t.index()).map(|t| t.twin) != Some(h) {
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

    /// Whether the fans of all vertices together meet every corner once. Gluing and ends are right already: then
    /// fans meet corners of their own vertex only, each once, and it is enough to count.
    fn check_fans(&self) -> Result<(), TopologyError> {
        let vertices = self.par_vertices().with_min_len(CHUNK);
        if let Some(v) = vertices.clone().find_first(|&v| self.vertex_halfedge(v) == NO_HALFEDGE) {
            return Err(TopologyError::Fan(v));
        }
        if vertices.map(|v| self.outgoing(v).count()).sum::<usize>() == self.halfedge_count() {
            return Ok(());
        }
        let mut met = vec![false; self.halfedge_count()];
        self.vertices().flat_map(|v| self.outgoing(v)).for_each(|h| met[h.index()] = true);
        let missed = met.iter().position(|&met| !met).expect("fewer corners are met than there are");
        Err(TopologyError::Fan(self.tail(Halfedge::new(missed))))
    }

    /// Whether the complex can be given by the corners of its faces alone: every vertex has one fan, of three
    /// faces at least inside, that meets every other vertex once. Then no edge ends where it begins, no two edges
    /// join the same vertices and no two faces have the same corners. O(n · degree).
    pub fn is_simplicial(&self) -> bool {
        let corners: Option<usize> = self
            .par_vertices()
            .with_min_len(CHUNK / 4)
            .map_init(Vec::new, |ring, v| self.simplicial_fan(ring, v))
            .sum();
        corners == Some(self.halfedge_count())
    }

    /// The number of faces in the fan of a vertex if it is that of a simplicial complex. `ring` is for reuse.
    fn simplicial_fan(&self, ring: &mut Vec<Vertex>, v: Vertex) -> Option<usize> {
        if self.vertex_halfedge(v) == NO_HALFEDGE {
            return None;
        }
        ring.clear();
        let mut last = NO_HALFEDGE;
        for h in self.outgoing(v) {
            ring.push(self.tip(h));
            last = h.previous();
        }
        let faces = ring.len();
        let closed = self.twin(last).is_some();
        if !closed {
            ring.push(self.tail(last));
        }
        ring.sort_unstable();
        let once = ring.windows(2).all(|pair| pair[0] != pair[1]) && !ring.contains(&v);
        (once && (!closed || faces >= 3)).then_some(faces)
    }
}

fn first_error(
    checks: impl IndexedParallelIterator<Item = Result<(), TopologyError>>,
) -> Result<(), TopologyError> {
    checks.find_first(Result::is_err).unwrap_or(Ok(()))
}
