//! The sides of faces, gathered by their edges.

use crate::halfedge::NO_HALFEDGE;
use crate::{Face, Halfedge};

/// The half-edges of faces in the order of their edges: by the lower vertex, then the higher, then the half-edges' own numbers.
///
/// What is found of edges without a topology begins here. A counting sort by the lower vertex leaves a few half-edges for each,
/// which are sorted apart: O(n log degree), a fraction of the time of a sort of all.
#[derive(Clone, Debug)]
pub struct Sides {
    /// Where the sides of every lower vertex begin; one more at the end.
    starts: Vec<u32>,
    /// Higher vertex and half-edge.
    sides: Vec<(u32, Halfedge)>,
}

impl Sides {
    /// The sides of some faces with these corners, which are less than `vertices`.
    pub fn of(vertices: usize, faces: impl Iterator<Item = (Face, [u32; 3])> + Clone) -> Self {
        let each = |(face, [a, b, c]): (Face, [u32; 3])| {
            let [ab, bc, ca] = face.halfedges();
            [(a, b, ab), (b, c, bc), (c, a, ca)].map(|(p, q, h)| (p.min(q), p.max(q), h))
        };
        let mut starts = vec![0_u32; vertices + 1];
        for (low, ..) in faces.clone().flat_map(each) {
            starts[low as usize] += 1;
        }
        let mut end = 0;
        for start in &mut starts {
            end += std::mem::replace(start, end);
        }
        let mut sides = vec![(0, NO_HALFEDGE); end as usize];
        for (low, high, h) in faces.flat_map(each) {
            let next = &mut starts[low as usize];
            sides[*next as usize] = (high, h);
            *next += 1;
        }
        // Every start is now the next one.
        starts.rotate_right(1);
        starts[0] = 0;
        for range in starts.windows(2) {
            sides[range[0] as usize..range[1] as usize].sort_unstable();
        }
        Self { starts, sides }
    }

    /// The lower vertex of every edge, and of its sides the higher vertex and the half-edge.
    pub fn edges(&self) -> impl Iterator<Item = (u32, &[(u32, Halfedge)])> {
        (0..).zip(self.starts.windows(2)).flat_map(|(low, range)| {
            let sides = &self.sides[range[0] as usize..range[1] as usize];
            sides.chunk_by(|a, b| a.0 == b.0).map(move |edge| (low, edge))
        })
    }

    /// The twin of every half-edge of faces with these corners ([`NO_HALFEDGE`] on the boundary), if every edge has one side or two
    /// that run in opposite directions.
    pub fn twins(&self, faces: &[[u32; 3]]) -> Option<Vec<Halfedge>> {
        let tails = faces.as_flattened();
        let mut twins = vec![NO_HALFEDGE; tails.len()];
        for (low, edge) in self.edges() {
            match *edge {
                [(high, _)] if high != low => {}
                [(high, h), (_, g)] if high != low => {
                    if (tails[h.index()] == low) == (tails[g.index()] == low) {
                        return None;
                    }
                    twins[h.index()] = g;
                    twins[g.index()] = h;
                }
                _ => return None,
            }
        }
        Some(twins)
    }

    /// Those of the faces with these corners that have the same three corners as one before, in any order; in ascending order.
    pub fn repeated_faces(&self, faces: &[[u32; 3]]) -> Vec<Face> {
        let mut repeated = Vec::new();
        let mut opposite = Vec::new();
        for (_, edge) in self.edges().filter(|(_, edge)| edge.len() > 1) {
            // Every face counts at the edge of its lower two corners.
            let highest = |&(high, h): &(u32, Halfedge)| {
                let corner = faces[h.face().index()][h.previous().corner()];
                (corner > high).then_some((corner, h.face()))
            };
            opposite.clear();
            opposite.extend(edge.iter().filter_map(highest));
            opposite.sort_unstable();
            repeated.extend(opposite.windows(2).filter(|pair| pair[0].0 == pair[1].0).map(|pair| pair[1].1));
        }
        repeated.sort_unstable();
        repeated
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{TriangleMesh, shapes};

    fn of(mesh: &TriangleMesh) -> Sides {
        Sides::of(mesh.vertex_count(), mesh.face_indices().zip(mesh.faces().iter().copied()))
    }

    #[test]
    fn sides_are_in_the_order_of_a_sort() {
        for mesh in [shapes::icosphere(3), shapes::grid(5, 3), shapes::moebius_strip(9, 2)] {
            let mut expected = Vec::new();
            for (f, corners) in mesh.face_indices().zip(mesh.faces()) {
                for h in f.halfedges() {
                    let (p, q) = (corners[h.corner()], corners[h.next().corner()]);
                    expected.push((p.min(q), p.max(q), h));
                }
            }
            expected.sort_unstable();
            let sides = of(&mesh);
            let found =
                sides.edges().flat_map(|(low, edge)| edge.iter().map(move |&(high, h)| (low, high, h)));
            assert_eq!(found.collect::<Vec<_>>(), expected);
        }
    }

    #[test]
    fn twins_run_back() {
        let mesh = shapes::grid(4, 3);
        let twins = of(&mesh).twins(mesh.faces()).unwrap();
        let tails = mesh.faces().as_flattened();
        let open = twins.iter().filter(|&&twin| twin == NO_HALFEDGE).count();
        assert_eq!(open, 14);
        for (h, &twin) in (0..).map(Halfedge).zip(&twins).filter(|(_, twin)| **twin != NO_HALFEDGE) {
            assert_eq!(twins[twin.index()], h);
            assert_eq!(tails[h.index()], tails[twin.next().index()]);
        }
        let strip = shapes::moebius_strip(9, 2);
        assert!(of(&strip).twins(strip.faces()).is_none());
    }

    #[test]
    fn repeated_faces_are_found_in_any_order_of_corners() {
        let faces = [[0, 1, 2], [2, 3, 1], [2, 0, 1], [1, 0, 2], [1, 2, 3]];
        let sides = Sides::of(4, (0..).map(Face).zip(faces));
        assert_eq!(sides.repeated_faces(&faces), [2, 3, 4].map(Face));
    }
}
