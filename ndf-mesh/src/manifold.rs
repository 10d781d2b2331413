//! A triangle mesh proven to be an oriented 2-manifold, with half-edge topology.
//!
//! Half-edges are implicit: half-edge `3 f + c` runs from corner `c` of face `f` to the next corner. Only
//! twins, an edge numbering and one half-edge a vertex are stored, 32 bits each.

use std::ops::Deref;

use ndf_core::DVec3;
use rayon::prelude::*;

use super::{TriangleMesh, ValidationReport};

/// Stands for the missing twin of a half-edge on the boundary.
pub const NO_HALFEDGE: u32 = u32::MAX;

/// An oriented manifold triangle mesh, possibly with boundary and several components.
///
/// Invariants: positions are finite; every face has three different vertices and every vertex a face; every
/// edge has one face, or two faces that run along it in opposite directions; the faces around every vertex
/// form one fan. Faces without area are allowed: they are a matter of geometry, not of topology.
///
/// It can only be made by [`ManifoldMesh::try_from`] and [`ManifoldMesh::with_twins`], which check.
#[derive(Clone, Debug)]
pub struct ManifoldMesh {
    mesh: TriangleMesh,
    /// Twin of every half-edge or [`NO_HALFEDGE`].
    twins: Vec<u32>,
    /// Edge of every half-edge.
    halfedge_edges: Vec<u32>,
    /// The canonical (lower) half-edge of every edge.
    edge_halfedges: Vec<u32>,
    /// An outgoing half-edge of every vertex; at the boundary the first of the fan, counter-clockwise.
    vertex_halfedges: Vec<u32>,
}

/// Why a mesh is no [`ManifoldMesh`]: the full report.
#[derive(Clone, Debug, thiserror::Error)]
#[error("not an oriented manifold: {}", .0.manifold_defects())]
pub struct NotManifold(pub Box<ValidationReport>);

impl TryFrom<TriangleMesh> for ManifoldMesh {
    type Error = NotManifold;

    /// Checks the mesh and builds its topology. O(n log n).
    ///
    /// # Errors
    /// With the report of every defect, if the mesh is not an oriented manifold.
    fn try_from(mesh: TriangleMesh) -> Result<Self, NotManifold> {
        let report = ValidationReport::of(&mesh);
        if !report.is_oriented_manifold() {
            return Err(NotManifold(Box::new(report)));
        }
        Ok(Self::build(mesh))
    }
}

/// Positions and faces, with everything that needs no topology.
impl Deref for ManifoldMesh {
    type Target = TriangleMesh;

    fn deref(&self) -> &TriangleMesh {
        &self.mesh
    }
}

impl ManifoldMesh {
    /// A manifold of which the twin of every half-edge is known ([`NO_HALFEDGE`] on the boundary): twins are
    /// checked over all threads instead of being searched for. O(n · degree).
    ///
    /// # Errors
    /// With the report of every defect, if the mesh is not an oriented manifold. If it is one, but the twins are
    /// not its own, they are found as by [`try_from`](Self::try_from).
    pub fn with_twins(mesh: TriangleMesh, twins: Vec<u32>) -> Result<Self, NotManifold> {
        if !are_twins(&mesh, &twins) {
            return Self::try_from(mesh);
        }
        let manifold = Self::number(mesh, twins);
        if manifold.has_proper_fans() { Ok(manifold) } else { Self::try_from(manifold.mesh) }
    }

    /// Topology of a mesh known to be an oriented manifold.
    fn build(mesh: TriangleMesh) -> Self {
        let halfedges = 3 * mesh.face_count();
        let mut by_edge: Vec<(u32, u32, u32)> = (0..halfedges as u32)
            .map(|h| {
                let face = mesh.faces()[h as usize / 3];
                let (a, b) = (face[h as usize % 3], face[(h as usize + 1) % 3]);
                (a.min(b), a.max(b), h)
            })
            .collect();
        by_edge.sort_unstable();
        let mut twins = vec![NO_HALFEDGE; halfedges];
        for pair in by_edge.windows(2) {
            if (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1) {
                twins[pair[0].2 as usize] = pair[1].2;
                twins[pair[1].2 as usize] = pair[0].2;
            }
        }
        Self::number(mesh, twins)
    }

    /// Numbers edges by their lower half-edge, so that the numbering follows the faces, and finds a half-edge of
    /// every vertex.
    fn number(mesh: TriangleMesh, twins: Vec<u32>) -> Self {
        let mut halfedge_edges: Vec<u32> = Vec::with_capacity(twins.len());
        let mut edge_halfedges = Vec::with_capacity(twins.len() / 2 + 1);
        let mut vertex_halfedges = vec![NO_HALFEDGE; mesh.vertex_count()];
        let tails = mesh.faces().iter().flatten();
        for (h, (&twin, &tail)) in (0..).zip(twins.iter().zip(tails)) {
            if h < twin {
                halfedge_edges.push(edge_halfedges.len() as u32);
                edge_halfedges.push(h);
            } else {
                halfedge_edges.push(halfedge_edges[twin as usize]);
            }
            // Nothing lies clockwise of a half-edge without twin: it begins the fan.
            let first = &mut vertex_halfedges[tail as usize];
            if *first == NO_HALFEDGE || twin == NO_HALFEDGE {
                *first = h;
            }
        }
        Self { mesh, twins, halfedge_edges, edge_halfedges, vertex_halfedges }
    }

    /// Whether the faces around every vertex form one fan, of three at least inside, and meet every other vertex
    /// once: then no two edges join the same vertices, and no two faces have the same corners.
    fn has_proper_fans(&self) -> bool {
        let corners: Option<usize> = (0..self.vertex_count() as u32)
            .into_par_iter()
            .with_min_len(1024)
            .map_init(Vec::new, |ring: &mut Vec<u32>, v| {
                ring.clear();
                if self.vertex_halfedge(v) == NO_HALFEDGE {
                    return None;
                }
                let mut last = 0;
                for h in self.outgoing(v) {
                    ring.push(self.tip(h));
                    last = self.previous(h);
                }
                let faces = ring.len();
                let closed = self.twin(last).is_some();
                if !closed {
                    ring.push(self.tail(last));
                }
                ring.sort_unstable();
                let once = ring.windows(2).all(|pair| pair[0] != pair[1]);
                (once && (!closed || faces >= 3)).then_some(faces)
            })
            .sum();
        corners == Some(self.halfedge_count())
    }

    /// The mesh without its topology, given away.
    pub fn into_triangle_mesh(self) -> TriangleMesh {
        self.mesh
    }

    /// Number of edges.
    pub fn edge_count(&self) -> usize {
        self.edge_halfedges.len()
    }

    /// Number of half-edges: three a face.
    pub fn halfedge_count(&self) -> usize {
        self.twins.len()
    }

    /// Number of edges with one face.
    pub fn boundary_edge_count(&self) -> usize {
        2 * self.edge_count() - self.halfedge_count()
    }

    /// V − E + F.
    pub fn euler_characteristic(&self) -> i64 {
        self.vertex_count() as i64 - self.edge_count() as i64 + self.face_count() as i64
    }

    /// The half-edge along the same edge in the other face, or `None` on the boundary.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    pub fn twin(&self, halfedge: u32) -> Option<u32> {
        let twin = self.twins[halfedge as usize];
        (twin != NO_HALFEDGE).then_some(twin)
    }

    /// The next half-edge around the same face.
    pub fn next(&self, halfedge: u32) -> u32 {
        if halfedge % 3 == 2 { halfedge - 2 } else { halfedge + 1 }
    }

    /// The previous half-edge around the same face.
    pub fn previous(&self, halfedge: u32) -> u32 {
        if halfedge.is_multiple_of(3) { halfedge + 2 } else { halfedge - 1 }
    }

    /// The vertex a half-edge starts from.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    pub fn tail(&self, halfedge: u32) -> u32 {
        self.mesh.faces()[halfedge as usize / 3][halfedge as usize % 3]
    }

    /// The vertex a half-edge points to.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    pub fn tip(&self, halfedge: u32) -> u32 {
        self.tail(self.next(halfedge))
    }

    /// The edge of a half-edge.
    ///
    /// # Panics
    /// If the half-edge does not exist.
    pub fn halfedge_edge(&self, halfedge: u32) -> u32 {
        self.halfedge_edges[halfedge as usize]
    }

    /// The canonical half-edge of an edge: the lower of its two.
    ///
    /// # Panics
    /// If the edge does not exist.
    pub fn edge_halfedge(&self, edge: u32) -> u32 {
        self.edge_halfedges[edge as usize]
    }

    /// Tail and tip of the canonical half-edge of an edge.
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
    pub fn vertex_halfedge(&self, vertex: u32) -> u32 {
        self.vertex_halfedges[vertex as usize]
    }

    /// Outgoing half-edges of a vertex, counter-clockwise, one for each of its faces.
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

    /// The same topology with vertices moved to `positions`.
    ///
    /// # Panics
    /// If the number of positions differs or one is not finite.
    #[must_use]
    pub fn with_positions(&self, positions: Vec<DVec3>) -> Self {
        assert_eq!(positions.len(), self.vertex_count());
        assert!(positions.iter().all(|p| p.is_finite()));
        let mesh = TriangleMesh::from_parts(positions, self.faces().to_vec());
        Self { mesh, ..self.clone() }
    }
}

/// Whether positions are finite, every face has three corners, and `twins` pairs half-edges that run between the
/// same vertices in opposite directions.
fn are_twins(mesh: &TriangleMesh, twins: &[u32]) -> bool {
    let faces = mesh.faces();
    let ends = |h: usize| [faces[h / 3][h % 3], faces[h / 3][(h + 1) % 3]];
    let glued = |(h, &twin): (usize, &u32)| {
        let [tail, tip] = ends(h);
        let back = twins.get(twin as usize);
        let paired = || back == Some(&(h as u32)) && twin as usize != h && ends(twin as usize) == [tip, tail];
        tail != tip && (twin == NO_HALFEDGE || paired())
    };
    twins.len() == 3 * faces.len()
        && !faces.is_empty()
        && mesh.positions().par_iter().all(|p| p.is_finite())
        && twins.par_iter().enumerate().with_min_len(4096).all(glued)
}

#[cfg(test)]
mod tests {
    use super::super::shapes;
    use super::*;

    #[test]
    fn known_twins_give_the_same_mesh() {
        for mesh in [shapes::icosphere(3), shapes::torus(24, 12, 1.0, 0.4), shapes::grid(5, 3)] {
            let searched = ManifoldMesh::try_from(mesh.clone()).unwrap();
            let given = ManifoldMesh::with_twins(mesh.clone(), searched.twins.clone()).unwrap();
            let nonsense = ManifoldMesh::with_twins(mesh, vec![7; searched.twins.len()]).unwrap();
            for other in [given, nonsense] {
                assert_eq!(other.twins, searched.twins);
                assert_eq!(other.halfedge_edges, searched.halfedge_edges);
                assert_eq!(other.edge_halfedges, searched.edge_halfedges);
                assert_eq!(other.vertex_halfedges, searched.vertex_halfedges);
            }
        }
    }

    #[test]
    fn twins_do_not_hide_defects() {
        let p = |n: usize| (0..n).map(|i| DVec3::new(i as f64, (i * i) as f64, 0.0)).collect();
        let open = NO_HALFEDGE;
        // The two sides of one triangle; two fans that share a vertex; a vertex without a face.
        let pillow = TriangleMesh::new(p(3), vec![[0, 1, 2], [0, 2, 1]]).unwrap();
        assert!(ManifoldMesh::with_twins(pillow, vec![5, 4, 3, 2, 1, 0]).is_err());
        let bow = TriangleMesh::new(p(5), vec![[0, 1, 2], [0, 3, 4]]).unwrap();
        assert!(ManifoldMesh::with_twins(bow, vec![open; 6]).is_err());
        let lonely = TriangleMesh::new(p(4), vec![[0, 1, 2]]).unwrap();
        assert!(ManifoldMesh::with_twins(lonely, vec![open; 3]).is_err());
    }

    fn laws(mesh: &ManifoldMesh) {
        for h in 0..mesh.halfedge_count() as u32 {
            assert_eq!(mesh.next(mesh.next(mesh.next(h))), h);
            assert_eq!(mesh.previous(mesh.next(h)), h);
            assert_eq!(mesh.tip(h), mesh.tail(mesh.next(h)));
            if let Some(t) = mesh.twin(h) {
                assert_eq!(mesh.twin(t), Some(h));
                assert_eq!((mesh.tail(t), mesh.tip(t)), (mesh.tip(h), mesh.tail(h)));
                assert_eq!(mesh.halfedge_edge(t), mesh.halfedge_edge(h));
            }
        }
        let mut met = 0;
        for v in 0..mesh.vertex_count() as u32 {
            met += mesh.outgoing(v).inspect(|&h| assert_eq!(mesh.tail(h), v)).count();
        }
        assert_eq!(met, mesh.halfedge_count(), "the fans meet every corner once");
        for e in 0..mesh.edge_count() as u32 {
            assert_eq!(mesh.halfedge_edge(mesh.edge_halfedge(e)), e);
        }
    }

    #[test]
    fn topology_of_closed_and_open_shapes() {
        for (mesh, euler, boundary) in [
            (shapes::icosphere(3), 2, 0),
            (shapes::torus(24, 12, 1.0, 0.4), 0, 0),
            (shapes::cube(4), 2, 0),
            (shapes::grid(5, 3), 1, 16),
        ] {
            let mesh = ManifoldMesh::try_from(mesh).unwrap();
            assert_eq!(mesh.euler_characteristic(), euler);
            assert_eq!(mesh.boundary_edge_count(), boundary);
            laws(&mesh);
        }
    }

    #[test]
    fn boundary_fans_are_complete() {
        let mesh = ManifoldMesh::try_from(shapes::grid(2, 2)).unwrap();
        let center = 4;
        assert!(!mesh.is_boundary_vertex(center));
        assert_eq!((0..9).filter(|&v| mesh.is_boundary_vertex(v)).count(), 8);
    }
}
