//! Whether two triangles pass through each other, exactly.

use ndf_core::{BoundingBox, DVec3};
use robust::{Coord, Coord3D};

/// A triangle and what tells the side of its plane that a point is on, mostly without exact arithmetic.
#[derive(Clone, Copy)]
pub(super) struct Triangle {
    corners: [DVec3; 3],
    /// Products of the first two sides from the first corner, and what their roundings are relative to.
    normal: DVec3,
    magnitude: DVec3,
}

/// A determinant that exceeds this share of its magnitude has the sign that was computed: 7 + 56 ε units of rounding (Shewchuk 1997),
/// rounded up.
const SURE: f64 = 4.0 * f64::EPSILON;

impl Triangle {
    pub(super) fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let (u, v) = (b - a, c - a);
        let (along, against) =
            (DVec3::new(u.y * v.z, u.z * v.x, u.x * v.y), DVec3::new(u.z * v.y, u.x * v.z, u.y * v.x));
        Self { corners, normal: along - against, magnitude: along.abs() + against.abs() }
    }

    /// The sign of the volume of the tetrahedron of the triangle and a point, exactly.
    #[inline]
    fn side(&self, point: DVec3) -> f64 {
        let to_point = point - self.corners[0];
        let volume = self.normal.dot(to_point);
        let is_sure = volume.abs() > SURE * self.magnitude.dot(to_point.abs());
        if is_sure { -volume } else { side(self.corners, point) }
    }

    /// Whether the corners of another that are not shared are all on one side of its plane.
    #[inline]
    fn is_beside(&self, others: &[DVec3; 3], is_shared: [bool; 3]) -> bool {
        let (mut above, mut below) = (false, false);
        for (&corner, _) in others.iter().zip(is_shared).filter(|(_, is_shared)| !is_shared) {
            let side = self.side(corner);
            above |= side > 0.0;
            below |= side < 0.0;
            if side == 0.0 || (above && below) {
                return false;
            }
        }
        above || below
    }
}

/// The sign of the volume of a tetrahedron, exactly.
fn side([a, b, c]: [DVec3; 3], d: DVec3) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    robust::orient3d(a, b, c, d)
}

/// The sign of the area of a triangle seen along an axis, exactly.
fn turn([a, b, c]: [DVec3; 3], axis: usize) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| Coord { x: p[(axis + 1) % 3], y: p[(axis + 2) % 3] });
    robust::orient2d(a, b, c)
}

/// An axis along which a triangle is seen to have an area; none if it has no area.
pub(super) fn plane_axis(triangle: [DVec3; 3]) -> Option<usize> {
    (0..3).find(|&axis| turn(triangle, axis) != 0.0)
}

/// Whether all signs that are not zero are alike.
fn agree(signs: [f64; 3]) -> bool {
    !(signs.iter().any(|&s| s > 0.0) && signs.iter().any(|&s| s < 0.0))
}

/// Whether two triangles with area have more in common than their common corners and sides.
pub(super) fn intersect(first: &Triangle, second: &Triangle) -> bool {
    let (p, q) = (first.corners, second.corners);
    // Of faces so small that products vanish, boxes in double precision still know.
    let [own, other] = [p, q].map(|corners| BoundingBox::of_points(&corners));
    if own.min.cmpgt(other.max).any() || other.min.cmpgt(own.max).any() {
        return false;
    }
    let mut partners = [None; 3];
    // Which corners are shared.
    let (mut own, mut others) = ([false; 3], [false; 3]);
    for (i, j) in [0, 1, 2].into_iter().flat_map(|i| [(i, 0), (i, 1), (i, 2)]) {
        if p[i] == q[j] {
            (partners[i], own[i]) = (Some(j), true);
            others[j] = true;
        }
    }
    // What is beside the plane of a triangle, but for common corners, has only these in common with it.
    if first.is_beside(&q, others) || second.is_beside(&p, own) {
        return false;
    }
    let opposite = |corners: [DVec3; 3], i: usize| [corners[(i + 1) % 3], corners[(i + 2) % 3]];
    let meet = |i: usize, j: usize| meets(opposite(p, i), second) || meets(opposite(q, j), first);
    match partners.iter().flatten().count() {
        0 => (0..3).any(|i| meet(i, i)),
        1 => (0..3).any(|i| partners[i].is_some_and(|j| meet(i, j))),
        // They lie in one plane and meet unless the common side is between them.
        2 => {
            let third = |is_shared: [bool; 3]| is_shared.iter().position(|is_shared| !is_shared);
            let (Some(i), Some(j), Some(axis)) = (third(own), third(others), plane_axis(p)) else {
                return false;
            };
            let [a, b] = opposite(p, i);
            let is_left = |c| turn([a, b, c], axis) > 0.0;
            is_left(p[i]) == is_left(q[j])
        }
        _ => true,
    }
}

/// Whether a segment and a triangle with area have a point in common.
fn meets([p, q]: [DVec3; 2], triangle: &Triangle) -> bool {
    let [at_p, at_q] = [p, q].map(|x| triangle.side(x));
    if (at_p > 0.0 && at_q > 0.0) || (at_p < 0.0 && at_q < 0.0) {
        return false;
    }
    let [a, b, c] = triangle.corners;
    if at_p != 0.0 || at_q != 0.0 {
        // The line meets the plane in one point of the segment.
        return agree([[a, b], [b, c], [c, a]].map(|[u, v]| side([p, q, u], v)));
    }
    let Some(axis) = plane_axis(triangle.corners) else { return false };
    let is_inside = |x| agree([[a, b], [b, c], [c, a]].map(|[u, v]| turn([u, v, x], axis)));
    is_inside(p) || is_inside(q) || [[a, b], [b, c], [c, a]].iter().any(|&side| cross([p, q], side, axis))
}

/// Whether two segments of one plane, seen along an axis, have a point in common, the ends of the first aside if those
/// are not in the second.
fn cross([p, q]: [DVec3; 2], [u, v]: [DVec3; 2], axis: usize) -> bool {
    let opposed = |s: f64, t: f64| (s > 0.0 && t < 0.0) || (s < 0.0 && t > 0.0);
    let (at_u, at_v) = (turn([p, q, u], axis), turn([p, q, v], axis));
    let (at_p, at_q) = (turn([u, v, p], axis), turn([u, v, q], axis));
    opposed(at_u, at_v) && opposed(at_p, at_q)
        || [(at_u, u), (at_v, v)].iter().any(|&(sign, end)| {
            let within = BoundingBox::of_points(&[p, q]);
            sign == 0.0 && within.distance_squared(end) == 0.0
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    fn meet(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
        intersect(&Triangle::new(a), &Triangle::new(b))
    }

    /// Also of points that are off the plane by roundings only.
    #[test]
    fn sides_are_those_of_exact_arithmetic() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut point = |size: f64| DVec3::from_array(rng.random::<[f64; 3]>()) * size;
        let mut unsure = 0;
        for round in 0..20_000 {
            let far = DVec3::splat(f64::from(round % 3) * 1e3);
            let corners = [0; 3].map(|_| far + point(1.0));
            let triangle = Triangle::new(corners);
            let [s, t, off] = point(1.0).to_array();
            let [u, v] = [corners[1] - corners[0], corners[2] - corners[0]];
            let off = off * [0.0, 1e-16, 1e-13, 1.0][round as usize % 4];
            let p = corners[0] + s * u + t * v + off * u.cross(v);
            let (found, exact) = (triangle.side(p), side(corners, p));
            assert_eq!((found > 0.0, found < 0.0), (exact > 0.0, exact < 0.0), "{corners:?} {p:?}");
            let volume = triangle.normal.dot(p - corners[0]);
            unsure += usize::from((volume < 0.0) != (exact > 0.0) && exact != 0.0);
        }
        assert!(unsure > 100, "{unsure}");
    }

    /// Triangles on a coarse lattice touch in every way there is.
    #[test]
    fn separating_axes_agree_on_a_lattice() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut triangle = |flat: bool| -> [DVec3; 3] {
            std::array::from_fn(|_| {
                let mut coordinate = || f64::from(rng.random_range(0..5_i32));
                DVec3::new(coordinate(), coordinate(), if flat { 0.0 } else { coordinate() })
            })
        };
        let mut seen = [0; 2];
        for round in 0..60_000 {
            let (a, b) = (triangle(round % 3 == 0), triangle(round % 3 == 0));
            let usable = plane_axis(a).is_some() && plane_axis(b).is_some();
            if usable && a.iter().all(|p| !b.contains(p)) {
                let found = meet(a, b);
                assert_eq!(found, !is_separated(a, b), "{a:?} {b:?}");
                assert_eq!(found, meet(b, a));
                seen[usize::from(found)] += 1;
            }
        }
        assert!(seen.iter().all(|&n| n > 1000), "{seen:?}");
    }

    /// Convex sets are disjoint if and only if an axis separates them: here normals of the faces, products of sides, and
    /// in a plane the perpendiculars of sides. All are small integers, hence exact.
    fn is_separated(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
        let sides = |t: [DVec3; 3]| [0, 1, 2].map(|i| t[(i + 1) % 3] - t[i]);
        let normal = |t: [DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]);
        let mut axes = vec![normal(a), normal(b)];
        for s in sides(a) {
            axes.extend(sides(b).map(|t| s.cross(t)));
        }
        axes.extend(sides(a).map(|s| s.cross(normal(a))));
        axes.extend(sides(b).map(|s| s.cross(normal(b))));
        axes.iter().any(|&axis| {
            let range = |t: [DVec3; 3]| {
                let on = t.map(|p| p.dot(axis));
                (on.iter().copied().fold(f64::MAX, f64::min), on.iter().copied().fold(f64::MIN, f64::max))
            };
            let ((a0, a1), (b0, b1)) = (range(a), range(b));
            a1 < b0 || b1 < a0
        })
    }
}
