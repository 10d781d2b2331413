//! Loop subdivision (Loop 1987): every triangle becomes four, and every vertex of the finer mesh is a weighted mean of a
//! few of the coarser one.
//!
//! [`Refinement`] is the connectivity of one level, in a numbering that follows from the faces alone: edges are numbered
//! as the faces name them, face by face and side by side. The new vertex of edge e has the number `vertices + e`. The
//! weights are those of Loop in the interior with the weights of Warren (1995) around vertices, and those of a cubic
//! spline on the boundary and on [creases](Creases) (Hoppe et al. 1994): these are smooth curves that do not depend on
//! the rest. Corners stay where they are.

mod creases;
#[cfg(test)]
mod tests;

use ndf_core::DVec3;
use rayon::prelude::*;

use crate::ManifoldMesh;

pub use creases::Creases;

/// No vertex: an edge of the boundary has but one face.
pub const NONE: u32 = u32::MAX;

/// An edge of a [`Refinement`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    /// The vertices that it joins, in the order in which its first face runs along it.
    pub ends: [u32; 2],
    /// The third vertices of its first and its second face; the latter is [`NONE`] on the boundary.
    pub across: [u32; 2],
    /// Whether it is a crease or on the boundary.
    pub is_sharp: bool,
}

impl Side {
    /// Whether it has but one face.
    pub fn is_boundary(&self) -> bool {
        self.across[1] == NONE
    }

    /// Weights of its ends and of the vertices across it in its new vertex.
    fn weights(&self) -> (f64, f64) {
        if self.is_sharp { (0.5, 0.0) } else { (0.375, 0.125) }
    }
}

/// Edges or vertices that a thread takes at a time.
const GRAIN: usize = 4096;

/// The connectivity of a mesh, to be refined again and again.
#[derive(Clone, Debug)]
pub struct Refinement {
    vertex_count: usize,
    faces: Vec<[u32; 3]>,
    face_edges: Vec<[u32; 3]>,
    edges: Vec<Side>,
    /// By vertex.
    rings: Vec<Ring>,
}

/// What counts of the edges around a vertex.
#[derive(Clone, Copy, Debug, Default)]
struct Ring {
    degree: u32,
    kind: Kind,
}

/// The rule of a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Kind {
    /// In the interior, or where a crease ends.
    #[default]
    Smooth,
    /// On a curve of two sharp edges.
    Crease,
    /// It stays where it is.
    Corner,
}

impl Refinement {
    /// The connectivity of a mesh itself, without creases. O(n).
    pub fn from_mesh(mesh: &ManifoldMesh) -> Self {
        let topology = mesh.topology();
        let provisional = topology.faces().map(|f| topology.face_edges(f).map(u32::from)).collect();
        let mut level =
            Self::numbered(mesh.vertex_count(), mesh.faces().to_vec(), provisional, topology.edge_count());
        level.set_kinds(|_| false);
        level
    }

    /// The same with these creases. O(n).
    ///
    /// # Panics
    /// If the creases are those of a mesh of another connectivity.
    #[must_use]
    pub fn with_creases(mut self, creases: &Creases) -> Self {
        for (e, side) in self.edges.iter_mut().enumerate() {
            side.is_sharp |= creases.is_crease(e);
        }
        self.set_kinds(|v| creases.is_corner(v));
        self
    }

    /// Number of sharp edges of every vertex.
    fn sharp_counts(&self) -> Vec<u32> {
        let mut counts = vec![0; self.vertex_count];
        for side in self.edges.iter().filter(|side| side.is_sharp) {
            side.ends.into_iter().for_each(|v| counts[v as usize] += 1);
        }
        counts
    }

    fn set_kinds(&mut self, is_corner: impl Fn(usize) -> bool) {
        for (v, count) in self.sharp_counts().into_iter().enumerate() {
            self.rings[v].kind = match count {
                0 | 1 => Kind::Smooth,
                2 if !is_corner(v) => Kind::Crease,
                _ => Kind::Corner,
            };
        }
    }

    /// Numbers edges as the faces name them. Edges on the boundary alone are sharp, and all vertices smooth.
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
                    edges.push(Side { ends, across: [third, NONE], is_sharp: true });
                } else {
                    let edge = &mut edges[*number as usize];
                    (edge.across[1], edge.is_sharp) = (third, false);
                }
                *side = *number;
            }
        }
        Self { vertex_count, faces, face_edges, edges, rings }
    }

    /// The next level: faces 4 f, …, 4 f + 2 lie at corners 0, 1, 2 of face f and begin their corners there with the
    /// same number; face 4 f + 3 is the one between, its corners on sides 0, 1, 2. O(n).
    #[must_use]
    pub fn refined(&self) -> Self {
        let (v, e) = (self.vertex_count as u32, self.edges.len() as u32);
        let faces = self.refined_faces();
        let mut face_edges = Vec::with_capacity(4 * self.faces.len());
        for (f, (&[a, b, c], &sides)) in (0..).zip(self.faces.iter().zip(&self.face_edges)) {
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
        let mut finer = Self::numbered(self.vertex_count + self.edges.len(), faces, face_edges, edge_count);
        let (old, new) = finer.rings.split_at_mut(self.vertex_count);
        old.iter_mut().zip(&self.rings).for_each(|(ring, old)| ring.kind = old.kind);
        for (ring, side) in new.iter_mut().zip(&self.edges) {
            ring.kind = if side.is_sharp { Kind::Crease } else { Kind::Smooth };
        }
        if self.has_creases() {
            // The halves of a crease begin or end at the vertex in its middle, and at one of its own.
            for side in &mut finer.edges {
                let [a, b] = side.ends;
                let of = |middle: u32, end: u32| {
                    let parent = middle.checked_sub(v).map(|e| &self.edges[e as usize]);
                    parent.is_some_and(|parent| parent.is_sharp && parent.ends.contains(&end))
                };
                side.is_sharp |= of(a, b) || of(b, a);
            }
        }
        finer
    }

    /// Corners of the faces of the next level, as [`refined`](Self::refined) has them. O(n).
    pub fn refined_faces(&self) -> Vec<[u32; 3]> {
        let v = self.vertex_count as u32;
        let of = |(&[a, b, c], sides): (&[u32; 3], &[u32; 3])| {
            let [ab, bc, ca] = sides.map(|s| v + s);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        self.faces.par_iter().zip(&self.face_edges).with_min_len(GRAIN).flat_map_iter(of).collect()
    }

    /// Where the vertices of the next level end, by their positions there: as its own [`limit`](Self::limit) up to rounding,
    /// without its connectivity. O(n).
    ///
    /// # Panics
    /// If the number of positions is not that of the vertices of the next level.
    pub fn refined_limit(&self, finer: &[DVec3]) -> Vec<DVec3> {
        assert_eq!(finer.len(), self.vertex_count + self.edges.len());
        let (old, new) = finer.split_at(self.vertex_count);
        // The neighbours of an old vertex are in the middles of its edges.
        let weights: Vec<Weights> = self.rings.iter().map(|&ring| Weights::limit(ring)).collect();
        let mut limit = Vec::with_capacity(finer.len());
        limit.extend(old.iter().zip(&weights).map(|(&p, weights)| weights.own * p));
        for (side, &middle) in self.edges.iter().zip(new) {
            for v in side.ends.into_iter().filter(|&v| self.counts(v, side)) {
                limit[v as usize] += weights[v as usize].ring * middle;
            }
        }
        // Those of a new one are the ends of its edge, and in the middles of the other sides of both faces.
        let mut beside = vec![DVec3::ZERO; new.len()];
        for sides in &self.face_edges {
            let [p, q, r] = sides.map(|e| new[e as usize]);
            for (&e, sum) in sides.iter().zip([q + r, r + p, p + q]) {
                beside[e as usize] += sum;
            }
        }
        let [smooth, crease] =
            [Kind::Smooth, Kind::Crease].map(|kind| Weights::limit(Ring { degree: 6, kind }));
        let middle = |((side, &middle), beside): ((&Side, &DVec3), DVec3)| {
            let [a, b] = side.ends.map(|v| old[v as usize]);
            match side.is_sharp {
                true => crease.own * middle + crease.ring * (a + b),
                false => smooth.own * middle + smooth.ring * (a + b + beside),
            }
        };
        limit.par_extend(self.edges.par_iter().zip(new).zip(beside).with_min_len(GRAIN).map(middle));
        limit
    }

    /// Unit normals of the vertices of the next level, as its own [`normals`](Self::normals) up to rounding, without its
    /// connectivity. O(n).
    ///
    /// # Panics
    /// If the number of positions is not that of the vertices of the next level.
    pub fn refined_normals(&self, finer: &[DVec3]) -> Vec<DVec3> {
        assert_eq!(finer.len(), self.vertex_count + self.edges.len());
        let mut normals = vec![DVec3::ZERO; finer.len()];
        let cross = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a);
        for (&[a, b, c], sides) in self.faces.iter().zip(&self.face_edges) {
            let [ab, bc, ca] = sides.map(|e| self.vertex_count + e as usize);
            let [a, b, c] = [a, b, c].map(|v| v as usize);
            let [p, q, r] = [ab, bc, ca].map(|v| finer[v]);
            let at = [cross(finer[a], p, r), cross(p, finer[b], q), cross(r, q, finer[c])];
            let between = cross(p, q, r);
            [a, b, c].into_iter().zip(at).for_each(|(v, n)| normals[v] += n);
            normals[ab] += at[0] + at[1] + between;
            normals[bc] += at[1] + at[2] + between;
            normals[ca] += at[2] + at[0] + between;
        }
        normals.par_iter_mut().with_min_len(GRAIN).for_each(|n| *n = n.normalize_or_zero());
        normals
    }

    /// Whether there are creases.
    pub fn has_creases(&self) -> bool {
        self.edges.iter().any(|side| side.is_sharp && !side.is_boundary())
    }

    /// The tangents of creases and boundaries at their vertices, from the neighbours there; zero for other vertices and
    /// corners.
    ///
    /// # Panics
    /// If the number of positions is not that of the vertices.
    pub fn crease_tangents(&self, positions: &[DVec3]) -> Vec<DVec3> {
        assert_eq!(positions.len(), self.vertex_count);
        let mut ends = vec![[NONE; 2]; self.vertex_count];
        for side in self.edges.iter().filter(|side| side.is_sharp) {
            let [a, b] = side.ends;
            for (v, w) in [(a, b), (b, a)] {
                let list = &mut ends[v as usize];
                list[usize::from(list[0] != NONE)] = w;
            }
        }
        let tangent = |(&[a, b], ring): (&[u32; 2], &Ring)| match ring.kind {
            Kind::Crease => (positions[b as usize] - positions[a as usize]).normalize_or_zero(),
            Kind::Smooth | Kind::Corner => DVec3::ZERO,
        };
        ends.iter().zip(&self.rings).map(tangent).collect()
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
        let mut finer = Vec::with_capacity(self.vertex_count + self.edges.len());
        finer.resize(self.vertex_count, DVec3::ZERO);
        self.smoothing_entries(Weights::subdivision, &mut |row, column, weight| {
            finer[row as usize] += weight * positions[column as usize];
        });
        let middle = |side: &Side| {
            let (end, across) = side.weights();
            let at =
                |v: u32, weight: f64| if weight > 0.0 { weight * positions[v as usize] } else { DVec3::ZERO };
            let ([a, b], [c, d]) = (side.ends, side.across);
            at(a, end) + at(b, end) + at(c, across) + at(d, across)
        };
        finer.par_extend(self.edges.par_iter().with_min_len(GRAIN).map(middle));
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
            let (end, across) = side.weights();
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
                if self.counts(v, side) {
                    entry(v, w, weights[v as usize].ring);
                }
            }
        }
    }

    /// Whether an edge counts in the rule of its end `v`.
    fn counts(&self, v: u32, side: &Side) -> bool {
        match self.rings[v as usize].kind {
            Kind::Smooth => true,
            Kind::Crease => side.is_sharp,
            Kind::Corner => false,
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

/// Weights of a vertex and of each vertex of its ring (on a crease: of its two neighbours there).
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

    fn subdivision(Ring { degree, kind }: Ring) -> Self {
        match kind {
            Kind::Smooth => {
                let beta = Self::beta(degree);
                Self { own: 1.0 - f64::from(degree) * beta, ring: beta }
            }
            Kind::Crease => Self { own: 0.75, ring: 0.125 },
            Kind::Corner => Self { own: 1.0, ring: 0.0 },
        }
    }

    /// The left eigenvector of the rule for the eigenvalue 1. Where a crease ends, that of a vertex without it, which differs
    /// by little.
    fn limit(Ring { degree, kind }: Ring) -> Self {
        match kind {
            Kind::Smooth => {
                let ring = 1.0 / (3.0 / (8.0 * Self::beta(degree)) + f64::from(degree));
                Self { own: 1.0 - f64::from(degree) * ring, ring }
            }
            Kind::Crease => Self { own: 2.0 / 3.0, ring: 1.0 / 6.0 },
            Kind::Corner => Self { own: 1.0, ring: 0.0 },
        }
    }
}
