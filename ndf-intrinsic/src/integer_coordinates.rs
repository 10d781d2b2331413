//! A triangulation that lies on an input mesh by integer coordinates, in whatever metric.
//!
//! The input's edges are curves on it, kept by [normal coordinates and roundabouts](crate::normal_coordinates).
//! The operations here are told where new vertices go and how long new edges are; they never look at a length,
//! so that the metric may be another than the input's (Gillespie, Sharp and Crane 2021).

use ndf_mesh::ManifoldMesh;
use ndf_mesh::{Edge, Face, FacePoint, Halfedge, Vertex};

use crate::intrinsic_mesh::IntrinsicMesh;
use crate::normal_coordinates::{Arcs, COINCIDENT, Region, flipped};

/// Stands for "no wrap-around" of roundabouts.
const OPEN: u32 = u32::MAX;

/// An intrinsic mesh and the integers that relate its connectivity to the input mesh.
///
/// The input's vertices come first, with the input's numbers; inserted vertices follow.
#[derive(Clone, Debug)]
pub struct IntegerCoordinates<'m> {
    pub(crate) input: &'m ManifoldMesh,
    pub(crate) mesh: IntrinsicMesh,
    /// Normal coordinate of every edge.
    pub(crate) normal: Vec<i32>,
    /// Where every inserted vertex lies.
    pub(crate) places: Vec<FacePoint>,
    fans: CurveFans,
}

/// The curves that end at every input vertex, counter-clockwise, as outgoing half-edges of the input.
#[derive(Clone, Debug)]
struct CurveFans {
    offsets: Vec<u32>,
    curves: Vec<Halfedge>,
    /// Number of curves at inner vertices, where the last is followed by the first; [`OPEN`] at the boundary.
    moduli: Vec<u32>,
}

impl CurveFans {
    fn of(input: &ManifoldMesh) -> Self {
        let mut offsets = Vec::with_capacity(input.vertex_count() + 1);
        let mut curves = Vec::with_capacity(input.topology().halfedge_count());
        let mut moduli = Vec::with_capacity(input.vertex_count());
        offsets.push(0);
        for v in input.topology().vertices() {
            curves.extend(input.topology().outgoing(v).filter(|&h| input.topology().twin(h).is_some()));
            let count = curves.len() as u32 - offsets[v.index()];
            moduli.push(if input.topology().is_boundary_vertex(v) { OPEN } else { count });
            offsets.push(curves.len() as u32);
        }
        Self { offsets, curves, moduli }
    }
}

impl<'m> IntegerCoordinates<'m> {
    /// The input itself, in its own metric: every inner edge runs along its own curve. O(n).
    pub fn new(input: &'m ManifoldMesh) -> Self {
        let fans = CurveFans::of(input);
        let mut mesh = IntrinsicMesh::from_mesh(input);
        for v in 0..input.vertex_count() {
            let range = fans.offsets[v] as usize..fans.offsets[v + 1] as usize;
            for (index, &h) in fans.curves[range].iter().enumerate() {
                mesh.topology.set_data(h, index as u32);
            }
        }
        let normal =
            input.topology().edges().map(|e| if mesh.is_boundary_edge(e) { 0 } else { COINCIDENT }).collect();
        Self { input, mesh, normal, places: Vec::new(), fans }
    }

    /// The input mesh.
    pub fn input(&self) -> &'m ManifoldMesh {
        self.input
    }

    /// Connectivity and lengths.
    pub fn mesh(&self) -> &IntrinsicMesh {
        &self.mesh
    }

    /// Normal coordinate of an edge: how often it crosses input edges, or [`COINCIDENT`].
    ///
    /// # Panics
    /// If the edge does not exist.
    pub fn normal_coordinate(&self, edge: Edge) -> i32 {
        self.normal[edge.index()]
    }

    /// Roundabout of a half-edge: the index of the first input edge at or counter-clockwise after it, among the
    /// inner edges of the input around its tail; 0 at inserted vertices.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    pub fn roundabout(&self, halfedge: Halfedge) -> u32 {
        self.mesh.data(halfedge)
    }

    /// Whether a vertex was inserted.
    pub fn is_inserted(&self, vertex: Vertex) -> bool {
        vertex.index() >= self.input.vertex_count()
    }

    /// Where an inserted vertex lies on the input; `None` for the input's own.
    pub fn inserted_place(&self, vertex: Vertex) -> Option<FacePoint> {
        let inserted = vertex.index().checked_sub(self.input.vertex_count())?;
        Some(self.places[inserted])
    }

    #[inline]
    pub(crate) fn halfedge_normal(&self, halfedge: Halfedge) -> i32 {
        self.normal[self.mesh.halfedge_edge(halfedge).index()]
    }

    /// The arcs in the face of a half-edge, sides numbered from it.
    #[inline]
    pub(crate) fn arcs_from(&self, halfedge: Halfedge) -> Arcs {
        let (next, last) = (halfedge.next(), halfedge.previous());
        Arcs::new([halfedge, next, last].map(|h| self.halfedge_normal(h)))
    }

    /// Brings an index of a curve around a vertex into range.
    #[inline]
    fn wrapped(&self, vertex: Vertex, index: u32) -> u32 {
        match self.fans.moduli.get(vertex.index()) {
            Some(&modulus) if index >= modulus => index - modulus,
            _ => index,
        }
    }

    /// The roundabout of a half-edge inside the corner of `halfedge` after `clockwise` of the curves that come
    /// out of the corner.
    #[inline]
    pub(crate) fn roundabout_within(&self, halfedge: Halfedge, clockwise: i32) -> u32 {
        let coincident = i32::from(self.halfedge_normal(halfedge) == COINCIDENT);
        let index = self.roundabout(halfedge) + (coincident + clockwise) as u32;
        self.wrapped(self.mesh.tail(halfedge), index)
    }

    /// The input half-edge that curve `index` around input vertex `vertex` leaves by.
    #[inline]
    pub(crate) fn curve(&self, vertex: Vertex, index: u32) -> Halfedge {
        self.fans.curves[(self.fans.offsets[vertex.index()] + index) as usize]
    }

    /// The input face on the left of a half-edge that leaves an input vertex between two curves, and does not
    /// run along one.
    pub(crate) fn wedge_face(&self, halfedge: Halfedge) -> Face {
        let v = self.mesh.tail(halfedge);
        let modulus = self.fans.moduli[v.index()];
        let before = match (self.roundabout(halfedge), modulus) {
            (0, OPEN) => self.input.topology().vertex_halfedge(v),
            (0, count) => self.curve(v, count - 1),
            (index, _) => self.curve(v, index - 1),
        };
        before.face()
    }

    /// Flips an edge with two different faces and gives it a new length.
    #[inline]
    pub(crate) fn flip(&mut self, edge: Edge, length: f64) {
        let h = self.mesh.edge_halfedge(edge);
        let t = self.mesh.raw_twin(h);
        let (left, right) = (self.arcs_from(h), self.arcs_from(t));
        let new = flipped(&left, &right, self.normal[edge.index()] == COINCIDENT);
        let at_k = self.roundabout_within(h.previous(), new.between_ki_and_kl);
        let at_l = self.roundabout_within(t.previous(), new.between_lj_and_lk);
        let [from_l, from_k] = self.mesh.topology.flip(h);
        self.mesh.topology.set_data(from_l, at_l);
        self.mesh.topology.set_data(from_k, at_k);
        self.normal[edge.index()] = new.normal;
        self.mesh.lengths[edge.index()] = length;
    }

    /// Inserts a vertex into a region of a face. Returns the vertex; its edges to the corners of the face are
    /// the last three, in the order of the corners, and have the given lengths.
    pub(crate) fn insert_in_face(
        &mut self,
        face: Face,
        region: &Region,
        place: FacePoint,
        lengths: [f64; 3],
    ) -> Vertex {
        let roundabouts = [0, 1, 2].map(|c| self.roundabout_within(face.halfedge(c), region.clockwise[c]));
        let spokes = self.mesh.topology.insert_in_face(face);
        for (spoke, roundabout) in spokes.into_iter().zip(roundabouts) {
            self.mesh.topology.set_data(spoke, roundabout);
        }
        self.normal.extend(region.crossings);
        self.mesh.lengths.extend(lengths);
        self.places.push(place);
        Vertex::new(self.mesh.vertex_count() - 1)
    }

    /// Splits the edge of `halfedge`, i → j between k on its left and l on its right, after `segment` crossings
    /// from i; an edge along a curve is split just to the left of the curve. Returns the vertex p. The edge keeps
    /// its number as i–p; p–j, p–k and p–l are the last, in this order; on the boundary there is no p–l. The
    /// lengths are those of i–p, p–j, p–k and p–l.
    ///
    /// Where both sides are one face, j → i must follow i → j there; then p–l is a loop at p around j.
    pub(crate) fn split_edge(
        &mut self,
        halfedge: Halfedge,
        segment: i32,
        place: FacePoint,
        lengths: [f64; 4],
    ) -> Vertex {
        let (h, t) = (halfedge, self.mesh.twin(halfedge));
        let edge = self.mesh.halfedge_edge(h);
        let n = self.normal[edge.index()];
        let along = n == COINCIDENT;
        let left = self.arcs_from(h).region_at_side(0, segment);
        let (hp, at_i) = (h.previous(), self.roundabout_within(h, 0));
        let at_k = self.roundabout_within(hp, left.clockwise[2]);
        let right = t.map(|t| {
            let arcs = if t == h.next() {
                // The face is already cut in two when it is cut a second time, from p.
                Arcs::new([n, left.crossings[2], n.max(0) - segment])
            } else {
                self.arcs_from(t)
            };
            let region = arcs.region_at_side(0, n.max(0) - segment);
            let at_l = self.roundabout_within(t.previous(), region.clockwise[2]);
            (region.crossings[2], at_l)
        });
        let ([_, to_k], to_l) = self.mesh.topology.split_edge(h);
        if along {
            // Left of the curve: counter-clockwise of it at i, clockwise of it at j.
            self.mesh.topology.set_data(h, at_i);
        }
        self.set_incoming_roundabout(to_k, at_k);
        let before = if along { 0 } else { segment };
        self.normal[edge.index()] = before;
        self.normal.extend([n.max(0) - before, left.crossings[2]]);
        self.mesh.lengths[edge.index()] = lengths[0];
        self.mesh.lengths.extend([lengths[1], lengths[2]]);
        if let (Some(to_l), Some((crossings, at_l))) = (to_l, right) {
            self.set_incoming_roundabout(to_l, at_l);
            self.normal.push(crossings + i32::from(along));
            self.mesh.lengths.push(lengths[3]);
        }
        self.places.push(place);
        Vertex::new(self.mesh.vertex_count() - 1)
    }

    fn set_incoming_roundabout(&mut self, outgoing: Halfedge, roundabout: u32) {
        let incoming = self.mesh.raw_twin(outgoing);
        self.mesh.topology.set_data(incoming, roundabout);
    }

    /// Whether an inserted vertex is ready to go: three faces around it, or two on the boundary, all different.
    pub(crate) fn is_removable(&self, vertex: Vertex) -> bool {
        let mut faces = [None; 4];
        let mut count = 0;
        for h in self.mesh.outgoing(vertex) {
            if count == 4 || faces.contains(&Some(h.face())) {
                return false;
            }
            faces[count] = Some(h.face());
            count += 1;
        }
        count == if self.mesh.is_boundary_vertex(vertex) { 2 } else { 3 }
    }

    /// Whether curves stay taut when an inserted vertex that [is removable](Self::is_removable) goes: none may
    /// turn around it and cross the same outer edge twice, or run along an outer edge beyond it. Geodesics
    /// cannot, unless faces have no area.
    pub(crate) fn stays_taut_without(&self, vertex: Vertex) -> bool {
        if self.mesh.is_boundary_vertex(vertex) {
            return true;
        }
        self.mesh.outgoing(vertex).all(|h| {
            let t = self.mesh.raw_twin(h);
            let (left, right) = (self.arcs_from(h), self.arcs_from(t));
            let turns = left.cutting[0] > 0 && right.cutting[1] > 0;
            let through = flipped(&left, &right, false).normal == COINCIDENT;
            !turns && !through
        })
    }

    /// Removes an inserted vertex that [is removable](Self::is_removable); the last vertex takes its number. On
    /// the boundary, where it lies straight between its neighbours, their lengths add up.
    pub(crate) fn remove(&mut self, vertex: Vertex) {
        let edges = if self.mesh.is_boundary_vertex(vertex) {
            let along = self.mesh.vertex_halfedge(vertex);
            let inward = self.mesh.raw_twin(along.previous());
            let kept = self.mesh.halfedge_edge(inward.previous());
            self.mesh.lengths[kept.index()] += self.mesh.halfedge_length(along);
            let [a, b] = self.mesh.topology.remove_boundary_degree_two(vertex);
            [Some(a), Some(b), None]
        } else {
            self.mesh.topology.remove_degree_three(vertex).map(Some)
        };
        for e in edges.into_iter().flatten() {
            self.normal.swap_remove(e.index());
            self.mesh.lengths.swap_remove(e.index());
        }
        self.places.swap_remove(vertex.index() - self.input.vertex_count());
    }
}
