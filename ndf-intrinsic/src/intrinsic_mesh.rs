//! A triangulated surface with edge lengths in place of positions.

use std::ops::Deref;

use ndf_mesh::{Edge, Face, Halfedge, ManifoldMesh, Topology, TopologyError, Vertex};
use rayon::prelude::*;

use crate::triangle;

/// An oriented Δ-complex with a length for every edge: a polyhedral surface that needs no embedding.
///
/// Dereferences to its connectivity, which keeps [roundabouts](crate::normal_coordinates) beside the half-edges (0
/// where the mesh does not lie on another). Invariant: every length is finite and not negative. Whether the triangle
/// inequality holds in every face is a property of the input: see [`slack`](Self::slack) and
/// [`mollify`](Self::mollify).
#[derive(Clone, Debug)]
pub struct IntrinsicMesh {
    pub(crate) topology: Topology<u32>,
    pub(crate) lengths: Vec<f64>,
}

/// Why parts do not make an intrinsic mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IntrinsicMeshError {
    /// The gluing is not a surface.
    #[error(transparent)]
    Topology(#[from] TopologyError),
    /// There is not one length for every edge.
    #[error("{found} lengths for {expected} edges")]
    LengthCount {
        /// How many lengths were given.
        found: usize,
        /// How many edges there are.
        expected: usize,
    },
    /// A length is negative, infinite or NaN.
    #[error("edge {edge} has length {length}")]
    Length {
        /// The edge.
        edge: Edge,
        /// Its length.
        length: f64,
    },
    /// The triangle inequality fails by more than the tolerance.
    #[error("the sides {sides:?} of face {face} violate the triangle inequality")]
    TriangleInequality {
        /// The face.
        face: Face,
        /// Lengths of its sides.
        sides: [f64; 3],
    },
}

/// What [`IntrinsicMesh::mollify`] did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mollification {
    /// The length added to every edge, in the mesh's unit; 0 where nothing had to be done.
    pub added: f64,
    /// That length as a fraction of the mean edge length.
    pub relative: f64,
    /// Faces that asked for it.
    pub faces: usize,
}

pub use ndf_mesh::quality::DELAUNAY_TOLERANCE;

impl Deref for IntrinsicMesh {
    type Target = Topology<u32>;

    fn deref(&self) -> &Topology<u32> {
        &self.topology
    }
}

impl IntrinsicMesh {
    /// Connectivity and edge lengths of a mesh, with its numbering. O(n).
    pub fn from_mesh(mesh: &ManifoldMesh) -> Self {
        let p = mesh.positions();
        let length = |e| {
            let [a, b] = mesh.topology().edge_vertices(e);
            p[a.index()].distance(p[b.index()])
        };
        let lengths = mesh.topology().edges().map(length).collect();
        Self { topology: mesh.topology().with_data(0), lengths }
    }

    /// A mesh of a connectivity and one length for each of its edges.
    ///
    /// The triangle inequality `a + b ≥ c` may fail by `tolerance · (a + b + c)`, to let rounded lengths of flat
    /// triangles pass; 0 for none, ∞ to leave the inequality to [`mollify`](Self::mollify). O(n).
    ///
    /// # Errors
    /// If a length is missing, negative or not finite, or the triangle inequality fails by more.
    pub fn new(topology: &Topology, lengths: Vec<f64>, tolerance: f64) -> Result<Self, IntrinsicMeshError> {
        if lengths.len() != topology.edge_count() {
            return Err(IntrinsicMeshError::LengthCount {
                found: lengths.len(),
                expected: topology.edge_count(),
            });
        }
        if let Some(e) = lengths.iter().position(|l| !(l.is_finite() && *l >= 0.0)) {
            return Err(IntrinsicMeshError::Length { edge: Edge::new(e), length: lengths[e] });
        }
        let mesh = Self { topology: topology.with_data(0), lengths };
        for face in mesh.faces() {
            let sides = mesh.sides(face);
            if triangle::slack(sides) < -tolerance * sides.iter().sum::<f64>() {
                return Err(IntrinsicMeshError::TriangleInequality { face, sides });
            }
        }
        Ok(mesh)
    }

    /// Connectivity without lengths.
    pub fn topology(&self) -> &Topology<u32> {
        &self.topology
    }

    /// The same surface with all lengths multiplied by one factor.
    ///
    /// # Panics
    /// If the factor is negative or not finite.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        assert!(factor.is_finite() && factor >= 0.0, "lengths times {factor}");
        self.lengths.iter_mut().for_each(|length| *length *= factor);
        self
    }

    /// Lengths of all edges.
    pub fn lengths(&self) -> &[f64] {
        &self.lengths
    }

    /// Length of an edge.
    ///
    /// # Panics
    /// If the edge does not exist.
    #[inline]
    pub fn length(&self, edge: Edge) -> f64 {
        self.lengths[edge.index()]
    }

    /// Length of a half-edge's edge.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn halfedge_length(&self, halfedge: Halfedge) -> f64 {
        self.length(self.halfedge_edge(halfedge))
    }

    /// Lengths of the sides of a face; side `c` runs from corner `c` to the next.
    ///
    /// # Panics
    /// If the face does not exist.
    #[inline]
    pub fn sides(&self, face: Face) -> [f64; 3] {
        self.face_edges(face).map(|e| self.length(e))
    }

    /// Lengths of the sides of a half-edge's face, beginning with its own.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    #[inline]
    pub fn sides_from(&self, halfedge: Halfedge) -> [f64; 3] {
        [halfedge, halfedge.next(), halfedge.previous()].map(|h| self.halfedge_length(h))
    }

    /// Area of a face; 0 where the triangle inequality fails.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn area(&self, face: Face) -> f64 {
        triangle::area(self.sides(face))
    }

    /// Total area.
    pub fn total_area(&self) -> f64 {
        self.faces().map(|f| self.area(f)).sum()
    }

    /// Angle at the tail of a half-edge in its face, in radians.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    pub fn corner_angle(&self, halfedge: Halfedge) -> f64 {
        triangle::angle(self.sides_from(halfedge), 0)
    }

    /// Cotangent of the angle opposite to a half-edge in its face.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    pub fn cotangent(&self, halfedge: Halfedge) -> f64 {
        triangle::cotangent_opposite(self.sides_from(halfedge), 0)
    }

    /// Sum of the cotangents opposite to an edge: twice its weight in the cotangent Laplacian.
    ///
    /// # Panics
    /// If the edge does not exist.
    pub fn cotangent_sum(&self, edge: Edge) -> f64 {
        let h = self.edge_halfedge(edge);
        self.cotangent(h) + self.twin(h).map_or(0.0, |t| self.cotangent(t))
    }

    /// Sums of the angles around every vertex, in radians: 2π where the surface is flat, π on a straight
    /// boundary.
    pub fn angle_sums(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.vertex_count()];
        for h in self.halfedges() {
            sums[self.tail(h).index()] += self.corner_angle(h);
        }
        sums
    }

    /// Sum of the angles around a vertex, in radians.
    ///
    /// # Panics
    /// If the vertex does not exist.
    pub fn angle_sum(&self, vertex: Vertex) -> f64 {
        self.outgoing(vertex).map(|h| self.corner_angle(h)).sum()
    }

    /// Whether an edge is locally Delaunay: the angles opposite to it sum to at most π, up to
    /// [`DELAUNAY_TOLERANCE`]. Boundary edges are.
    ///
    /// # Panics
    /// If the edge does not exist.
    pub fn is_delaunay_edge(&self, edge: Edge) -> bool {
        let h = self.edge_halfedge(edge);
        let Some(twin) = self.twin(h) else { return true };
        if self.is_acute(h) && self.is_acute(twin) {
            return true;
        }
        let sum = self.cotangent(h) + self.cotangent(twin);
        // ∞ − ∞: two faces without area on one edge; no flip improves them.
        sum.is_nan() || sum >= -DELAUNAY_TOLERANCE
    }

    /// Whether the angle opposite to a half-edge is at most a right one.
    #[inline]
    pub(crate) fn is_acute(&self, halfedge: Halfedge) -> bool {
        let [c, a, b] = self.sides_from(halfedge);
        a * a + b * b >= c * c
    }

    /// Share of the inner edges that are locally Delaunay.
    pub fn delaunay_fraction(&self) -> f64 {
        let inner = self.edge_count() - self.boundary_edge_count();
        let edges = self.par_edges().with_min_len(4096);
        let failed = edges.filter(|&e| !self.is_delaunay_edge(e)).count();
        if inner == 0 { 1.0 } else { 1.0 - failed as f64 / inner as f64 }
    }

    /// Whether every inner edge is locally Delaunay, hence the triangulation in its own metric (Bobenko and
    /// Springborn 2007).
    pub fn is_delaunay(&self) -> bool {
        self.par_edges().with_min_len(4096).all(|e| self.is_delaunay_edge(e))
    }

    /// The smallest `a + b − c` over all faces, relative to `a + b + c`; negative where the triangle inequality
    /// fails somewhere, 0 for a face without area.
    pub fn slack(&self) -> f64 {
        let relative = |f| {
            let sides = self.sides(f);
            let perimeter: f64 = sides.iter().sum();
            if perimeter > 0.0 { triangle::slack(sides) / perimeter } else { 0.0 }
        };
        let faces = self.par_faces().with_min_len(4096);
        faces.map(relative).reduce(|| f64::INFINITY, f64::min)
    }

    /// The smallest angle of all faces, in radians.
    pub fn smallest_angle(&self) -> f64 {
        let faces = self.par_faces().with_min_len(4096);
        faces.map(|f| triangle::smallest_angle(self.sides(f))).reduce(|| f64::INFINITY, f64::min)
    }

    /// Intrinsic mollification (Sharp and Crane 2020, §4.5): adds one length to all edges, the least for which
    /// `a + b − c ≥ threshold · mean length` in every face. Nothing is added where that already holds. O(n).
    pub fn mollify(&mut self, threshold: f64) -> Mollification {
        let mean = self.lengths.iter().sum::<f64>() / self.edge_count().max(1) as f64;
        // A mesh that is one point gets lengths of order one: anything but zero will do.
        let delta = threshold * if mean > 0.0 { mean } else { 1.0 };
        let missing = |face: Face| {
            let missing = delta - triangle::slack(self.sides(face));
            if missing > 0.0 { (missing, 1) } else { (0.0, 0) }
        };
        let (added, faces) = self
            .par_faces()
            .with_min_len(4096)
            .map(missing)
            .reduce(|| (0.0, 0), |a, b| (f64::max(a.0, b.0), a.1 + b.1));
        if added > 0.0 {
            self.lengths.iter_mut().for_each(|l| *l += added);
        }
        Mollification { added, relative: if mean > 0.0 { added / mean } else { added }, faces }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use ndf_mesh::shapes;
    use std::f64::consts::PI;

    #[test]
    fn lengths_areas_and_angles_are_those_of_the_mesh() {
        let mesh = ManifoldMesh::try_from(shapes::torus(24, 12, 1.0, 0.4)).unwrap();
        let intrinsic = IntrinsicMesh::from_mesh(&mesh);
        assert_relative_eq!(intrinsic.total_area(), mesh.area(), max_relative = 1e-12);
        let defect: f64 = intrinsic.angle_sums().iter().map(|a| 2.0 * PI - a).sum();
        assert_relative_eq!(defect, 0.0, epsilon = 1e-9);
        let quality = ndf_mesh::quality::Quality::of(&mesh);
        assert_relative_eq!(intrinsic.delaunay_fraction(), quality.delaunay_fraction, epsilon = 1e-12);
    }

    #[test]
    fn a_factor_scales_the_metric_and_one_changes_nothing() {
        let mesh = ManifoldMesh::try_from(shapes::torus(9, 6, 1.0, 0.4)).unwrap();
        let intrinsic = IntrinsicMesh::from_mesh(&mesh);
        assert_eq!(intrinsic.clone().scaled(1.0).lengths(), intrinsic.lengths());
        let larger = intrinsic.clone().scaled(1.5);
        assert_relative_eq!(larger.total_area(), 2.25 * mesh.area(), max_relative = 1e-12);
        assert_relative_eq!(larger.smallest_angle(), intrinsic.smallest_angle(), max_relative = 1e-12);
        assert_eq!(larger.delaunay_fraction(), intrinsic.delaunay_fraction());
    }

    #[test]
    fn mollification_does_nothing_to_good_meshes_and_mends_flat_faces() {
        let mut good = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(shapes::icosphere(1)).unwrap());
        assert_eq!(good.mollify(1e-8), Mollification { added: 0.0, relative: 0.0, faces: 0 });
        let complex = Topology::from_gluing(1, &[0; 6], &[3, 4, 5, 0, 1, 2].map(Halfedge)).unwrap();
        let mut flat = IntrinsicMesh::new(&complex, vec![1.0, 1.0, 2.0], 0.0).unwrap();
        assert_eq!(flat.slack(), 0.0);
        let report = flat.mollify(1e-6);
        assert_eq!(report.faces, 2);
        assert_relative_eq!(report.relative, 1e-6, max_relative = 1e-6);
        assert!(flat.slack() > 0.0);
    }

    #[test]
    fn bad_lengths_are_refused() {
        let complex = || Topology::from_gluing(1, &[0; 6], &[3, 4, 5, 0, 1, 2].map(Halfedge)).unwrap();
        let error = |l: &[f64]| IntrinsicMesh::new(&complex(), l.to_vec(), 1e-12).unwrap_err();
        assert!(matches!(error(&[1.0]), IntrinsicMeshError::LengthCount { .. }));
        assert!(matches!(error(&[1.0, f64::NAN, 1.0]), IntrinsicMeshError::Length { edge: Edge(1), .. }));
        assert!(matches!(error(&[1.0, 1.0, -1.0]), IntrinsicMeshError::Length { edge: Edge(2), .. }));
        assert!(matches!(
            error(&[1.0, 1.0, 2.1]),
            IntrinsicMeshError::TriangleInequality { face: Face(0), .. }
        ));
    }
}
