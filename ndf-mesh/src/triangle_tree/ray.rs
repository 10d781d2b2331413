//! The first triangle on a ray, without cracks between neighbours (Woop, Benthin and Wald 2013).

use pulp::{Simd, WithSimd};

use super::{LANES, Node, PACKET, Packet, STACK, TriangleTree};
use crate::FacePoint;
use crate::hierarchy::WIDTH;
use ndf_core::DVec3;

/// Where a ray meets a mesh first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The hit is at `origin + t · direction`.
    pub t: f64,
    /// Where that is in the face, which is hit from either side.
    pub at: FacePoint,
}

impl TriangleTree {
    /// The first hit of a ray with the mesh, `t ≥ 0`; `None` if there is none, or if the ray has a coordinate
    /// that is not finite or no direction. The direction need not be unit; `t` is in units of its length.
    ///
    /// Neighbouring triangles agree about the side of their common edge on which a ray passes, so a ray never
    /// slips between them. Triangles seen edge-on are not hit.
    pub fn first_hit(&self, origin: DVec3, direction: DVec3) -> Option<RayHit> {
        if self.is_empty() || !origin.is_finite() || !direction.is_finite() || direction == DVec3::ZERO {
            return None;
        }
        self.arch.dispatch(Cast { tree: self, ray: Shear::of(origin, direction) })
    }
}

impl TriangleTree {
    /// All hits of a ray with the mesh, `t ≥ 0`, in no order, under the rules of [`first_hit`](Self::first_hit).
    pub fn hits(&self, origin: DVec3, direction: DVec3) -> Vec<RayHit> {
        let mut hits = Vec::new();
        if self.is_empty() || !origin.is_finite() || !direction.is_finite() || direction == DVec3::ZERO {
            return hits;
        }
        let ray = Shear::of(origin, direction);
        let (origin, inverse) = ray.local(self);
        let mut stack = vec![0_u32];
        while let Some(child) = stack.pop() {
            if child & PACKET != 0 {
                self.packets[(child & !PACKET) as usize].hits(&ray, &mut hits);
                continue;
            }
            let node = &self.nodes[child as usize];
            let (enter, leave) = node.crossings(origin, inverse);
            stack.extend((0..WIDTH).filter(|&i| enter[i] <= leave[i]).map(|i| node.children[i]));
        }
        hits
    }
}

/// A ray and the shear that takes its direction to the z axis.
struct Shear {
    origin: DVec3,
    direction: DVec3,
    /// Permutation of the axes; the direction is largest along the last.
    axes: [usize; 3],
    shear: [f64; 3],
}

impl Shear {
    fn of(origin: DVec3, direction: DVec3) -> Self {
        let z = direction.abs().max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let [x, y, z] = axes.map(|axis| direction[axis]);
        Self { origin, direction, axes, shear: [x / z, y / z, z.recip()] }
    }

    /// Its origin in the frame of a tree, and by how much its parameter grows with each coordinate there.
    #[inline(always)]
    fn local(&self, tree: &TriangleTree) -> ([f64; 3], [f64; 3]) {
        // A direction component of 0 becomes one so small that its slab is all or nothing, and 0 · ∞ is avoided.
        let least = self.direction.abs().max_element() * 1e-200;
        let inverse = (self.direction * tree.frame.scale)
            .to_array()
            .map(|x| if x.abs() > least * tree.frame.scale { x } else { least * tree.frame.scale }.recip());
        (tree.frame.to_local(self.origin).to_array(), inverse)
    }
}

struct Cast<'a> {
    tree: &'a TriangleTree,
    ray: Shear,
}

impl WithSimd for Cast<'_> {
    type Output = Option<RayHit>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<RayHit> {
        let Self { tree, ray } = self;
        let (origin, inverse) = ray.local(tree);
        let mut hit: Option<RayHit> = None;
        let mut nearest = f64::INFINITY;
        let mut stack = [(0.0_f64, 0_u32); STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (enters, child) = stack[top];
            if enters > nearest {
                continue;
            }
            if child & PACKET != 0 {
                let packet = &tree.packets[(child & !PACKET) as usize];
                if let Some(found) = packet.first_hit(&ray, nearest) {
                    nearest = found.t;
                    hit = Some(found);
                }
                continue;
            }
            let node = &tree.nodes[child as usize];
            let (enter, leave) = node.crossings(origin, inverse);
            let base = top;
            for lane in 0..WIDTH {
                if enter[lane] <= leave[lane] && enter[lane] <= nearest {
                    let mut place = top;
                    while place > base && stack[place - 1].0 < enter[lane] {
                        stack[place] = stack[place - 1];
                        place -= 1;
                    }
                    stack[place] = (enter[lane], node.children[lane]);
                    top += 1;
                }
            }
        }
        hit
    }
}

impl Node {
    /// Parameters at which a ray enters, from 0 on, and leaves each box; it misses where it leaves first.
    #[inline(always)]
    fn crossings(&self, origin: [f64; 3], inverse: [f64; 3]) -> ([f64; WIDTH], [f64; WIDTH]) {
        // Leaving is delayed by more than the rounding of both (Ize 2013).
        const ROUNDING: f64 = 1.0 + 8.0 * f64::EPSILON;
        let mut enter = [0.0_f64; WIDTH];
        let mut leave = [f64::INFINITY; WIDTH];
        for axis in 0..3 {
            for lane in 0..WIDTH {
                let s = (f64::from(self.min[axis][lane]) - origin[axis]) * inverse[axis];
                let t = (f64::from(self.max[axis][lane]) - origin[axis]) * inverse[axis];
                let (s, t) = if inverse[axis] < 0.0 { (t, s) } else { (s, t) };
                enter[lane] = if s > enter[lane] { s } else { enter[lane] };
                let t = t * ROUNDING;
                leave[lane] = if t < leave[lane] { t } else { leave[lane] };
            }
        }
        (enter, leave)
    }
}

impl Packet {
    /// Where the ray meets each triangle, NaN where it does not, and the volumes that give the place in it.
    #[inline(always)]
    fn times(&self, ray: &Shear) -> ([f64; LANES], [[f64; LANES]; 3]) {
        let [a, b, c] = [0, 1, 2].map(|corner| self.sheared(corner, ray));
        let mut sides = [[0.0; LANES]; 3];
        let mut times = [f64::NAN; LANES];
        for i in 0..LANES {
            let u = c[0][i] * b[1][i] - c[1][i] * b[0][i];
            let v = a[0][i] * c[1][i] - a[1][i] * c[0][i];
            let w = b[0][i] * a[1][i] - b[1][i] * a[0][i];
            let some_negative = (u < 0.0) | (v < 0.0) | (w < 0.0);
            let some_positive = (u > 0.0) | (v > 0.0) | (w > 0.0);
            let determinant = u + v + w;
            // NaN or infinite where the triangle is seen edge-on.
            let t = (u * a[2][i] + v * b[2][i] + w * c[2][i]) / determinant;
            times[i] = if some_negative & some_positive { f64::NAN } else { t };
            (sides[0][i], sides[1][i], sides[2][i]) = (u, v, w);
        }
        (times, sides)
    }

    fn hit(&self, lane: usize, times: &[f64; LANES], sides: &[[f64; LANES]; 3]) -> RayHit {
        let [u, v, w] = [sides[0][lane], sides[1][lane], sides[2][lane]];
        let barycentric = [u / (u + v + w), v / (u + v + w), w / (u + v + w)];
        RayHit { t: times[lane], at: FacePoint { face: self.faces[lane], barycentric } }
    }

    /// The first triangle hit before `nearest`.
    #[inline(always)]
    fn first_hit(&self, ray: &Shear, nearest: f64) -> Option<RayHit> {
        let (times, sides) = self.times(ray);
        let mut first: Option<usize> = None;
        for i in 0..LANES {
            if times[i] >= 0.0 && times[i] < first.map_or(nearest, |lane| times[lane]) {
                first = Some(i);
            }
        }
        first.map(|lane| self.hit(lane, &times, &sides))
    }

    /// All triangles that are hit. Spare lanes repeat the last triangle.
    fn hits(&self, ray: &Shear, hits: &mut Vec<RayHit>) {
        let (times, sides) = self.times(ray);
        for lane in 0..LANES {
            let is_spare = lane > 0 && self.faces[lane] == self.faces[lane - 1];
            if times[lane] >= 0.0 && times[lane].is_finite() && !is_spare {
                hits.push(self.hit(lane, &times, &sides));
            }
        }
    }

    /// A corner of all triangles, in the frame in which the ray starts at 0 and runs along z.
    #[inline(always)]
    fn sheared(&self, corner: usize, ray: &Shear) -> [[f64; LANES]; 3] {
        let [kx, ky, kz] = ray.axes;
        let (xs, ys, zs) = (&self.corners[corner][kx], &self.corners[corner][ky], &self.corners[corner][kz]);
        let mut sheared = [[0.0; LANES]; 3];
        for i in 0..LANES {
            let z = zs[i] - ray.origin[kz];
            sheared[0][i] = xs[i] - ray.origin[kx] - ray.shear[0] * z;
            sheared[1][i] = ys[i] - ray.origin[ky] - ray.shear[1] * z;
            sheared[2][i] = ray.shear[2] * z;
        }
        sheared
    }
}
