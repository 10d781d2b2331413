//! Where a mesh passes through itself.
//!
//! Two faces intersect if they have more in common than the corners and sides at which they are joined. This is decided
//! by the signs of determinants alone, computed exactly (Shewchuk 1997), so that the count is a fact about the coordinates
//! and not a matter of tolerances. Pairs are found by a hierarchy of boxes.

use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

use ndf_core::{BoundingBox, Cancelled, DVec3, Progress};
use rayon::prelude::*;
use robust::{Coord, Coord3D};

use crate::hierarchy::{Child, Hierarchy};
use crate::{Face, TriangleMesh};

/// How often a mesh passes through itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct SelfIntersections {
    /// Pairs of faces that intersect; counting ends soon after [`ENOUGH`](Self::ENOUGH).
    pub pairs: u64,
    /// Faces that intersect at least one other, of the pairs that were counted.
    pub faces: usize,
    /// The first face that intersects another, and the first it intersects of those after it.
    pub first: Option<[Face; 2]>,
}

impl SelfIntersections {
    /// Pairs after which counting ends: a surface folded onto itself many times has as many as the square of its faces.
    pub const ENOUGH: u64 = 1_000_000;

    /// Whether all pairs were counted.
    pub fn is_complete(&self) -> bool {
        self.pairs < Self::ENOUGH
    }

    /// Counts the pairs of faces that intersect.
    ///
    /// Faces are joined where they have corners at the same place, whatever the numbers of those. Two faces that are
    /// joined along a side intersect if one is folded onto the other, two that are joined at a corner if they have a
    /// further point in common, and others if they have any. Faces without area take no part, nor do those with a
    /// coordinate that is not finite. Very large and very small meshes are scaled by a power of two.
    ///
    /// O(n log n + pairs of faces whose boxes meet), on all threads.
    ///
    /// # Errors
    /// [`Cancelled`], if the observer asks to stop.
    pub fn of(mesh: &TriangleMesh, progress: &dyn Progress) -> Result<Self, Cancelled> {
        let scaled;
        let farthest = mesh
            .positions()
            .iter()
            .filter(|p| p.is_finite())
            .fold(0.0_f64, |far, p| far.max(p.abs().max_element()));
        let mesh = if farthest == 0.0 || USUAL.contains(&farthest) {
            mesh
        } else {
            let factor = (-farthest.log2().floor()).clamp(-1023.0, 1023.0).exp2();
            scaled = mesh.map_positions(|p| factor * p);
            &scaled
        };
        let boxes: Vec<BoundingBox> = mesh.face_indices().map(|f| usable_box(mesh, f)).collect();
        let hierarchy = Hierarchy::new(&boxes, LEAF);
        let search = Search { mesh, boxes: &boxes, hierarchy: &hierarchy };
        let is_in_pair: Vec<AtomicBool> = (0..mesh.face_count()).map(|_| AtomicBool::new(false)).collect();
        let mut all = Self::default();
        for start in (0..mesh.face_count()).step_by(BETWEEN_CHECKS) {
            progress.check()?;
            progress.report("self-intersections", start as f64 / mesh.face_count() as f64);
            let end = mesh.face_count().min(start + BETWEEN_CHECKS);
            let found: Vec<(u64, Option<[Face; 2]>)> = (start..end)
                .into_par_iter()
                .map_init(Vec::new, |stack, f| {
                    let (face, mut count, mut first) = (Face::new(f), 0, None::<Face>);
                    search.for_each_partner(face, stack, |other| {
                        count += 1;
                        first = Some(first.map_or(other, |first| first.min(other)));
                        [face, other].iter().for_each(|f| is_in_pair[f.index()].store(true, Relaxed));
                    });
                    (count, first.map(|other| [face, other]))
                })
                .collect();
            all.pairs += found.iter().map(|(count, _)| count).sum::<u64>();
            all.first = all.first.or_else(|| found.iter().find_map(|(_, first)| *first));
            if !all.is_complete() {
                break;
            }
        }
        progress.report("self-intersections", 1.0);
        Ok(Self { faces: is_in_pair.iter().filter(|is| is.load(Relaxed)).count(), ..all })
    }
}

/// Sizes of which products of four neither overflow nor vanish.
const USUAL: std::ops::Range<f64> = 1e-60..1e60;
/// Faces in a leaf of the hierarchy.
const LEAF: usize = 4;
/// Faces between two looks at the observer and at the count.
const BETWEEN_CHECKS: usize = 1 << 10;

/// The box of a face; empty for one that takes no part.
fn usable_box(mesh: &TriangleMesh, face: Face) -> BoundingBox {
    let corners = mesh.corner_positions(face);
    let is_usable = corners.iter().all(|p| p.is_finite()) && plane_axis(corners).is_some();
    if is_usable { BoundingBox::of_points(&corners) } else { BoundingBox::EMPTY }
}

struct Search<'a> {
    mesh: &'a TriangleMesh,
    boxes: &'a [BoundingBox],
    hierarchy: &'a Hierarchy,
}

impl Search<'_> {
    /// Calls `found` for each face of a higher number that intersects `face`.
    fn for_each_partner(&self, face: Face, stack: &mut Vec<u32>, mut found: impl FnMut(Face)) {
        let own = &self.boxes[face.index()];
        if own.is_empty() {
            return;
        }
        let triangle = self.mesh.corner_positions(face);
        stack.clear();
        stack.push(0);
        while let Some(node) = stack.pop() {
            let node = &self.hierarchy.nodes()[node as usize];
            for (child, outer) in node.children.iter().zip(&node.boxes) {
                match *child {
                    Child::Empty => break,
                    _ if !overlap(own, outer) => {}
                    Child::Node(below) => stack.push(below),
                    Child::Leaf { start, end } => {
                        let others = self.hierarchy.order()[start as usize..end as usize].iter();
                        let meets = |other: &Face| {
                            *other > face
                                && overlap(own, &self.boxes[other.index()])
                                && intersect(triangle, self.mesh.corner_positions(*other))
                        };
                        others.map(|&f| Face(f)).filter(meets).for_each(&mut found);
                    }
                }
            }
        }
    }
}

fn overlap(a: &BoundingBox, b: &BoundingBox) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
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
fn plane_axis(triangle: [DVec3; 3]) -> Option<usize> {
    (0..3).find(|&axis| turn(triangle, axis) != 0.0)
}

/// Whether all signs that are not zero are alike.
fn agree(signs: [f64; 3]) -> bool {
    !(signs.iter().any(|&s| s > 0.0) && signs.iter().any(|&s| s < 0.0))
}

/// Whether two triangles with area have more in common than their common corners and sides.
fn intersect(first: [DVec3; 3], second: [DVec3; 3]) -> bool {
    let partner = |i: usize| (0..3).find(|&j| first[i] == second[j]);
    let shared: Vec<[usize; 2]> = (0..3).filter_map(|i| partner(i).map(|j| [i, j])).collect();
    match shared[..] {
        [] => {
            let of_second = second.map(|p| side(first, p));
            let is_apart = of_second.iter().all(|&s| s > 0.0) || of_second.iter().all(|&s| s < 0.0);
            !is_apart
                && (0..3).any(|i| {
                    let ends = |t: [DVec3; 3]| [t[i], t[(i + 1) % 3]];
                    meets(ends(first), second) || meets(ends(second), first)
                })
        }
        [[i, j]] => {
            let opposite = |t: [DVec3; 3], corner: usize| [t[(corner + 1) % 3], t[(corner + 2) % 3]];
            meets(opposite(first, i), second) || meets(opposite(second, j), first)
        }
        [[i, _], [k, _]] => {
            let [a, b] = [first[i], first[k]];
            let third = |t: [DVec3; 3]| t.into_iter().find(|&p| p != a && p != b);
            let (Some(c), Some(d)) = (third(first), third(second)) else { return true };
            side(first, d) == 0.0
                && plane_axis(first)
                    .is_some_and(|axis| (turn([a, b, c], axis) > 0.0) == (turn([a, b, d], axis) > 0.0))
        }
        _ => true,
    }
}

/// Whether a segment and a triangle with area have a point in common.
fn meets([p, q]: [DVec3; 2], triangle: [DVec3; 3]) -> bool {
    let [at_p, at_q] = [p, q].map(|x| side(triangle, x));
    if (at_p > 0.0 && at_q > 0.0) || (at_p < 0.0 && at_q < 0.0) {
        return false;
    }
    let [a, b, c] = triangle;
    if at_p != 0.0 || at_q != 0.0 {
        // The line meets the plane in one point of the segment.
        return agree([[a, b], [b, c], [c, a]].map(|[u, v]| side([p, q, u], v)));
    }
    let Some(axis) = plane_axis(triangle) else { return false };
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
    use crate::shapes;
    use ndf_core::NoProgress;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    fn count(mesh: &TriangleMesh) -> SelfIntersections {
        SelfIntersections::of(mesh, &NoProgress).unwrap()
    }

    fn mesh(triangles: &[[[f64; 3]; 3]]) -> TriangleMesh {
        let positions = triangles.as_flattened().iter().map(|&p| DVec3::from_array(p)).collect();
        let faces = (0..triangles.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        TriangleMesh::new(positions, faces).unwrap()
    }

    fn union(a: &TriangleMesh, b: &TriangleMesh) -> TriangleMesh {
        let offset = a.vertex_count() as u32;
        let positions = [a.positions(), b.positions()].concat();
        let faces = a.faces().iter().copied().chain(b.faces().iter().map(|f| f.map(|v| v + offset)));
        TriangleMesh::new(positions, faces.collect()).unwrap()
    }

    #[test]
    fn embedded_shapes_have_none() {
        for shape in [
            shapes::icosphere(4),
            shapes::torus(40, 20, 1.0, 0.4),
            shapes::cube(5),
            shapes::grid(6, 4),
            shapes::moebius_strip(40, 4),
        ] {
            assert_eq!(count(&shape), SelfIntersections::default());
        }
    }

    #[test]
    fn a_fold_a_stab_and_a_touch_are_seen() {
        let base = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let cases: [([[f64; 3]; 3], u64); 10] = [
            // Joined along a side: flat, folded by a right angle, folded onto itself.
            ([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, -1.0, 0.0]], 0),
            ([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]], 0),
            ([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.5, 0.1, 0.0]], 1),
            // Joined at a corner: beside it, through it, and in its plane across it and beside it.
            ([[0.0, 0.0, 0.0], [-1.0, 0.0, 1.0], [0.0, -1.0, 1.0]], 0),
            ([[0.0, 0.0, 0.0], [0.2, 0.2, 1.0], [0.2, 0.2, -1.0]], 1),
            ([[0.0, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, 1.1, 0.0]], 1),
            ([[0.0, 0.0, 0.0], [-2.0, 1.0, 0.0], [-2.0, 1.1, 0.0]], 0),
            // Not joined: within it in its plane, touching it by a corner, the same.
            ([[0.1, 0.1, 0.0], [0.2, 0.1, 0.0], [0.1, 0.2, 0.0]], 1),
            ([[0.1, 0.1, 0.0], [0.2, 0.1, 1.0], [0.1, 0.2, 1.0]], 1),
            ([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]], 1),
        ];
        for (other, pairs) in cases {
            for turned in 0..3 {
                // Neither the order of corners nor of faces nor of axes matters.
                let spin = |t: [[f64; 3]; 3]| {
                    let [a, b, c] = t.map(|mut p| {
                        p.rotate_left(turned);
                        p
                    });
                    [b, c, a]
                };
                assert_eq!(count(&mesh(&[base, other].map(spin))).pairs, pairs, "{other:?}");
                assert_eq!(count(&mesh(&[other, base].map(spin))).pairs, pairs, "{other:?}");
            }
        }
    }

    #[test]
    fn faces_without_area_take_no_part() {
        let base = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let needle = [[0.2, 0.2, -1.0], [0.2, 0.2, 0.0], [0.2, 0.2, 1.0]];
        let odd = [[f64::NAN, 0.2, -1.0], [0.2, 0.2, 0.0], [0.2, 0.2, 1.0]];
        assert_eq!(count(&mesh(&[base, needle, odd])).pairs, 0);
    }

    #[test]
    fn spheres_that_overlap_intersect_along_a_circle() {
        let sphere = shapes::icosphere(3);
        let moved = sphere.map_positions(|p| p + DVec3::new(0.7, 0.11, 0.05));
        let both = union(&sphere, &moved);
        let found = count(&both);
        let expected = by_all_pairs(&both);
        assert_eq!(found.pairs, expected);
        assert!(found.faces > 60 && found.first.is_some_and(|[a, b]| a.index() < 1280 && b.index() >= 1280));
        for scale in [-900, -500, 300, 1020_i32].map(|exponent| f64::from(exponent).exp2()) {
            assert_eq!(count(&both.map_positions(|p| scale * p)).pairs, expected, "{scale}");
        }
        let apart = sphere.map_positions(|p| p + DVec3::new(2.1, 0.0, 0.0));
        assert_eq!(count(&union(&sphere, &apart)).pairs, 0);
    }

    #[test]
    fn counting_ends_where_there_are_enough() {
        // Every triangle stabs every other.
        let turned = |i: u32| {
            let (s, c) = (0.002 * f64::from(i)).sin_cos();
            [DVec3::new(c, s, 0.0), DVec3::new(-c, -s, 0.1), DVec3::new(-c, -s, -0.1)]
        };
        let positions = (0..1500).flat_map(turned).collect();
        let faces = (0..1500).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let found = count(&TriangleMesh::new(positions, faces).unwrap());
        assert!(!found.is_complete() && found.pairs < 1500 * 1499 / 2);
    }

    fn by_all_pairs(mesh: &TriangleMesh) -> u64 {
        let n = mesh.face_count();
        let corners = |f: usize| mesh.corner_positions(Face::new(f));
        (0..n).map(|i| (i + 1..n).filter(|&j| intersect(corners(i), corners(j))).count() as u64).sum()
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
                let found = intersect(a, b);
                assert_eq!(found, !is_separated(a, b), "{a:?} {b:?}");
                assert_eq!(found, intersect(b, a));
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

    #[test]
    fn threads_and_cancelling() {
        struct Stop;
        impl Progress for Stop {
            fn report(&self, _: &str, _: f64) {}
            fn cancelled(&self) -> bool {
                true
            }
        }
        assert_eq!(SelfIntersections::of(&shapes::icosphere(1), &Stop), Err(Cancelled));
        let knot = shapes::trefoil_knot(200, 20, 0.9);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| count(&knot))
        };
        assert!(on(1).pairs > 0);
        assert_eq!(on(1), on(3));
    }
}
