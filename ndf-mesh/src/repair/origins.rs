//! Which faces and vertices of a mesh those of a repaired one come from.

use std::collections::HashMap;

use ndf_core::DVec3;

use crate::{Face, FacePoint, TriangleMesh, Vertex};

/// Where the faces and vertices of a working mesh come from, hence where what is found on it belongs.
///
/// Every face of the working mesh is one of the original, perhaps turned. A vertex of the original is none of the working
/// mesh if no face that was kept uses it, and may be several where faces that met in it were separated; several of the
/// original may be one of the working mesh, where a seam was joined.
#[derive(Clone, Debug, PartialEq)]
pub struct Origins {
    /// Face by face of the working mesh: the face of the original, and whether it was turned.
    faces: Vec<(Face, bool)>,
    /// Where in `vertices` those of every vertex of the original begin; one more at the end.
    begin: Vec<u32>,
    /// Vertices of the working mesh.
    vertices: Vec<Vertex>,
    /// Vertices of the working mesh that are one place, group by group.
    separated: Vec<Vec<Vertex>>,
}

impl Origins {
    /// A working mesh whose faces are these of the original, corner by corner in the same order, or with the second and
    /// third exchanged where turned. `places` has, for every face of the original, corners with the same number where they
    /// are one.
    pub(super) fn new(
        original: &TriangleMesh,
        places: &[[u32; 3]],
        working: &TriangleMesh,
        faces: Vec<(Face, bool)>,
    ) -> Self {
        let mut pairs = pairs(original.faces(), working, &faces);
        if add_coincident(original, &mut pairs) {
            pairs.sort_unstable();
        }
        let mut begin = vec![0_u32; original.vertex_count() + 1];
        pairs.iter().for_each(|pair| begin[pair.0 as usize + 1] += 1);
        for v in 0..original.vertex_count() {
            begin[v + 1] += begin[v];
        }
        let vertices = pairs.into_iter().map(|pair| Vertex(pair.1)).collect();
        let separated = self::pairs(places, working, &faces)
            .chunk_by(|a, b| a.0 == b.0)
            .filter(|group| group.len() > 1)
            .map(|group| group.iter().map(|pair| Vertex(pair.1)).collect())
            .collect();
        Self { faces, begin, vertices, separated }
    }

    /// A working mesh that is the original.
    pub(super) fn same(mesh: &TriangleMesh) -> Self {
        let vertices = mesh.vertex_count() as u32;
        Self {
            faces: mesh.face_indices().map(|face| (face, false)).collect(),
            begin: (0..=vertices).collect(),
            vertices: (0..vertices).map(Vertex).collect(),
            separated: Vec::new(),
        }
    }

    /// The vertices of the working mesh that a vertex of the original has become; none if no face that was kept uses it.
    ///
    /// # Panics
    /// If the original has no such vertex.
    pub fn of_vertex(&self, original: Vertex) -> &[Vertex] {
        let [begin, end] = [0, 1].map(|k| self.begin[original.index() + k] as usize);
        &self.vertices[begin..end]
    }

    /// How many vertices the original has.
    pub fn vertex_count(&self) -> usize {
        self.begin.len() - 1
    }

    /// The vertices of the original that no face that was kept uses.
    pub fn unused(&self) -> impl Iterator<Item = Vertex> {
        (0..self.vertex_count()).map(Vertex::new).filter(|&v| self.of_vertex(v).is_empty())
    }

    /// Vertices of the working mesh that are one in the original, or were joined there, group by group.
    pub fn separated(&self) -> impl Iterator<Item = &[Vertex]> {
        self.separated.iter().map(Vec::as_slice)
    }

    /// A point of the working mesh as one of the original.
    ///
    /// # Panics
    /// If the working mesh has no such face.
    pub fn point(&self, FacePoint { face, barycentric: [a, b, c] }: FacePoint) -> FacePoint {
        let (face, turned) = self.faces[face.index()];
        FacePoint { face, barycentric: if turned { [a, c, b] } else { [a, b, c] } }
    }

    /// The points of the working mesh that lie over one of the original. O(n).
    pub fn over(&self, FacePoint { face, barycentric: [a, b, c] }: FacePoint) -> Vec<FacePoint> {
        let over = self.faces.iter().enumerate().filter(|(_, (of, _))| *of == face);
        let point = |(working, &(_, turned)): (usize, &(Face, bool))| {
            let barycentric = if turned { [a, c, b] } else { [a, b, c] };
            FacePoint { face: Face::new(working), barycentric }
        };
        over.map(point).collect()
    }

    /// Values at the vertices of the original from those of the working mesh: where a vertex has become several, the
    /// `chosen` of their values, and `unused` where it has become none.
    pub fn values<T: Copy>(&self, working: &[T], unused: T, chosen: impl Fn(T, T) -> T) -> Vec<T> {
        let value = |v| {
            let values = self.of_vertex(Vertex::new(v)).iter().map(|w| working[w.index()]);
            values.reduce(&chosen).unwrap_or(unused)
        };
        (0..self.vertex_count()).map(value).collect()
    }
}

/// Corners before and vertices of the working mesh that they have become, sorted and each pair once.
fn pairs(before: &[[u32; 3]], working: &TriangleMesh, faces: &[(Face, bool)]) -> Vec<(u32, u32)> {
    let mut pairs: Vec<(u32, u32)> = Vec::with_capacity(3 * faces.len());
    for (&(face, turned), corners) in faces.iter().zip(working.faces()) {
        let [a, mut b, mut c] = before[face.index()];
        if turned {
            (b, c) = (c, b);
        }
        pairs.extend([a, b, c].into_iter().zip(*corners));
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Adds vertices whose faces all fell together to a line, where another vertex in the same place is left. Says whether there
/// are any.
fn add_coincident(original: &TriangleMesh, pairs: &mut Vec<(u32, u32)>) -> bool {
    let mut wanted = vec![false; original.vertex_count()];
    original.faces().iter().flatten().for_each(|&v| wanted[v as usize] = true);
    pairs.iter().for_each(|pair| wanted[pair.0 as usize] = false);
    if !wanted.contains(&true) {
        return false;
    }
    let key = |v: u32| (original.positions()[v as usize] + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut at: HashMap<[u64; 3], u32> = HashMap::new();
    pairs.iter().for_each(|&(v, working)| {
        at.entry(key(v)).or_insert(working);
    });
    let wanted = (0..original.vertex_count() as u32).filter(|&v| wanted[v as usize]);
    let before = pairs.len();
    pairs.extend(wanted.filter_map(|v| at.get(&key(v)).map(|&working| (v, working))).collect::<Vec<_>>());
    pairs.len() > before
}
