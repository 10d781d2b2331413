//! How good the triangles of a mesh are: lengths, angles, the Delaunay property.

use std::ops::Range;

use rayon::prelude::*;
use serde::Serialize;

use crate::{Edge, Face, Halfedge, ManifoldMesh};
use ndf_core::DVec3;

/// Edges or faces a thread takes at a time.
const CHUNK: usize = 4096;

/// Smallest, mean and largest of some values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Smallest.
    pub min: f64,
    /// Mean.
    pub mean: f64,
    /// Largest.
    pub max: f64,
}

/// The smallest angles of all faces.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SmallestAngles {
    /// The smallest of all.
    pub min: f64,
    /// The fifth percentile.
    pub p5: f64,
    /// The median.
    pub median: f64,
}

impl SmallestAngles {
    /// The same in degrees.
    #[must_use]
    pub fn to_degrees(self) -> Self {
        let Self { min, p5, median } = self;
        Self { min: min.to_degrees(), p5: p5.to_degrees(), median: median.to_degrees() }
    }
}

/// Figures of a mesh's triangles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// Lengths of the edges.
    pub edge_length: Spread,
    /// Smallest angle of every face, in radians.
    pub min_angle: SmallestAngles,
    /// Share of the inner edges that are locally Delaunay: the two angles opposite to them sum to at most π.
    pub delaunay_fraction: f64,
}

/// Cotangents of opposite angles may sum to this little below zero and still count as Delaunay: cotangents are of
/// order one and carry rounding errors of a few 1e-16 times the condition of their triangle; co-circular quads would
/// otherwise flip back and forth.
pub const DELAUNAY_TOLERANCE: f64 = 1e-9;

impl Quality {
    /// Measures a mesh, over all threads. O(n).
    pub fn of(mesh: &ManifoldMesh) -> Self {
        let edges: Vec<EdgeFigures> = (0..mesh.topology().edge_count().div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                EdgeFigures::of(mesh, chunk * CHUNK..mesh.topology().edge_count().min((chunk + 1) * CHUNK))
            })
            .collect();
        // In order, so that the sum does not depend on the number of threads.
        let all = edges.into_iter().fold(EdgeFigures::NONE, EdgeFigures::and);
        let mut cotangents: Vec<f64> =
            mesh.topology().par_faces().with_min_len(CHUNK).map(|f| greatest_cotangent(mesh, f)).collect();
        // Angles fall where cotangents rise.
        let mut quantile = |q: f64| {
            let rank = ((cotangents.len() - 1) as f64 * q).round() as usize;
            let (_, cotangent, _) = cotangents.select_nth_unstable_by(rank, |a, b| b.total_cmp(a));
            1.0_f64.atan2(*cotangent)
        };
        Self {
            edge_length: Spread {
                min: all.shortest,
                mean: all.length / mesh.topology().edge_count() as f64,
                max: all.longest,
            },
            min_angle: SmallestAngles { min: quantile(0.0), p5: quantile(0.05), median: quantile(0.5) },
            delaunay_fraction: if all.inner == 0 { 1.0 } else { all.delaunay as f64 / all.inner as f64 },
        }
    }

    /// Whether every inner edge is locally Delaunay, hence the whole triangulation in its own metric.
    pub fn is_delaunay(&self) -> bool {
        self.delaunay_fraction == 1.0
    }
}

/// What is counted along edges.
#[derive(Clone, Copy)]
struct EdgeFigures {
    shortest: f64,
    longest: f64,
    length: f64,
    inner: usize,
    delaunay: usize,
}

impl EdgeFigures {
    const NONE: Self = Self { shortest: f64::INFINITY, longest: 0.0, length: 0.0, inner: 0, delaunay: 0 };

    fn of(mesh: &ManifoldMesh, edges: Range<usize>) -> Self {
        let mut figures = Self::NONE;
        for e in edges.map(Edge::new) {
            let h = mesh.topology().edge_halfedge(e);
            let [a, b] = mesh.topology().edge_vertices(e).map(|v| mesh.positions()[v.index()]);
            let length = a.distance(b);
            figures.shortest = figures.shortest.min(length);
            figures.longest = figures.longest.max(length);
            figures.length += length;
            if let Some(twin) = mesh.topology().twin(h) {
                let opposite = [opposite(mesh, h), opposite(mesh, twin)];
                let acute = opposite.iter().all(|(u, v)| u.dot(*v) >= 0.0);
                let delaunay = acute || opposite.map(cotangent).iter().sum::<f64>() >= -DELAUNAY_TOLERANCE;
                figures.inner += 1;
                figures.delaunay += usize::from(delaunay);
            }
        }
        figures
    }

    fn and(self, other: Self) -> Self {
        Self {
            shortest: self.shortest.min(other.shortest),
            longest: self.longest.max(other.longest),
            length: self.length + other.length,
            inner: self.inner + other.inner,
            delaunay: self.delaunay + other.delaunay,
        }
    }
}

/// Cotangent of the smallest angle of a face, the one opposite to its shortest side; ∞ where that is 0.
fn greatest_cotangent(mesh: &ManifoldMesh, face: Face) -> f64 {
    let [a, b, c] = mesh.corner_positions(face);
    let (ab, bc, ca) = (a.distance_squared(b), b.distance_squared(c), c.distance_squared(a));
    cotangent(if ab <= bc && ab <= ca {
        (a - c, b - c)
    } else if bc <= ca {
        (b - a, c - a)
    } else {
        (c - b, a - b)
    })
}

/// The vectors to a half-edge's ends from the corner opposite to it in its face.
fn opposite(mesh: &ManifoldMesh, halfedge: Halfedge) -> (DVec3, DVec3) {
    let at = |h: Halfedge| mesh.positions()[mesh.topology().tail(h).index()];
    let apex = at(halfedge.previous());
    (at(halfedge) - apex, at(halfedge.next()) - apex)
}

/// Cotangent of the angle between two vectors; in a face without area −∞ opposite to its longest side and +∞
/// opposite to the others.
fn cotangent((u, v): (DVec3, DVec3)) -> f64 {
    let (dot, cross) = (u.dot(v), u.cross(v).length());
    if cross == 0.0 { f64::INFINITY.copysign(dot) } else { dot / cross }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriangleMesh;
    use crate::shapes;

    #[test]
    fn squares_split_along_the_diagonal_are_just_delaunay() {
        let mesh = ManifoldMesh::try_from(shapes::grid(4, 4)).unwrap();
        let quality = Quality::of(&mesh);
        assert!(quality.is_delaunay());
        assert!((quality.min_angle.min.to_degrees() - 45.0).abs() < 1e-9);
        assert!((quality.edge_length.max - 0.25 * 2.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_long_diagonal_is_not_delaunay() {
        let positions =
            [[-1.0, 0.0], [0.0, -0.2], [1.0, 0.0], [0.0, 0.2]].map(|p| DVec3::new(p[0], p[1], 0.0));
        let mesh = TriangleMesh::new(positions.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let quality = Quality::of(&ManifoldMesh::try_from(mesh).unwrap());
        assert_eq!(quality.delaunay_fraction, 0.0);
        assert!(!quality.is_delaunay());
    }

    #[test]
    fn faces_without_area_have_angle_zero() {
        let positions = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]].map(|p| DVec3::new(p[0], p[1], 0.0));
        let mesh = TriangleMesh::new(positions.to_vec(), vec![[0, 1, 2]]).unwrap();
        let quality = Quality::of(&ManifoldMesh::try_from(mesh).unwrap());
        assert_eq!(quality.min_angle.min, 0.0);
    }
}
