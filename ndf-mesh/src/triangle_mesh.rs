//! An indexed triangle mesh about which only its index bounds are known.

use std::sync::Arc;

use ndf_core::DVec3;

use ndf_core::BoundingBox;

use crate::{Face, Vertex};

/// Vertex positions and faces as read from a file or made by an algorithm. Indices are in range; nothing else
/// is promised. Past [`ManifoldMesh::try_from`](crate::ManifoldMesh) everything is.
///
/// Clones share positions and faces, which never change.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    positions: Arc<Vec<DVec3>>,
    faces: Arc<Vec<[u32; 3]>>,
}

/// A face names a vertex that does not exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("face {face} names vertex {vertex}, but there are {vertices} vertices")]
pub struct FaceIndexOutOfRange {
    /// The face.
    pub face: Face,
    /// The vertex it names.
    pub vertex: Vertex,
    /// How many vertices there are.
    pub vertices: usize,
}

impl TriangleMesh {
    /// A mesh of these positions and faces.
    ///
    /// # Errors
    /// If a face names a vertex that does not exist.
    pub fn new(positions: Vec<DVec3>, faces: Vec<[u32; 3]>) -> Result<Self, FaceIndexOutOfRange> {
        for (face, corners) in faces.iter().enumerate() {
            if let Some(&v) = corners.iter().find(|&&v| v as usize >= positions.len()) {
                let (face, vertex) = (Face::new(face), Vertex(v));
                return Err(FaceIndexOutOfRange { face, vertex, vertices: positions.len() });
            }
        }
        Ok(Self::shared(positions, faces))
    }

    /// For algorithms of this crate that make indices in range by construction.
    pub(crate) fn from_parts(positions: Vec<DVec3>, faces: Vec<[u32; 3]>) -> Self {
        debug_assert!(faces.iter().flatten().all(|&v| (v as usize) < positions.len()));
        Self::shared(positions, faces)
    }

    fn shared(positions: Vec<DVec3>, faces: Vec<[u32; 3]>) -> Self {
        Self { positions: Arc::new(positions), faces: Arc::new(faces) }
    }

    /// Vertex positions.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Corner indices of every face, counter-clockwise seen from outside.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Positions and faces, given away; copied only if a clone has them, too.
    pub fn into_parts(self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        (Arc::unwrap_or_clone(self.positions), Arc::unwrap_or_clone(self.faces))
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// The indices of all faces, in order.
    pub fn face_indices(&self) -> impl ExactSizeIterator<Item = Face> + Clone + use<> {
        (0..self.face_count() as u32).map(Face)
    }

    /// Positions of the corners of a face.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn corner_positions(&self, face: Face) -> [DVec3; 3] {
        self.faces[face.index()].map(|v| self.positions[v as usize])
    }

    /// `(b − a) × (c − a)`: twice the area, along the normal.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn face_cross(&self, face: Face) -> DVec3 {
        let [a, b, c] = self.corner_positions(face);
        (b - a).cross(c - a)
    }

    /// Area of a face.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn face_area(&self, face: Face) -> f64 {
        0.5 * self.face_cross(face).length()
    }

    /// Unit normal of a face; zero where the face has no area.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn face_normal(&self, face: Face) -> DVec3 {
        self.face_cross(face).normalize_or_zero()
    }

    /// The first vertex that is so far away (beyond 1e75) that squares of areas are no numbers any more. O(n).
    pub fn beyond_reach(&self) -> Option<Vertex> {
        let is_beyond = |p: &DVec3| p.is_finite() && p.abs().max_element() > 1e75;
        self.positions().iter().position(is_beyond).map(Vertex::new)
    }

    /// Total area.
    pub fn area(&self) -> f64 {
        self.face_indices().map(|f| self.face_area(f)).sum()
    }

    /// Signed volume enclosed by the faces: positive when they are oriented outward. Only meaningful for closed
    /// meshes.
    pub fn signed_volume(&self) -> f64 {
        let center = self.bounds().center();
        let six_volumes = |f: Face| {
            let [a, b, c] = self.corner_positions(f).map(|p| p - center);
            a.dot(b.cross(c))
        };
        self.face_indices().map(six_volumes).sum::<f64>() / 6.0
    }

    /// Smallest box around all vertices.
    pub fn bounds(&self) -> BoundingBox {
        BoundingBox::of_points(self.positions())
    }

    /// Area-weighted unit vertex normals; zero where they cancel.
    pub fn vertex_normals(&self) -> Vec<DVec3> {
        let mut normals = vec![DVec3::ZERO; self.vertex_count()];
        for (f, corners) in self.face_indices().zip(self.faces()) {
            let cross = self.face_cross(f);
            for &v in corners {
                normals[v as usize] += cross;
            }
        }
        normals.into_iter().map(DVec3::normalize_or_zero).collect()
    }

    /// The same faces over moved vertices.
    #[must_use]
    pub fn map_positions(&self, f: impl Fn(DVec3) -> DVec3) -> Self {
        let positions = self.positions.iter().map(|&p| f(p)).collect();
        Self { positions: Arc::new(positions), faces: Arc::clone(&self.faces) }
    }
}
