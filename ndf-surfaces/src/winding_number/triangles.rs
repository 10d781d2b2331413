//! Triangles as sources of winding numbers.

use std::f64::consts::PI;

use ndf_core::{BoundingBox, DVec3};
use ndf_mesh::TriangleMesh;

use super::arc_tangent::arc_tangent;
use super::expansion::{BETA, Moments};
use super::tree::{LANES, Packet, Tree};

/// The winding number of a mesh around any point. Counter-clockwise faces seen from outside count positive.
#[derive(Clone, Debug)]
pub struct WindingNumber {
    tree: Tree<Triangles>,
}

/// Eight triangles by corner, axis and lane; spare places hold points.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Triangles {
    corners: [[[f64; LANES]; 3]; 3],
}

impl WindingNumber {
    /// Prepares a mesh. Faces with a corner that is not finite are left out. O(n log n) on all threads; about
    /// 150 bytes a triangle.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let triangles: Vec<[DVec3; 3]> = mesh.face_indices().map(|f| mesh.corner_positions(f)).collect();
        let box_of = |corners: &[DVec3; 3]| {
            if corners.iter().all(|p| p.is_finite()) {
                BoundingBox::of_points(corners)
            } else {
                BoundingBox::EMPTY
            }
        };
        let boxes: Vec<BoundingBox> = triangles.iter().map(box_of).collect();
        let corners = |f: &u32| triangles[*f as usize];
        let mut tree = Tree::new(
            &boxes,
            |faces| Triangles::of(faces.iter().map(corners)),
            |faces| place(faces.iter().map(corners)),
        );
        tree.expand(|faces, center| moments(faces.iter().map(corners), center));
        Self { tree }
    }

    /// The winding number around `p`: near 1 inside, near 0 outside, off by less than about 0.01 where
    /// triangles are replaced by expansions. NaN if `p` is not finite.
    pub fn at(&self, p: DVec3) -> f64 {
        if p.is_finite() { self.tree.value(p) / (4.0 * PI) } else { f64::NAN }
    }
}

/// The area-weighted centroid of triangles and the distance from which they may be expanded about it.
fn place(triangles: impl Iterator<Item = [DVec3; 3]> + Clone) -> (DVec3, f64) {
    // Relative to one of them, so that a far origin costs no digits.
    let origin = triangles.clone().next().map_or(DVec3::ZERO, |[a, ..]| a);
    let (mut area, mut weighted) = (0.0, DVec3::ZERO);
    for corners in triangles.clone() {
        let (normal, centroid) = area_and_centroid(corners);
        area += normal.length();
        weighted += normal.length() * (centroid - origin);
    }
    let center = if area > 0.0 { origin + weighted / area } else { origin };
    let radius_squared = triangles.flatten().map(|p| p.distance_squared(center)).fold(0.0, f64::max);
    (center, BETA * radius_squared.sqrt())
}

fn area_and_centroid([a, b, c]: [DVec3; 3]) -> (DVec3, DVec3) {
    (0.5 * (b - a).cross(c - a), (a + b + c) / 3.0)
}

fn moments(triangles: impl Iterator<Item = [DVec3; 3]>, center: DVec3) -> Moments {
    let mut moments = Moments::default();
    for corners in triangles {
        let (n, centroid) = area_and_centroid(corners);
        let d = centroid - center;
        moments.add_first_order(n, d);
        // The mean of (s·r)² over a triangle is that of its corners and nine times its centroid, over 12.
        for (s, weight) in corners.map(|p| (p - center, 1.0 / 12.0)).into_iter().chain([(d, 0.75)]) {
            moments.add_second_order(weight * n, s);
        }
    }
    moments
}

impl Triangles {
    fn of(triangles: impl Iterator<Item = [DVec3; 3]>) -> Self {
        let mut packet = Self { corners: [[[0.0; LANES]; 3]; 3] };
        for (lane, triangle) in triangles.enumerate() {
            // Places after the last are filled with its first corner, which has no solid angle.
            for spare in lane..LANES {
                for (corner, p) in triangle.iter().enumerate() {
                    for axis in 0..3 {
                        packet.corners[corner][axis][spare] =
                            if spare == lane { p[axis] } else { triangle[0][axis] };
                    }
                }
            }
        }
        packet
    }
}

impl Packet for Triangles {
    /// Signed solid angles seen from `p` (Van Oosterom and Strackee 1983).
    #[inline(always)]
    fn values(&self, p: DVec3) -> [f64; LANES] {
        let [a, b, c] = &self.corners;
        let mut angles = [0.0; LANES];
        for i in 0..LANES {
            let (ax, ay, az) = (a[0][i] - p.x, a[1][i] - p.y, a[2][i] - p.z);
            let (bx, by, bz) = (b[0][i] - p.x, b[1][i] - p.y, b[2][i] - p.z);
            let (cx, cy, cz) = (c[0][i] - p.x, c[1][i] - p.y, c[2][i] - p.z);
            let la = (ax * ax + ay * ay + az * az).sqrt();
            let lb = (bx * bx + by * by + bz * bz).sqrt();
            let lc = (cx * cx + cy * cy + cz * cz).sqrt();
            let ab = ax * bx + ay * by + az * bz;
            let bc = bx * cx + by * cy + bz * cz;
            let ca = cx * ax + cy * ay + cz * az;
            let triple = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx);
            angles[i] = 2.0 * arc_tangent(triple, la * lb * lc + ab * lc + bc * la + ca * lb);
        }
        angles
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use ndf_mesh::{Face, shapes};
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    fn direct(mesh: &TriangleMesh, p: DVec3) -> f64 {
        let angle = |f: Face| {
            let [a, b, c] = mesh.corner_positions(f).map(|x| x - p);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            let den = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            2.0 * a.dot(b.cross(c)).atan2(den)
        };
        mesh.face_indices().map(angle).sum::<f64>() / (4.0 * PI)
    }

    fn cloud(mesh: &TriangleMesh, count: usize) -> Vec<DVec3> {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let bounds = mesh.bounds().padded(0.2 * mesh.bounds().diagonal());
        (0..count).map(|_| bounds.min + bounds.extent() * DVec3::from_array(rng.random())).collect()
    }

    #[test]
    fn spheres_and_tori_are_wound_around_once() {
        let sphere = WindingNumber::new(&shapes::icosphere(5));
        let torus = WindingNumber::new(&shapes::torus(200, 80, 1.0, 0.3));
        for (winding, inside, outside) in
            [(&sphere, DVec3::splat(0.3), DVec3::splat(0.7)), (&torus, DVec3::X, DVec3::ZERO)]
        {
            assert_abs_diff_eq!(winding.at(inside), 1.0, epsilon = 2e-3);
            assert_abs_diff_eq!(winding.at(outside), 0.0, epsilon = 2e-3);
            assert_abs_diff_eq!(winding.at(DVec3::splat(1e9)), 0.0, epsilon = 1e-9);
        }
        let (positions, mut faces) = shapes::icosphere(3).into_parts();
        faces.iter_mut().for_each(|face| face.swap(0, 1));
        let inverted = WindingNumber::new(&TriangleMesh::new(positions, faces).unwrap());
        assert_abs_diff_eq!(inverted.at(DVec3::ZERO), -1.0, epsilon = 2e-3);
    }

    #[test]
    fn expansions_agree_with_the_direct_sum() {
        let knot = shapes::trefoil_knot(400, 30, 0.2);
        let (positions, faces) = knot.clone().into_parts();
        let open = TriangleMesh::new(positions, faces[3000..].to_vec()).unwrap();
        let moved = open.map_positions(|p| 1e-6 * (p + 1e3));
        for mesh in [knot, open, moved] {
            let winding = WindingNumber::new(&mesh);
            let errors: Vec<f64> =
                cloud(&mesh, 500).iter().map(|&p| (winding.at(p) - direct(&mesh, p)).abs()).collect();
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            let max = errors.iter().copied().fold(0.0, f64::max);
            assert!(mean < 1e-3 && max < 1e-2, "mean {mean}, max {max}");
        }
    }

    #[test]
    fn holes_leave_the_sides_apart() {
        let (positions, faces) = shapes::icosphere(4).into_parts();
        let mesh = TriangleMesh::new(positions, faces[400..].to_vec()).unwrap();
        let winding = WindingNumber::new(&mesh);
        // The hole reaches from the first to the sixth vertex and is about half as wide.
        let middle = (mesh.positions()[0] + mesh.positions()[5]).normalize();
        for p in cloud(&mesh, 400) {
            if (p.length() - 1.0).abs() > 0.05 && p.dot(middle) < 0.3 {
                assert_eq!(winding.at(p) > 0.5, p.length() < 1.0, "{p}: {}", winding.at(p));
            }
        }
    }

    #[test]
    fn nothing_is_wound_around_by_nothing() {
        let nothing = WindingNumber::new(&TriangleMesh::default());
        assert_eq!(nothing.at(DVec3::ONE), 0.0);
        assert!(nothing.at(DVec3::NAN).is_nan());
        let flat = shapes::grid(3, 3).map_positions(|p| DVec3::new(p.x, 0.0, 0.0));
        assert_eq!(WindingNumber::new(&flat).at(DVec3::ONE), 0.0);
    }
}
