//! The point of a mesh closest to a query point.

use pulp::{Simd, WithSimd};

use super::{LANES, Node, PACKET, Packet, STACK, TriangleTree, closest_point_on_triangle};
use crate::hierarchy::WIDTH;
use crate::{Face, FacePoint};
use ndf_core::{DVec3, Hint};

/// Where a mesh comes closest to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoint {
    /// The point of the mesh.
    pub point: DVec3,
    /// The same in a face that contains it.
    pub at: FacePoint,
    /// Its squared distance to the query.
    pub distance_squared: f64,
}

impl ClosestPoint {
    /// The hint for a query near this one.
    pub fn hint(&self) -> Hint {
        Hint(self.at.face.0)
    }
}

/// By how much a bound in `f32` is raised so that no rounding in [`Node::distances_squared`] prunes an answer.
const ROUNDING: f64 = 1.0 + 1e-6;

impl TriangleTree {
    /// The point of the mesh closest to `p`; `None` if the tree is empty or `p` is not finite.
    ///
    /// The hint, a face of an earlier answer, bounds the distance from the start; a wrong or invalid one costs
    /// time only. Of several closest points any one is returned, which one may depend on the hint.
    pub fn closest_point(&self, p: DVec3, hint: Hint) -> Option<ClosestPoint> {
        self.closest_point_where(p, hint, |_| true)
    }

    /// As [`closest_point`](Self::closest_point), among the faces for which `accept` holds. It is asked only of
    /// faces closer than the best so far. `None` also if no face is accepted.
    pub fn closest_point_where(
        &self,
        p: DVec3,
        hint: Hint,
        accept: impl Fn(Face) -> bool,
    ) -> Option<ClosestPoint> {
        self.closest_point_within(p, f64::INFINITY, hint, accept)
    }

    /// As [`closest_point_where`](Self::closest_point_where), closer than the square root of
    /// `distance_squared`; `None` if nothing is.
    pub fn closest_point_within(
        &self,
        p: DVec3,
        distance_squared: f64,
        hint: Hint,
        accept: impl Fn(Face) -> bool,
    ) -> Option<ClosestPoint> {
        if self.is_empty() || !p.is_finite() {
            return None;
        }
        let mut search = Search { tree: self, p, accept, best: None, distance_squared };
        if let Some(face) = hint.get().map(Face)
            && let Some(triangle) = self.triangle(face)
            && (search.accept)(face)
        {
            let (point, _) = closest_point_on_triangle(p, triangle);
            search.improve(point.distance_squared(p), face);
        }
        let face = self.arch.dispatch(search)?;
        let triangle = self.triangle(face).expect("a face that was found is in the tree");
        let (point, barycentric) = closest_point_on_triangle(p, triangle);
        Some(ClosestPoint {
            point,
            at: FacePoint { face, barycentric },
            distance_squared: point.distance_squared(p),
        })
    }
}

struct Search<'a, A> {
    tree: &'a TriangleTree,
    p: DVec3,
    accept: A,
    best: Option<Face>,
    distance_squared: f64,
}

impl<A: Fn(Face) -> bool> Search<'_, A> {
    #[inline(always)]
    fn improve(&mut self, distance_squared: f64, face: Face) {
        if distance_squared < self.distance_squared {
            self.distance_squared = distance_squared;
            self.best = Some(face);
        }
    }

    /// What a box must be closer than to be searched, in the frame of the tree.
    #[inline(always)]
    fn bound(&self) -> f32 {
        let scale = self.tree.frame.scale;
        (self.distance_squared * (scale * scale * ROUNDING)) as f32 + f32::MIN_POSITIVE
    }

    #[inline(always)]
    fn search_packet(&mut self, packet: &Packet) {
        let distances = packet.distances_squared(self.p);
        let mut closer = lanes_below(&distances, self.distance_squared);
        while closer != 0 {
            let lane = closer.trailing_zeros() as usize;
            closer &= closer - 1;
            if distances[lane] < self.distance_squared && (self.accept)(packet.faces[lane]) {
                self.improve(distances[lane], packet.faces[lane]);
            }
        }
    }
}

impl<A: Fn(Face) -> bool> WithSimd for Search<'_, A> {
    type Output = Option<Face>;

    /// Depth first, the nearest child next. What waits on the stack is the bits of a distance, which order like
    /// the distance, above a child.
    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> Option<Face> {
        let (lo, hi) = self.tree.frame.around_point(self.p);
        let mut stack = [0_u64; STACK];
        let mut top = 0;
        let mut bound = self.bound();
        let mut node = &self.tree.nodes[0];
        loop {
            let distances = node.distances_squared(lo, hi);
            let mut near = lanes_below(&distances, bound);
            let base = top;
            while near != 0 {
                let lane = near.trailing_zeros() as usize;
                near &= near - 1;
                let entry = u64::from(distances[lane].to_bits()) << 32 | u64::from(node.children[lane]);
                let mut place = top;
                while place > base && stack[place - 1] < entry {
                    stack[place] = stack[place - 1];
                    place -= 1;
                }
                stack[place] = entry;
                top += 1;
            }
            node = loop {
                if top == 0 {
                    return self.best;
                }
                top -= 1;
                let (distance, child) = (f32::from_bits((stack[top] >> 32) as u32), stack[top] as u32);
                if distance >= bound {
                    continue;
                }
                if child & PACKET == 0 {
                    break &self.tree.nodes[child as usize];
                }
                self.search_packet(&self.tree.packets[(child & !PACKET) as usize]);
                bound = self.bound();
            };
        }
    }
}

impl Node {
    /// Lower bounds, but for rounding, of the squared distances from a point between `lo` and `hi`.
    #[inline(always)]
    fn distances_squared(&self, lo: [f32; 3], hi: [f32; 3]) -> [f32; WIDTH] {
        let mut sum = [0.0; WIDTH];
        for axis in 0..3 {
            for (lane, sum) in sum.iter_mut().enumerate() {
                let below = self.min[axis][lane] - hi[axis];
                let above = lo[axis] - self.max[axis][lane];
                let outside = larger(larger(below, above), 0.0);
                *sum += outside * outside;
            }
        }
        sum
    }
}

impl Packet {
    /// Squared distances from `p`: [`closest_point_on_triangle`], without branches and for all lanes at once.
    #[inline(always)]
    fn distances_squared(&self, p: DVec3) -> [f64; LANES] {
        let [a, b, c] = &self.corners;
        let mut distances = [0.0; LANES];
        for i in 0..LANES {
            let at = |q: &[[f64; LANES]; 3]| [q[0][i], q[1][i], q[2][i]];
            let (a, b, c) = (at(a), at(b), at(c));
            let (ab, ac, bc) = (minus(b, a), minus(c, a), minus(c, b));
            let (v, w) = (minus(p.to_array(), a), minus(p.to_array(), b));
            let n = cross(ab, ac);
            let n2 = dot(n, n);
            let (beta, gamma) = (dot(n, cross(v, ac)), dot(n, cross(ab, v)));
            let height = dot(n, v);
            let plane = height * height / n2;
            let edges = smaller(smaller(to_segment(v, ab), to_segment(v, ac)), to_segment(w, bc));
            let inside = (n2 > 0.0) & (beta >= 0.0) & (gamma >= 0.0) & (beta + gamma <= n2);
            distances[i] = if inside { plane } else { edges };
        }
        distances
    }
}

/// Squared distance from `v` to the segment from 0 to `e`.
#[inline(always)]
fn to_segment(v: [f64; 3], e: [f64; 3]) -> f64 {
    let t = dot(v, e) / dot(e, e);
    // NaN, from a segment without length, is not greater than 0.
    let t = if t > 0.0 { t } else { 0.0 };
    let t = if t < 1.0 { t } else { 1.0 };
    let d = minus(v, e.map(|x| x * t));
    dot(d, d)
}

/// Bit `i` says whether `values[i] < bound`.
#[inline(always)]
fn lanes_below<T: Copy + PartialOrd, const N: usize>(values: &[T; N], bound: T) -> u32 {
    (0..N).fold(0, |mask, i| mask | u32::from(values[i] < bound) << i)
}

#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    /// The bits of everything the kernels compute for a point.
    struct Kernels<'a>(&'a TriangleTree, DVec3);

    impl WithSimd for Kernels<'_> {
        type Output = Vec<u64>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> Vec<u64> {
            let Self(tree, p) = self;
            let (lo, hi) = tree.frame.around_point(p);
            let boxes = tree.nodes.iter().flat_map(|n| n.distances_squared(lo, hi).map(f64::from));
            let triangles = tree.packets.iter().flat_map(|packet| packet.distances_squared(p));
            boxes.chain(triangles).map(f64::to_bits).collect()
        }
    }

    #[test]
    fn the_processor_changes_nothing() {
        let tree = TriangleTree::new(&shapes::trefoil_knot(60, 12, 0.2));
        for p in [DVec3::ZERO, DVec3::new(0.9, -0.7, 0.1), DVec3::new(3.0, 1e3, 0.0)] {
            let dispatched = tree.arch.dispatch(Kernels(&tree, p));
            assert_eq!(dispatched, Kernels(&tree, p).with_simd(pulp::Scalar));
        }
    }
}
