//! An intrinsic triangulation of a mesh: other triangles, the same surface.

use ndf_mesh::FacePoint;
use ndf_mesh::{Edge, Halfedge, ManifoldMesh, SurfacePoint, TriangleMesh, Vertex};

use crate::integer_coordinates::IntegerCoordinates;
use crate::intrinsic_mesh::{IntrinsicMesh, Mollification};
use crate::locating::Located;
use crate::planar::distance;
use crate::quad::Quad;
use crate::tracing::Crossing;
use crate::triangle;

/// Faces flatter than this are mollified: `a + b − c` below this fraction of the mean length. Lengths carry
/// relative errors of 1e-16; at a slack of 1e-10 the area of a needle is still known to six digits, and the
/// lengths of all other edges change in the tenth.
pub const MOLLIFICATION: f64 = 1e-10;

/// Three points in line may be laid out with a sine of up to this between them: a thousand times the rounding of
/// one layout. Vertices on one edge of the input are in line, and a face between them must not come about.
pub const STRAIGHT: f64 = 1e-12;

/// A triangulation of the surface of an input mesh whose edges are geodesics of it.
///
/// The input's vertices come first and keep their numbers. Every operation costs O(1) apart from tracing, which
/// costs the number of crossings it meets. Inserted vertices lie inside faces of the input or on its boundary; a
/// vertex put on an inner edge of the input is kept as one of a face beside it with a barycentric coordinate of
/// 0, on whose other side the input's edge runs.
#[derive(Clone, Debug)]
pub struct IntrinsicTriangulation<'m> {
    pub(crate) coordinates: IntegerCoordinates<'m>,
    /// The input's own triangles, with lengths as mollified.
    pub(crate) base: IntrinsicMesh,
    mollification: Mollification,
}

/// Why an edge cannot be flipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FlipError {
    /// The edge has one face, or the same face on both sides.
    #[error("edge {0} does not have two different faces")]
    NotTwoFaces(Edge),
    /// The quad of its two faces is not strictly convex at the edge's ends.
    #[error("the faces of edge {0} do not form a convex quad")]
    NotConvex(Edge),
}

/// Why a vertex cannot be inserted.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InsertError {
    /// A parameter or a barycentric coordinate is not strictly inside its edge or face, or NaN.
    #[error("the point is outside the element that it names")]
    NotInside,
    /// The point is a vertex already.
    #[error("the point is vertex {0}")]
    IsVertex(Vertex),
}

/// Why a vertex cannot be removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RemoveError {
    /// It is a vertex of the input.
    #[error("vertex {0} is a vertex of the input")]
    OfInput(Vertex),
    /// Its edges cannot be flipped away, or a curve winds around it: both happen to faces without area only.
    #[error("vertex {0} cannot be reduced by flips to one inside a face")]
    Stuck(Vertex),
}

impl<'m> IntrinsicTriangulation<'m> {
    /// The input's own triangulation. Faces without area are [mollified](IntrinsicMesh::mollify). O(n).
    pub fn new(input: &'m ManifoldMesh) -> Self {
        let mut coordinates = IntegerCoordinates::new(input);
        let mollification = coordinates.mesh.mollify(MOLLIFICATION);
        let base = coordinates.mesh.clone();
        Self { coordinates, base, mollification }
    }

    /// How much the input's lengths were changed to give every face an area.
    pub fn mollification(&self) -> Mollification {
        self.mollification
    }

    /// The input mesh.
    pub fn input(&self) -> &'m ManifoldMesh {
        self.coordinates.input
    }

    /// Connectivity and lengths.
    pub fn mesh(&self) -> &IntrinsicMesh {
        &self.coordinates.mesh
    }

    /// Connectivity and lengths, given away.
    pub fn into_mesh(self) -> IntrinsicMesh {
        self.coordinates.mesh
    }

    /// The mesh in space with the same vertices and straight edges, which cut off what bends between them. None where the
    /// triangulation [is not simplicial](ndf_mesh::Topology::is_simplicial), and so no mesh in space. O(n) apart from tracing.
    pub fn embedded(&self) -> Option<ManifoldMesh> {
        let topology = self.mesh().topology();
        let place = |v| self.location(v).position(self.input());
        let faces = || topology.faces().map(|f| topology.face_vertices(f).map(u32::from)).collect();
        let mesh = topology
            .is_simplicial()
            .then(|| TriangleMesh::new(topology.vertices().map(place).collect(), faces()));
        ManifoldMesh::try_from(mesh?.ok()?).ok()
    }

    /// Normal coordinates and roundabouts.
    pub fn coordinates(&self) -> &IntegerCoordinates<'m> {
        &self.coordinates
    }

    /// Where a vertex lies on the input.
    ///
    /// # Panics
    /// If the vertex does not exist.
    pub fn location(&self, vertex: Vertex) -> SurfacePoint {
        match self.coordinates.inserted_place(vertex) {
            None => SurfacePoint::Vertex(vertex),
            Some(place) => self.surface_point(place),
        }
    }

    /// The point of the input at a point of this triangulation. O(1) apart from tracing.
    ///
    /// # Panics
    /// If the element does not exist.
    pub fn to_input(&self, point: SurfacePoint) -> SurfacePoint {
        match point {
            SurfacePoint::Vertex(v) => self.location(v),
            SurfacePoint::Edge { edge, t } => {
                let (h, t) = (self.mesh().edge_halfedge(edge), t.clamp(0.0, 1.0));
                self.surface_point(self.coordinates.locate_on_halfedge(&self.base, h, t).1)
            }
            SurfacePoint::Face(point) => self.surface_point(self.coordinates.locate(&self.base, point).place),
        }
    }

    /// A point of an input face said by the smallest element, without any rounding.
    fn surface_point(&self, place: FacePoint) -> SurfacePoint {
        if place.barycentric.iter().all(|&b| b > 0.0) {
            return SurfacePoint::Face(place);
        }
        SurfacePoint::snapped(self.input(), place, 0.0)
    }

    /// Replaces an edge by the other diagonal of its quad. O(1).
    ///
    /// # Errors
    /// If the edge is on the boundary or the quad is not strictly convex, with [a tolerance](STRAIGHT).
    ///
    /// # Panics
    /// If the edge does not exist.
    pub fn flip(&mut self, edge: Edge) -> Result<(), FlipError> {
        let quad = Quad::of(self.mesh(), edge).ok_or(FlipError::NotTwoFaces(edge))?;
        if !quad.is_convex(STRAIGHT) {
            return Err(FlipError::NotConvex(edge));
        }
        self.coordinates.flip(edge, quad.other_diagonal());
        Ok(())
    }

    /// Inserts a vertex at a point of this triangulation. Returns its number, the last. O(1) apart from tracing.
    ///
    /// # Errors
    /// If the point is a vertex, or not inside the edge or face it is said to be in.
    ///
    /// # Panics
    /// If the edge or face does not exist.
    pub fn insert(&mut self, point: SurfacePoint) -> Result<Vertex, InsertError> {
        match point {
            SurfacePoint::Vertex(v) => Err(InsertError::IsVertex(v)),
            SurfacePoint::Edge { edge, t } => self.split_edge(edge, t),
            SurfacePoint::Face(point) => self.insert_in_face(point),
        }
    }

    /// Inserts a vertex inside a face of this triangulation. Returns its number, the last. O(1) apart from
    /// tracing.
    ///
    /// # Errors
    /// If a barycentric coordinate is not positive.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn insert_in_face(&mut self, point: FacePoint) -> Result<Vertex, InsertError> {
        let FacePoint { face, barycentric } = point;
        let sum: f64 = barycentric.iter().sum();
        if !barycentric.iter().all(|&b| b > 0.0) || !sum.is_finite() {
            return Err(InsertError::NotInside);
        }
        let barycentric = barycentric.map(|b| b / sum);
        let Located { region, place } = self.coordinates.locate(&self.base, FacePoint { face, barycentric });
        let sides = self.mesh().sides(face);
        let lengths = [0, 1, 2].map(|c| {
            let mut d = barycentric;
            d[c] -= 1.0;
            triangle::displacement_length(sides, d)
        });
        Ok(self.coordinates.insert_in_face(face, &region, place, lengths))
    }

    /// Inserts a vertex on an edge of this triangulation, at parameter `t` of its canonical half-edge. Returns
    /// its number, the last. O(1) apart from tracing.
    ///
    /// # Errors
    /// If `t` is not strictly between 0 and 1.
    ///
    /// # Panics
    /// If the edge does not exist.
    pub fn split_edge(&mut self, edge: Edge, t: f64) -> Result<Vertex, InsertError> {
        if !(t > 0.0 && t < 1.0) {
            return Err(InsertError::NotInside);
        }
        let (mut h, mut t) = (self.mesh().edge_halfedge(edge), t);
        if let Some(twin) = self.mesh().twin(h).filter(|&twin| twin.next() == h) {
            (h, t) = (twin, 1.0 - t);
        }
        let (segment, place) = self.coordinates.locate_on_halfedge(&self.base, h, t);
        let length = self.mesh().length(edge);
        let to_apex = |h: Halfedge, t: f64| {
            triangle::displacement_length(self.mesh().sides_from(h), [1.0 - t, t, -1.0])
        };
        let right = match self.mesh().twin(h) {
            // A loop around the tip: the base of an isosceles triangle.
            Some(twin) if twin == h.next() => {
                2.0 * (1.0 - t) * length * (0.5 * self.mesh().corner_angle(twin)).sin()
            }
            Some(twin) => to_apex(twin, 1.0 - t),
            None => 0.0,
        };
        let lengths = [t * length, (1.0 - t) * length, to_apex(h, t), right];
        Ok(self.coordinates.split_edge(h, segment, place, lengths))
    }

    /// Removes an inserted vertex, after flipping its edges away; the last vertex takes its number. The
    /// triangulation around it may have to be made Delaunay again. O(degree²).
    ///
    /// # Errors
    /// If the vertex belongs to the input, or its edges cannot be flipped away; then the triangulation stays
    /// valid, with some edges flipped.
    ///
    /// # Panics
    /// If the vertex does not exist.
    pub fn remove(&mut self, vertex: Vertex) -> Result<(), RemoveError> {
        if !self.coordinates.is_inserted(vertex) {
            return Err(RemoveError::OfInput(vertex));
        }
        // A flip takes an edge from the vertex, unless a corner opposite to the edge is the vertex too.
        let mut most_flips = 4 * self.mesh().outgoing(vertex).count();
        while !self.coordinates.is_removable(vertex) {
            let spokes: Vec<Edge> =
                self.mesh().outgoing(vertex).map(|h| self.mesh().halfedge_edge(h)).collect();
            // Loops first: they count twice.
            let is_loop = |e: Edge| {
                let [a, b] = self.mesh().edge_vertices(e);
                a == b
            };
            let (loops, others): (Vec<Edge>, Vec<Edge>) = spokes.into_iter().partition(|&e| is_loop(e));
            let flipped = loops.into_iter().chain(others).any(|e| self.flip(e).is_ok());
            if !flipped || most_flips == 0 {
                return Err(RemoveError::Stuck(vertex));
            }
            most_flips -= 1;
        }
        if !self.coordinates.stays_taut_without(vertex) {
            return Err(RemoveError::Stuck(vertex));
        }
        self.coordinates.remove(vertex);
        Ok(())
    }

    /// Moves an inserted vertex to a point of this triangulation; it keeps its number. O(degree²) apart from
    /// tracing.
    ///
    /// # Errors
    /// If the vertex belongs to the input or the point is not inside an edge or face: then nothing has changed.
    /// If the vertex cannot be taken from its old place: then the triangulation is valid and has one vertex more.
    ///
    /// # Panics
    /// If the vertex or the element of the point does not exist.
    pub fn move_vertex(&mut self, vertex: Vertex, to: SurfacePoint) -> Result<(), MoveError> {
        if !self.coordinates.is_inserted(vertex) {
            return Err(RemoveError::OfInput(vertex).into());
        }
        self.insert(to)?;
        Ok(self.remove(vertex)?)
    }

    /// Where an edge crosses edges of the input, from the tail of its canonical half-edge to its tip; empty where
    /// it runs along an input edge or inside an input face.
    ///
    /// # Panics
    /// If the edge does not exist.
    pub fn trace_edge(&self, edge: Edge) -> Vec<Crossing> {
        let strip = self.coordinates.strip(&self.base, self.mesh().edge_halfedge(edge));
        (0..strip.crossings()).map(|q| strip.crossing(q)).collect()
    }

    /// Distance between the ends of an edge where the input faces that it passes are unfolded into the plane. It
    /// is the edge's length but for rounding, found without looking at it.
    ///
    /// # Panics
    /// If the edge does not exist.
    pub fn laid_out_length(&self, edge: Edge) -> f64 {
        let strip = self.coordinates.strip(&self.base, self.mesh().edge_halfedge(edge));
        distance(strip.tail, strip.tip)
    }
}

/// Why a vertex cannot be moved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MoveError {
    /// It cannot be inserted at the new place.
    #[error(transparent)]
    Insert(#[from] InsertError),
    /// It cannot be removed from the old place.
    #[error(transparent)]
    Remove(#[from] RemoveError),
}
