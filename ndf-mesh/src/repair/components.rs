//! The connected components of a mesh, and which of them are kept.

use crate::validation::DisjointSets;
use crate::{Face, Halfedge, ManifoldMesh, Sides, TriangleMesh};

/// Which components are kept. Components are joined through edges.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Parts {
    /// All of them.
    #[default]
    All,
    /// Those that have at least this share of the area, and the largest.
    Above(f64),
    /// The one with the largest area.
    Largest,
}

/// The components of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Components {
    /// The component of every face; components are numbered by their first faces.
    pub of_face: Vec<u32>,
    /// The area of every component.
    pub areas: Vec<f64>,
}

/// Which components of a mesh are kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    /// Whether a face is kept.
    pub faces: Vec<bool>,
    /// Components that are left out.
    pub left_out: usize,
    /// Their share of the area, from 0 to 1.
    pub area_left_out: f64,
}

impl Components {
    /// Those of a mesh. O(n log degree).
    pub fn of(mesh: &TriangleMesh) -> Self {
        let sides = Sides::of(mesh.vertex_count(), mesh.face_indices().zip(mesh.faces().iter().copied()));
        let pairs = sides.edges().flat_map(|(_, edge)| edge.windows(2).map(|pair| [pair[0].1, pair[1].1]));
        Self::joined(mesh, pairs)
    }

    /// Those of a manifold, whose topology knows which faces are beside each other. O(n).
    pub fn of_manifold(mesh: &ManifoldMesh) -> Self {
        let topology = mesh.topology();
        Self::joined(mesh, topology.halfedges().filter_map(|h| topology.twin(h).map(|twin| [h, twin])))
    }

    /// Those of a mesh by pairs of half-edges whose faces are beside each other.
    fn joined(mesh: &TriangleMesh, pairs: impl Iterator<Item = [Halfedge; 2]>) -> Self {
        let mut joined = DisjointSets::new(mesh.face_count());
        for pair in pairs {
            let [f, g] = pair.map(|h| h.face().index());
            joined.join(f, g);
        }
        // The root of a set is its first face.
        let mut found = Self::default();
        for f in 0..mesh.face_count() {
            let root = joined.root(f);
            let component = if root == f {
                found.areas.push(0.0);
                found.areas.len() as u32 - 1
            } else {
                found.of_face[root]
            };
            found.of_face.push(component);
            found.areas[component as usize] += mesh.face_area(Face::new(f));
        }
        found
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// The share of the whole area that the largest has; 1 where there is no area.
    pub fn largest_share(&self) -> f64 {
        let largest = self.areas.iter().copied().fold(0.0, f64::max);
        share(largest, self.areas.iter().sum()).unwrap_or(1.0)
    }

    /// Chooses components.
    pub fn kept(&self, parts: Parts) -> Kept {
        let total: f64 = self.areas.iter().sum();
        // Of equals the first.
        let largest = (0..self.len()).rev().max_by(|&a, &b| self.areas[a].total_cmp(&self.areas[b]));
        let is_kept = |c: usize| match parts {
            Parts::All => true,
            Parts::Above(least) => share(self.areas[c], total).is_none_or(|share| share >= least),
            Parts::Largest => false,
        };
        let kept: Vec<bool> = (0..self.len()).map(|c| Some(c) == largest || is_kept(c)).collect();
        let area = |(area, kept): (&f64, &bool)| if *kept { 0.0 } else { *area };
        let lost: f64 = self.areas.iter().zip(&kept).map(area).sum();
        Kept {
            faces: self.of_face.iter().map(|&c| kept[c as usize]).collect(),
            left_out: kept.iter().filter(|kept| !**kept).count(),
            area_left_out: share(lost, total).unwrap_or(0.0),
        }
    }
}

/// A part of a whole, where that is a number.
fn share(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0 && whole.is_finite()).then(|| part / whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn parts_are_kept_by_their_share_of_the_area() {
        let (mut positions, mut faces) = shapes::icosphere(1).into_parts();
        for (scale, shift) in [(2.0, 5.0), (0.1, 9.0)] {
            let (more, their) = shapes::icosphere(1).into_parts();
            let first = positions.len() as u32;
            positions.extend(more.into_iter().map(|p| p * scale + ndf_core::DVec3::X * shift));
            faces.extend(their.into_iter().map(|f| f.map(|v| v + first)));
        }
        let components = Components::of(&TriangleMesh::new(positions, faces).unwrap());
        let count = |parts| components.kept(parts).faces.iter().filter(|kept| **kept).count() / 80;
        assert_eq!(components.len(), 3);
        assert_eq!(
            [Parts::All, Parts::Above(0.01), Parts::Above(0.9), Parts::Largest].map(count),
            [3, 2, 1, 1]
        );
        let kept = components.kept(Parts::Largest);
        assert!((kept.area_left_out - 1.01 / 5.01).abs() < 1e-12 && kept.left_out == 2 && !kept.faces[0]);
        assert!((components.largest_share() - 4.0 / 5.01).abs() < 1e-12);
    }
}
