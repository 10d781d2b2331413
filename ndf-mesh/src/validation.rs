//! What is wrong with a mesh, all of it at once.

use std::fmt;

use serde::Serialize;

use crate::{Face, Halfedge, Sides, TriangleMesh, first_in_place};

/// One kind of defect: how often it occurs and where first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Defect {
    /// Number of occurrences.
    pub count: usize,
    /// Index of the first vertex or face concerned, if any.
    pub first: Option<u32>,
}

impl Defect {
    fn note(&mut self, index: u32) {
        self.count += 1;
        self.first.get_or_insert(index);
    }
}

/// Everything there is to say about the topology of a mesh, gathered in one pass.
///
/// Elements are counted as follows. An edge is a pair of different vertices joined by some face. Faces that
/// name a vertex twice take no part in edges. Euler characteristic: referenced vertices − edges + faces that
/// take part. Components are joined through shared edges.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct ValidationReport {
    /// Number of vertices, unreferenced ones included.
    pub vertices: usize,
    /// Number of faces.
    pub faces: usize,
    /// Number of edges.
    pub edges: usize,
    /// Pieces connected through edges.
    pub components: usize,
    /// V − E + F.
    pub euler_characteristic: i64,
    /// Edges with one face.
    pub boundary_edges: usize,
    /// Closed chains of boundary edges; 0 unless the mesh is manifold.
    pub boundary_loops: usize,
    /// Edges with more than two faces (first: one of their vertices).
    pub nonmanifold_edges: Defect,
    /// The most faces any edge has.
    pub most_faces_at_an_edge: usize,
    /// Vertices whose faces form more than one fan, where all edges are manifold.
    pub nonmanifold_vertices: Defect,
    /// Edges with two faces that run along it in the same direction (first: one of their vertices).
    pub inconsistent_edges: Defect,
    /// Faces without area: a vertex named twice, corners in one place or on one line (first: face).
    pub degenerate_faces: Defect,
    /// Those of the degenerate faces that name a vertex twice; no topology can be made of them.
    pub repeated_corner_faces: Defect,
    /// Faces with the same three vertices as an earlier face, in any order.
    pub duplicate_faces: Defect,
    /// Vertices in exactly the same place as an earlier vertex.
    pub duplicate_vertices: Defect,
    /// Vertices no face names.
    pub unreferenced_vertices: Defect,
    /// Vertices with a coordinate that is NaN or infinite.
    pub nonfinite_vertices: Defect,
}

impl ValidationReport {
    /// Examines a mesh. O(n log n).
    pub fn of(mesh: &TriangleMesh) -> Self {
        let mut report = Self { vertices: mesh.vertex_count(), faces: mesh.face_count(), ..Self::default() };
        report.examine_vertices(mesh);
        let proper = report.examine_faces(mesh);
        let sides =
            Sides::of(mesh.vertex_count(), proper.iter().map(|&f| (Face(f), mesh.faces()[f as usize])));
        sides.repeated_faces(mesh.faces()).into_iter().for_each(|f| report.duplicate_faces.note(f.0));
        report.examine_edges(mesh, &proper, &sides);
        report
    }

    /// Whether a [`ManifoldMesh`](super::ManifoldMesh) can be made of the mesh.
    pub fn is_oriented_manifold(&self) -> bool {
        self.faces > 0
            && self.is_manifold()
            && self.inconsistent_edges.count == 0
            && self.unreferenced_vertices.count == 0
            && self.nonfinite_vertices.count == 0
    }

    /// Whether every edge has at most two faces and every vertex one fan, whatever the orientation.
    pub fn is_manifold(&self) -> bool {
        self.nonmanifold_edges.count == 0
            && self.nonmanifold_vertices.count == 0
            && self.repeated_corner_faces.count == 0
            && self.duplicate_faces.count == 0
    }

    /// Whether no edge is on a boundary.
    pub fn is_closed(&self) -> bool {
        self.boundary_edges == 0
    }

    /// Handles of a closed, connected manifold: (2 − χ) / 2.
    pub fn genus(&self) -> Option<i64> {
        let single = self.is_manifold() && self.is_closed() && self.components == 1;
        single.then_some((2 - self.euler_characteristic) / 2)
    }

    /// What keeps the mesh from being an oriented manifold, in words; empty if nothing does.
    pub fn manifold_defects(&self) -> String {
        let mut all = Vec::new();
        if self.faces == 0 {
            all.push("it has no faces".to_owned());
        }
        let mut say = |defect: Defect, singular: &str, plural: &str, place: &str| {
            if let Some(first) = defect.first {
                let what = if defect.count == 1 { singular } else { plural };
                all.push(format!("{} {what} ({place} {first})", defect.count));
            }
        };
        let vertex = |d: Defect| if d.count == 1 { "vertex" } else { "first: vertex" };
        let face = |d: Defect| if d.count == 1 { "face" } else { "first: face" };
        let d = self.nonfinite_vertices;
        say(
            d,
            "vertex with a coordinate that is NaN or infinite",
            "vertices with NaN or infinite coordinates",
            vertex(d),
        );
        let d = self.nonmanifold_edges;
        let many = self.most_faces_at_an_edge;
        let (one, more) = (format!("edge with {many} faces"), format!("edges with 3 to {many} faces"));
        let more = if many == 3 { "edges with three faces" } else { &more };
        say(d, &one, more, if d.count == 1 { "at vertex" } else { "first: at vertex" });
        let d = self.nonmanifold_vertices;
        say(
            d,
            "vertex where several fans of faces meet",
            "vertices where several fans of faces meet",
            vertex(d),
        );
        let d = self.inconsistent_edges;
        say(
            d,
            "edge whose two faces are oriented differently",
            "edges whose two faces are oriented differently",
            if d.count == 1 { "at vertex" } else { "first: at vertex" },
        );
        let d = self.repeated_corner_faces;
        say(d, "face that names a vertex twice", "faces that name a vertex twice", face(d));
        let d = self.duplicate_faces;
        say(d, "face that occurs twice", "faces that occur more than once", face(d));
        let d = self.unreferenced_vertices;
        say(d, "vertex that no face uses", "vertices that no face uses", vertex(d));
        all.join(", ")
    }

    fn examine_vertices(&mut self, mesh: &TriangleMesh) {
        for (v, p) in mesh.positions().iter().enumerate() {
            if !p.is_finite() {
                self.nonfinite_vertices.note(v as u32);
            }
        }
        let duplicates = (0..).zip(first_in_place(mesh.positions())).filter(|(v, first)| v != first);
        duplicates.for_each(|(v, _)| self.duplicate_vertices.note(v));

        let mut referenced = vec![false; mesh.vertex_count()];
        mesh.faces().iter().flatten().for_each(|&v| referenced[v as usize] = true);
        let unreferenced = referenced.iter().enumerate().filter(|(_, used)| !**used);
        unreferenced.for_each(|(v, _)| self.unreferenced_vertices.note(v as u32));
    }

    /// Counts faces and returns those that take part in the topology.
    fn examine_faces(&mut self, mesh: &TriangleMesh) -> Vec<u32> {
        let mut proper = Vec::with_capacity(mesh.face_count());
        for (face, &[a, b, c]) in mesh.face_indices().zip(mesh.faces()) {
            let f = face.0;
            if a == b || b == c || c == a {
                self.repeated_corner_faces.note(f);
                self.degenerate_faces.note(f);
            } else {
                proper.push(f);
                if mesh.face_cross(face).length_squared() == 0.0 {
                    self.degenerate_faces.note(f);
                }
            }
        }
        proper
    }

    fn examine_edges(&mut self, mesh: &TriangleMesh, proper: &[u32], sides: &Sides) {
        let tail = |h: Halfedge| mesh.faces().as_flattened()[h.index()];
        let mut faces_joined = DisjointSets::new(mesh.face_count());
        let mut corners_joined = DisjointSets::new(3 * mesh.face_count());
        let mut on_boundary = Vec::new();
        // Corners of one vertex that share an edge belong to one fan: those at the lower and at the higher end of a side.
        let ends = |low: u32, h: Halfedge| {
            let (tail, tip) = (h.index(), h.next().index());
            if mesh.faces().as_flattened()[tail] == low { [tail, tip] } else { [tip, tail] }
        };
        for (a, edge) in sides.edges() {
            self.edges += 1;
            self.most_faces_at_an_edge = self.most_faces_at_an_edge.max(edge.len());
            for pair in edge.windows(2) {
                let [h, g] = [pair[0].1, pair[1].1];
                faces_joined.join(h.face().index(), g.face().index());
                let ([low, high], [other_low, other_high]) = (ends(a, h), ends(a, g));
                corners_joined.join(low, other_low);
                corners_joined.join(high, other_high);
            }
            match *edge {
                [(b, _)] => on_boundary.push((a, b)),
                [(_, h), (_, g)] if tail(h) == tail(g) => self.inconsistent_edges.note(a),
                [_, _] => {}
                _ => self.nonmanifold_edges.note(a),
            }
        }
        self.boundary_edges = on_boundary.len();
        let roots = proper.iter().filter(|&&f| faces_joined.root(f as usize) == f as usize);
        self.components = roots.count();

        let mut fans = vec![0_u32; mesh.vertex_count()];
        for &f in proper {
            for (c, &v) in mesh.faces()[f as usize].iter().enumerate() {
                let corner = 3 * f as usize + c;
                fans[v as usize] += u32::from(corners_joined.root(corner) == corner);
            }
        }
        for (v, &n) in fans.iter().enumerate() {
            if n > 1 {
                self.nonmanifold_vertices.note(v as u32);
            }
        }
        let in_use = fans.iter().filter(|&&n| n > 0).count();
        self.euler_characteristic = in_use as i64 - self.edges as i64 + proper.len() as i64;
        if self.is_manifold() {
            let mut joined = DisjointSets::new(mesh.vertex_count());
            on_boundary.iter().for_each(|&(a, b)| joined.join(a as usize, b as usize));
            let mut loops: Vec<usize> = on_boundary.iter().map(|e| joined.root(e.0 as usize)).collect();
            loops.sort_unstable();
            loops.dedup();
            self.boundary_loops = loops.len();
        }
    }
}

impl fmt::Display for ValidationReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} vertices, {} faces, {} component{}, Euler characteristic {}",
            self.vertices,
            self.faces,
            self.components,
            if self.components == 1 { "" } else { "s" },
            self.euler_characteristic
        )?;
        if let Some(genus) = self.genus() {
            write!(f, " (closed, genus {genus})")?;
        } else if self.boundary_edges > 0 {
            write!(f, ", {} boundary edges", self.boundary_edges)?;
        }
        let defects = self.manifold_defects();
        if !defects.is_empty() {
            write!(f, "; not an oriented manifold: {defects}")?;
        }
        Ok(())
    }
}

/// Disjoint sets with path halving; the root is always the lowest member, so that results do not depend on
/// the order of joins.
pub(super) struct DisjointSets(Vec<u32>);

impl DisjointSets {
    pub(super) fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    pub(super) fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] as usize != i {
            self.0[i] = self.0[self.0[i] as usize];
            i = self.0[i] as usize;
        }
        i
    }

    pub(super) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b) as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes;
    use super::*;
    use ndf_core::DVec3;

    fn report(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> ValidationReport {
        let positions = positions.iter().map(|&p| DVec3::from_array(p)).collect();
        ValidationReport::of(&TriangleMesh::new(positions, faces.to_vec()).unwrap())
    }

    #[test]
    fn clean_shapes_have_nothing_to_report() {
        let r = ValidationReport::of(&shapes::torus(12, 8, 1.0, 0.3));
        assert!(r.is_oriented_manifold() && r.is_closed());
        assert_eq!((r.genus(), r.components, r.manifold_defects().as_str()), (Some(1), 1, ""));
        let r = ValidationReport::of(&shapes::grid(3, 2));
        assert_eq!((r.boundary_edges, r.boundary_loops, r.euler_characteristic), (10, 1, 1));
    }

    #[test]
    fn three_faces_at_an_edge() {
        let r = report(
            &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
            &[[0, 1, 2], [1, 0, 3], [0, 1, 4]],
        );
        assert_eq!(r.nonmanifold_edges, Defect { count: 1, first: Some(0) });
        assert!(!r.is_manifold());
        assert!(
            r.manifold_defects().contains("1 edge with 3 faces (at vertex 0)"),
            "{}",
            r.manifold_defects()
        );
    }

    #[test]
    fn two_fans_at_a_vertex() {
        let r = report(
            &[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, -1.0, 0.0]],
            &[[0, 1, 2], [0, 3, 4]],
        );
        assert_eq!(r.nonmanifold_vertices, Defect { count: 1, first: Some(0) });
        assert_eq!(r.components, 2);
    }

    #[test]
    fn every_other_defect_is_named() {
        let nan = f64::NAN;
        let r = report(
            &[
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [1.0, 1.0, 0.0],
                [2.0, 0.0, 0.0],
                [nan, 0.0, 0.0],
                [-0.0, 0.0, 0.0],
            ],
            &[[0, 1, 2], [1, 2, 3], [2, 1, 0], [0, 1, 4], [1, 1, 3]],
        );
        assert_eq!(r.inconsistent_edges.count, 0, "the edge 1–2 has three faces");
        assert_eq!(r.nonmanifold_edges.count, 2);
        assert_eq!(r.duplicate_faces, Defect { count: 1, first: Some(2) });
        assert_eq!(r.degenerate_faces, Defect { count: 2, first: Some(3) });
        assert_eq!(r.repeated_corner_faces, Defect { count: 1, first: Some(4) });
        assert_eq!(r.duplicate_vertices, Defect { count: 1, first: Some(6) });
        assert_eq!(r.unreferenced_vertices.count, 2);
        assert_eq!(r.nonfinite_vertices, Defect { count: 1, first: Some(5) });
        assert!(!r.is_oriented_manifold());
    }

    #[test]
    fn flipped_face_is_inconsistent() {
        let r =
            report(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]], &[[0, 1, 2], [1, 2, 3]]);
        assert_eq!(r.inconsistent_edges, Defect { count: 1, first: Some(1) });
        assert!(r.is_manifold() && !r.is_oriented_manifold());
    }

    #[test]
    fn no_faces_is_said() {
        assert_eq!(report(&[], &[]).manifold_defects(), "it has no faces");
    }
}
