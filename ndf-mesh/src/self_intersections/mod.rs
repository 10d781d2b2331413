//! Where a mesh passes through itself.
//!
//! Two faces intersect if they have more in common than the corners and sides at which they are joined. This is decided
//! by the signs of determinants alone, computed exactly (Shewchuk 1997), so that the count is a fact about the coordinates
//! and not a matter of tolerances. Pairs are found by a tree of boxes.

mod boxes;
mod pair;

use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

use ndf_core::{BoundingBox, Cancelled, Progress};
use rayon::prelude::*;

use self::boxes::{Boxes, WIDTH};
use self::pair::{Triangle, intersect, plane_axis};
use crate::{Face, TriangleMesh};

/// How often a mesh passes through itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct SelfIntersections {
    /// Pairs of faces that intersect; counting ends soon after [`ENOUGH`](Self::ENOUGH).
    pub pairs: u64,
    /// Faces that intersect at least one other, of the pairs that were counted.
    pub faces: usize,
    /// The first face that intersects another, and the first it intersects of those after it, of the pairs that were counted.
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
        let finite = mesh.positions().iter().filter(|p| p.is_finite());
        let mut bounds = finite.fold(BoundingBox::EMPTY, |bounds, &p| bounds.including(p));
        let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
        let scaled;
        let mesh = if bounds.is_empty() || farthest == 0.0 || USUAL.contains(&farthest) {
            mesh
        } else {
            let factor = (-farthest.log2().floor()).clamp(-1023.0, 1023.0).exp2();
            scaled = mesh.map_positions(|p| factor * p);
            bounds = BoundingBox { min: factor * bounds.min, max: factor * bounds.max };
            &scaled
        };
        let boxes = Boxes::new(mesh, &bounds, |face| is_usable(mesh, face));
        let is_in_pair: Vec<AtomicBool> = (0..mesh.face_count()).map(|_| AtomicBool::new(false)).collect();
        let mut all = Self::default();
        for start in (0..boxes.leaf_count()).step_by(BETWEEN_CHECKS) {
            progress.check()?;
            progress.report("self-intersections", start as f64 / boxes.leaf_count() as f64);
            let leaves = start..boxes.leaf_count().min(start + BETWEEN_CHECKS);
            let of_leaf = |stack: &mut Vec<_>, leaf| {
                let (mut pairs, mut first) = (0, None::<[Face; 2]>);
                for_each_pair(mesh, &boxes, leaf, stack, |pair| {
                    pairs += 1;
                    first = Some(first.map_or(pair, |first| first.min(pair)));
                    pair.iter().for_each(|f| is_in_pair[f.index()].store(true, Relaxed));
                });
                (pairs, first)
            };
            let found = leaves.into_par_iter().map_init(Vec::new, of_leaf);
            let sum =
                |(m, a): (u64, Option<_>), (n, b): (u64, Option<_>)| (m + n, a.into_iter().chain(b).min());
            (all.pairs, all.first) = sum((all.pairs, all.first), found.reduce(|| (0, None), sum));
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
/// Leaves between two looks at the observer and at the count.
const BETWEEN_CHECKS: usize = 1 << 7;

/// Whether a face takes part.
fn is_usable(mesh: &TriangleMesh, face: Face) -> bool {
    let corners = mesh.corner_positions(face);
    corners.iter().all(|p| p.is_finite()) && plane_axis(corners).is_some()
}

/// Calls `found` with every two faces that intersect, the lower first, of which one is in a leaf and the other there or later.
fn for_each_pair(
    mesh: &TriangleMesh,
    boxes: &Boxes,
    leaf: usize,
    stack: &mut Vec<(usize, usize)>,
    mut found: impl FnMut([Face; 2]),
) {
    let triangle = |face: &Face| Triangle::new(mesh.corner_positions(*face));
    let faces = boxes.leaf(leaf);
    // A leaf that is not full repeats its last face, which is not asked for.
    let own: [Triangle; WIDTH] = std::array::from_fn(|place| triangle(&faces[place.min(faces.len() - 1)]));
    boxes.for_each_meeting(leaf, stack, |mine, other, place| {
        let other = boxes.leaf(other)[place];
        if intersect(&own[mine], &triangle(&other)) {
            found([faces[mine].min(other), faces[mine].max(other)]);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use ndf_core::{DVec3, NoProgress};

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

    /// Beside one coordinate as large as a damaged file has it, boxes in single precision part nothing, and products of sides vanish.
    #[test]
    fn faces_that_vanish_beside_the_largest_do_not_meet() {
        let base = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let apart = base.map(|[x, y, z]| [x, y + 3.0, z]);
        let far = [[1e155, 5.0, 5.0], [5.0, 6.0, 5.0], [5.0, 5.0, 6.0]];
        assert_eq!(count(&mesh(&[base, apart, far])).pairs, 0);
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
        let triangle = |f: usize| Triangle::new(mesh.corner_positions(Face::new(f)));
        (0..n).map(|i| (i + 1..n).filter(|&j| intersect(&triangle(i), &triangle(j))).count() as u64).sum()
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
