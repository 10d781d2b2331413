//! How good the triangles of a mesh are: lengths, angles, the Delaunay property.

use crate::ManifoldMesh;

/// Smallest, mean and largest of some values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Smallest.
    pub min: f64,
    /// Mean.
    pub mean: f64,
    /// Largest.
    pub max: f64,
}

/// The smallest angles of all faces, in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmallestAngles {
    /// The smallest of all.
    pub min: f64,
    /// The fifth percentile.
    pub p5: f64,
    /// The median.
    pub median: f64,
}

/// Figures of a mesh's triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Lengths of the edges.
    pub edge_length: Spread,
    /// Smallest angle of every face.
    pub min_angle_deg: SmallestAngles,
    /// Share of the inner edges that are locally Delaunay: the two angles opposite to them sum to at most π.
    pub delaunay_fraction: f64,
}

/// Cotangents of opposite angles may sum to this little below zero by rounding (cotangents are of order 1).
const DELAUNAY_TOLERANCE: f64 = 1e-9;

impl Quality {
    /// Measures a mesh. O(n log n).
    pub fn of(mesh: &ManifoldMesh) -> Self {
        let mut spread = Spread { min: f64::INFINITY, mean: 0.0, max: 0.0 };
        for e in 0..mesh.edge_count() as u32 {
            let [a, b] = mesh.edge_vertices(e).map(|v| mesh.positions()[v as usize]);
            let length = a.distance(b);
            spread.min = spread.min.min(length);
            spread.max = spread.max.max(length);
            spread.mean += length / mesh.edge_count() as f64;
        }
        let mut angles: Vec<f64> = (0..mesh.face_count() as u32).map(|f| smallest_angle(mesh, f)).collect();
        angles.sort_unstable_by(f64::total_cmp);
        let quantile = |q: f64| angles[((angles.len() - 1) as f64 * q).round() as usize];

        let (mut inner, mut delaunay) = (0_usize, 0_usize);
        for e in 0..mesh.edge_count() as u32 {
            let h = mesh.edge_halfedge(e);
            if let Some(twin) = mesh.twin(h) {
                inner += 1;
                let sum = opposite_cotangent(mesh, h) + opposite_cotangent(mesh, twin);
                delaunay += usize::from(sum >= -DELAUNAY_TOLERANCE);
            }
        }
        Self {
            edge_length: spread,
            min_angle_deg: SmallestAngles { min: quantile(0.0), p5: quantile(0.05), median: quantile(0.5) },
            delaunay_fraction: if inner == 0 { 1.0 } else { delaunay as f64 / inner as f64 },
        }
    }

    /// Whether every inner edge is locally Delaunay, hence the whole triangulation in its own metric.
    pub fn is_delaunay(&self) -> bool {
        self.delaunay_fraction == 1.0
    }
}

/// The smallest angle of a face, in degrees; 0 where an edge has no length.
fn smallest_angle(mesh: &ManifoldMesh, face: u32) -> f64 {
    let p = mesh.corner_positions(face);
    let angle = |c: usize| {
        let (u, v) = (p[(c + 1) % 3] - p[c], p[(c + 2) % 3] - p[c]);
        u.cross(v).length().atan2(u.dot(v)).to_degrees()
    };
    angle(0).min(angle(1)).min(angle(2))
}

/// Cotangent of the angle opposite to a half-edge in its face; of a face without area, −∞ opposite to its longest
/// side and +∞ opposite to the others.
fn opposite_cotangent(mesh: &ManifoldMesh, halfedge: u32) -> f64 {
    let at = |h: u32| mesh.positions()[mesh.tail(h) as usize];
    let apex = at(mesh.previous(halfedge));
    let (u, v) = (at(halfedge) - apex, at(mesh.next(halfedge)) - apex);
    let (dot, cross) = (u.dot(v), u.cross(v).length());
    if cross == 0.0 { f64::INFINITY.copysign(dot) } else { dot / cross }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::{DVec3, TriangleMesh};

    #[test]
    fn squares_split_along_the_diagonal_are_just_delaunay() {
        let mesh = ManifoldMesh::try_from(shapes::grid(4, 4)).unwrap();
        let quality = Quality::of(&mesh);
        assert!(quality.is_delaunay());
        assert!((quality.min_angle_deg.min - 45.0).abs() < 1e-9);
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
        assert_eq!(quality.min_angle_deg.min, 0.0);
    }
}
