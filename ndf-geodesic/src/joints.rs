//! Vertices that are one place: where fans of faces meet, a manifold has a vertex for each.

use ndf_mesh::{SurfacePoint, Vertex};

use crate::error::GeodesicError;

/// Groups of vertices between which paths pass, as rings: the next one for every vertex. Empty where there are none.
#[derive(Clone, Debug, Default)]
pub(crate) struct Joints {
    next: Vec<Vertex>,
}

impl Joints {
    /// # Errors
    /// If a vertex does not exist.
    pub(crate) fn new(vertices: usize, groups: &[Vec<Vertex>]) -> Result<Self, GeodesicError> {
        if groups.is_empty() {
            return Ok(Self::default());
        }
        let mut joints = Self { next: (0..vertices).map(Vertex::new).collect() };
        for group in groups {
            if let Some(&vertex) = group.iter().find(|v| v.index() >= vertices) {
                return Err(GeodesicError::NotOnMesh { point: SurfacePoint::Vertex(vertex) });
            }
            for pair in group.windows(2) {
                joints.join(pair[0], pair[1]);
            }
        }
        Ok(joints)
    }

    /// Makes one ring of the rings of two vertices.
    fn join(&mut self, a: Vertex, b: Vertex) {
        if a != b && self.others(a).all(|other| other != b) {
            self.next.swap(a.index(), b.index());
        }
    }

    /// The other vertices of the group of this one.
    pub(crate) fn others(&self, vertex: Vertex) -> impl Iterator<Item = Vertex> {
        let next = move |v: &Vertex| self.next.get(v.index()).copied().filter(|next| *next != vertex);
        std::iter::successors(next(&vertex), next)
    }
}
