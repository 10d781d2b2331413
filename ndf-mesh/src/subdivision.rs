//! Loop subdivision (Loop 1987): every triangle becomes four, and every vertex of the finer mesh is a weighted mean of a
//! few of the coarser one.
//!
//! [`Refinement`] is the connectivity of one level, in a numbering that follows from the faces alone: edges are numbered
//! as the faces name them, face by face and side by side. The new vertex of edge e has the number `vertices + e`. The weights are
//! those of Loop in the interior with the weights of Warren (1995) around vertices, those of a cubic
//! spline on the boundary (Hoppe et al. 1994), so that a boundary is a smooth curve that does not depend on the interior.

use ndf_core::DVec3;

use crate::ManifoldMesh;

/// No vertex: an edge of the boundary has but one face.
pub const NONE: u32 = u32::MAX;

/// An edge of a [`Refinement`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    /// The vertices that it joins, in the order in which its first face runs along it.
    pub ends: [u32; 2],
    /// The third vertices of its first and its second face; the latter is [`NONE`] on the boundary.
    pub across: [u32; 2],
}

impl Side {
    /// Whether it has but one face.
    pub fn is_boundary(&self) -> bool {
        self.across[1] == NONE
    }
}

/// The connectivity of a mesh, to be refined again and again.
#[derive(Clone, Debug)]
pub struct Refinement {
    vertex_count: usize,
    faces: Vec<[u32; 3]>,
    face_edges: Vec<[u32; 3]>,
    edges: Vec<Side>,
    /// Of every vertex: its number of edges, and whether it is on the boundary.
    rings: Vec<Ring>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Ring {
    degree: u32,
    is_boundary: bool,
}

impl Refinement {
    /// The connectivity of a mesh itself. O(n).
    pub fn from_mesh(mesh: &ManifoldMesh) -> Self {
        let topology = mesh.topology();
        let provisional = topology.faces().map(|f| topology.face_edges(f).map(u32::from)).collect();
        Self::numbered(mesh.vertex_count(), mesh.faces().to_vec(), provisional, topology.edge_count())
    }

    /// Numbers edges as the faces name them.
    fn numbered(
        vertex_count: usize,
        faces: Vec<[u32; 3]>,
        mut face_edges: Vec<[u32; 3]>,
        edge_count: usize,
    ) -> Self {
        let mut numbers = vec![NONE; edge_count];
        let mut edges: Vec<Side> = Vec::with_capacity(edge_count);
        let mut rings = vec![Ring::default(); vertex_count];
        for (face, sides) in faces.iter().zip(&mut face_edges) {
            for (c, side) in sides.iter_mut().enumerate() {
                let number = &mut numbers[*side as usize];
                let third = face[(c + 2) % 3];
                if *number == NONE {
                    *number = edges.len() as u32;
                    let ends = [face[c], face[(c + 1) % 3]];
                    ends.into_iter().for_each(|v| rings[v as usize].degree += 1);
                    edges.push(Side { ends, across: [third, NONE] });
                } else {
                    edges[*number as usize].across[1] = third;
                }
                *side = *number;
            }
        }
        for side in edges.iter().filter(|side| side.is_boundary()) {
            side.ends.into_iter().for_each(|v| rings[v as usize].is_boundary = true);
        }
        Self { vertex_count, faces, face_edges, edges, rings }
    }

    /// The next level: faces 4 f, …, 4 f + 2 lie at corners 0, 1, 2 of face f and begin their corners there with the same number;
    /// face 4 f + 3 is the one between, its corners on sides 0, 1, 2. O(n).
    #[must_use]
    pub fn refined(&self) -> Self {
        let (v, e) = (self.vertex_count as u32, self.edges.len() as u32);
        let mut faces = Vec::with_capacity(4 * self.faces.len());
        let mut face_edges = Vec::with_capacity(4 * self.faces.len());
        for (f, (&[a, b, c], &sides)) in (0..).zip(self.faces.iter().zip(&self.face_edges)) {
            let [ab, bc, ca] = sides.map(|s| v + s);
            faces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            // The half of a side that begins at this corner, and the side that cuts off corner k.
            let half =
                |k: usize, end: u32| 2 * sides[k] + u32::from(self.edges[sides[k] as usize].ends[0] != end);
            let cut = |k: u32| 2 * e + 3 * f + k;
            face_edges.extend([
                [half(0, a), cut(0), half(2, a)],
                [half(0, b), half(1, b), cut(1)],
                [cut(2), half(1, c), half(2, c)],
                [cut(1), cut(2), cut(0)],
            ]);
        }
        let edge_count = 2 * self.edges.len() + 3 * self.faces.len();
        Self::numbered(self.vertex_count + self.edges.len(), faces, face_edges, edge_count)
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Corners of the faces.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Edges of the faces: side c runs from corner c to the next.
    pub fn face_edges(&self) -> &[[u32; 3]] {
        &self.face_edges
    }

    /// The edges, in the order of their new vertices.
    pub fn edges(&self) -> &[Side] {
        &self.edges
    }

    /// Positions of the vertices of the next level: first those of this level, smoothed, then those of its edges. O(n).
    ///
    /// # Panics
    /// If the number of positions is not that of the vertices.
    pub fn subdivide(&self, positions: &[DVec3]) -> Vec<DVec3> {
        assert_eq!(positions.len(), self.vertex_count);
        let mut finer = vec![DVec3::ZERO; self.vertex_count + self.edges.len()];
        self.subdivision_entries(|row, column, weight| {
            finer[row as usize] += weight * positions[column as usize];
        });
        finer
    }

    /// Where the vertices end when subdivision goes on for ever. O(n).
    ///
    /// # Panics
    /// If the number of positions is not that of the vertices.
    pub fn limit(&self, positions: &[DVec3]) -> Vec<DVec3> {
        assert_eq!(positions.len(), self.vertex_count);
        let mut limit = vec![DVec3::ZERO; self.vertex_count];
        self.limit_entries(|row, column, weight| limit[row as usize] += weight * positions[column as usize]);
        limit
    }

    /// Calls `entry(row, column, weight)` for every weight of [`subdivide`](Self::subdivide): rows are vertices of the
    /// next level, columns of this one.
    pub fn subdivision_entries(&self, mut entry: impl FnMut(u32, u32, f64)) {
        self.smoothing_entries(Weights::subdivision, &mut entry);
        for (row, side) in (self.vertex_count as u32..).zip(&self.edges) {
            let (end, across) = if side.is_boundary() { (0.5, 0.0) } else { (0.375, 0.125) };
            side.ends.into_iter().for_each(|v| entry(row, v, end));
            side.across.into_iter().filter(|_| across > 0.0).for_each(|v| entry(row, v, across));
        }
    }

    /// The same for [`limit`](Self::limit).
    pub fn limit_entries(&self, mut entry: impl FnMut(u32, u32, f64)) {
        self.smoothing_entries(Weights::limit, &mut entry);
    }

    fn smoothing_entries(&self, weights: fn(Ring) -> Weights, entry: &mut impl FnMut(u32, u32, f64)) {
        let weights: Vec<Weights> = self.rings.iter().map(|&ring| weights(ring)).collect();
        (0..).zip(&weights).for_each(|(v, weights)| entry(v, v, weights.own));
        for side in &self.edges {
            let [a, b] = side.ends;
            for (v, w) in [(a, b), (b, a)] {
                if side.is_boundary() || !self.rings[v as usize].is_boundary {
                    entry(v, w, weights[v as usize].ring);
                }
            }
        }
    }

    /// Unit normals of the vertices: the normalised sum of the cross products of their faces, or zero. O(n).
    ///
    /// # Panics
    /// If the number of positions is not that of the vertices.
    pub fn normals(&self, positions: &[DVec3]) -> Vec<DVec3> {
        assert_eq!(positions.len(), self.vertex_count);
        let mut normals = vec![DVec3::ZERO; positions.len()];
        for face in &self.faces {
            let [a, b, c] = face.map(|v| positions[v as usize]);
            let cross = (b - a).cross(c - a);
            face.iter().for_each(|&v| normals[v as usize] += cross);
        }
        normals.iter_mut().for_each(|n| *n = n.normalize_or_zero());
        normals
    }
}

/// Weights of a vertex and of each vertex of its ring (on the boundary: of its two neighbours there).
#[derive(Clone, Copy, Debug)]
struct Weights {
    own: f64,
    ring: f64,
}

impl Weights {
    /// Warren's β: the limit surface is smooth around vertices of every degree.
    fn beta(degree: u32) -> f64 {
        if degree == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * f64::from(degree.max(1))) }
    }

    fn subdivision(Ring { degree, is_boundary }: Ring) -> Self {
        if is_boundary {
            return Self { own: 0.75, ring: 0.125 };
        }
        let beta = Self::beta(degree);
        Self { own: 1.0 - f64::from(degree) * beta, ring: beta }
    }

    /// The left eigenvector of the rule for the eigenvalue 1.
    fn limit(Ring { degree, is_boundary }: Ring) -> Self {
        if is_boundary {
            return Self { own: 2.0 / 3.0, ring: 1.0 / 6.0 };
        }
        let ring = 1.0 / (3.0 / (8.0 * Self::beta(degree)) + f64::from(degree));
        Self { own: 1.0 - f64::from(degree) * ring, ring }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    fn shapes() -> Vec<ManifoldMesh> {
        let shapes =
            [shapes::icosphere(1), shapes::torus(9, 6, 1.0, 0.4), shapes::grid(5, 3), shapes::cube(2)];
        shapes.into_iter().map(|mesh| ManifoldMesh::try_from(mesh).unwrap()).collect()
    }

    #[test]
    fn levels_are_manifolds_with_the_numbers_their_faces_give() {
        for mesh in shapes() {
            let mut level = Refinement::from_mesh(&mesh);
            let mut positions = mesh.positions().to_vec();
            for _ in 0..3 {
                positions = level.subdivide(&positions);
                level = level.refined();
                let faces = level.faces().to_vec();
                let finer =
                    ManifoldMesh::try_from(crate::TriangleMesh::new(positions.clone(), faces).unwrap())
                        .unwrap();
                let anew = Refinement::from_mesh(&finer);
                assert_eq!(anew.edges, level.edges);
                assert_eq!(anew.face_edges, level.face_edges);
                assert_eq!(finer.topology().euler_characteristic(), mesh.topology().euler_characteristic());
                for (face, sides) in level.faces.iter().zip(&level.face_edges) {
                    for c in 0..3 {
                        let mut ends = level.edges[sides[c] as usize].ends;
                        let mut side = [face[c], face[(c + 1) % 3]];
                        ends.sort_unstable();
                        side.sort_unstable();
                        assert_eq!(ends, side);
                    }
                }
            }
        }
    }

    #[test]
    fn the_limit_is_where_subdivision_goes() {
        for mesh in shapes() {
            let mut level = Refinement::from_mesh(&mesh);
            let mut positions = mesh.positions().to_vec();
            let limit = level.limit(&positions);
            for _ in 0..4 {
                // The limit of a vertex does not depend on the level at which it is taken.
                positions = level.subdivide(&positions);
                level = level.refined();
                for (a, b) in limit.iter().zip(level.limit(&positions)) {
                    assert!((*a - b).length() < 1e-13);
                }
            }
        }
    }

    /// A plane stays a plane, and a regular mesh over it stays where it is: the rules reproduce linear functions.
    #[test]
    fn planes_are_kept() {
        let mesh = ManifoldMesh::try_from(shapes::grid(6, 6)).unwrap();
        let finer = Refinement::from_mesh(&mesh).subdivide(mesh.positions());
        assert!(finer.iter().all(|p| p.z.abs() < 1e-15));
    }
}
