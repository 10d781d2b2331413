//! Where a subdivision surface is sharp.

use ndf_core::DVec3;

use super::{Refinement, Side};
use crate::ManifoldMesh;

/// The creases and corners of a mesh that is to be subdivided (Hoppe et al. 1994). Its boundary is sharp in any case, and
/// vertices of more than two sharp edges are corners.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Creases {
    /// By edge, in the order of [`Refinement::edges`]; empty without creases.
    edges: Vec<bool>,
    /// By vertex; empty without corners.
    corners: Vec<bool>,
}

impl Creases {
    /// The creases of a mesh for which `is_crease(e)` holds, and the corners for which `is_corner(v)` holds among vertices
    /// of exactly two sharp edges. O(n).
    pub fn new(
        mesh: &Refinement,
        is_crease: impl Fn(usize) -> bool,
        is_corner: impl Fn(usize) -> bool,
    ) -> Self {
        let mut creases = Self::default();
        let edges: Vec<bool> =
            mesh.edges().iter().enumerate().map(|(e, side)| !side.is_boundary() && is_crease(e)).collect();
        if edges.contains(&true) {
            creases.edges = edges;
        }
        let corners: Vec<bool> =
            creases.candidates(mesh).iter().enumerate().map(|(v, &may_be)| may_be && is_corner(v)).collect();
        if corners.contains(&true) {
            creases.corners = corners;
        }
        creases
    }

    /// The creases at which the faces of a mesh enclose an angle of more than `crease_angle`, and the corners at which creases
    /// and boundaries turn by more than `corner_angle`, in radians. A crease of a single edge is none. O(n).
    pub fn by_angle(mesh: &ManifoldMesh, crease_angle: f64, corner_angle: f64) -> Self {
        let level = Refinement::from_mesh(mesh);
        let at = |v: u32| mesh.positions()[v as usize];
        let is_sharp = |side: &Side| {
            let [a, b] = side.ends.map(at);
            let [c, d] = side.across.map(at);
            let [n, m] = [(b - a).cross(c - a), (d - a).cross(b - a)];
            n.angle_between(m) > crease_angle
        };
        let sharp: Vec<bool> = level.edges().iter().map(|s| !s.is_boundary() && is_sharp(s)).collect();
        let counts = Self { edges: sharp.clone(), corners: Vec::new() }.marked(&level).sharp_counts();
        let is_crease =
            |e: usize| sharp[e] && level.edges()[e].ends.into_iter().any(|v| counts[v as usize] > 1);
        let creases = Self::new(&level, is_crease, |_| false);
        let marked = creases.marked(&level);
        let mut ends = vec![Vec::new(); mesh.vertex_count()];
        for side in marked.edges().iter().filter(|side| side.is_sharp) {
            let [a, b] = side.ends;
            ends[a as usize].push(at(b) - at(a));
            ends[b as usize].push(at(a) - at(b));
        }
        let turns = |v: usize| matches!(*ends[v], [a, b] if DVec3::angle_between(a, -b) > corner_angle);
        Self::new(&level, is_crease, turns)
    }

    /// All edges: subdivision then leaves the mesh where it is. O(n).
    pub fn everywhere(mesh: &ManifoldMesh) -> Self {
        Self::new(&Refinement::from_mesh(mesh), |_| true, |_| true)
    }

    /// Whether an edge is a crease.
    pub fn is_crease(&self, edge: usize) -> bool {
        self.edges.get(edge).copied().unwrap_or(false)
    }

    /// Whether a vertex of two sharp edges is a corner.
    pub fn is_corner(&self, vertex: usize) -> bool {
        self.corners.get(vertex).copied().unwrap_or(false)
    }

    /// Numbers of the edges that are creases.
    pub fn edges(&self) -> impl Iterator<Item = usize> {
        self.edges.iter().enumerate().filter_map(|(e, &is_crease)| is_crease.then_some(e))
    }

    /// Numbers of the vertices of two sharp edges that are corners.
    pub fn corners(&self) -> impl Iterator<Item = usize> {
        self.corners.iter().enumerate().filter_map(|(v, &is_corner)| is_corner.then_some(v))
    }

    /// Whether there are creases, and whether there are corners.
    pub fn has(&self) -> [bool; 2] {
        [!self.edges.is_empty(), !self.corners.is_empty()]
    }

    /// The vertices of a mesh that may be corners: those of exactly two sharp edges.
    pub fn candidates(&self, mesh: &Refinement) -> Vec<bool> {
        self.marked(mesh).sharp_counts().into_iter().map(|count| count == 2).collect()
    }

    fn marked(&self, mesh: &Refinement) -> Refinement {
        mesh.clone().with_creases(self)
    }
}
