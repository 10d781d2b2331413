//! The generalized winding number of a triangle mesh, hierarchical.
//!
//! `w(q)` is the sum of the signed solid angles of all triangles seen from `q`, over 4π (Jacobson, Kavan and
//! Sorkine-Hornung 2013): the integer number of times a closed mesh winds around `q`, and a smooth
//! interpolation of it where there are holes. Unlike the side of the closest face, a majority of the whole mesh
//! decides about inside and outside: a wrong, missing or doubled triangle harms only its own surroundings, and
//! self-intersecting pieces unite.
//!
//! Far triangles are replaced by the Taylor expansion of their common field to second order about
//! their area-weighted centroid (Barill, Dickson, Schmidt, Levin and Jacobson 2018, "Fast winding numbers for
//! soups and clouds"), where the query is more than β = 2 radii away; near ones are summed exactly
//! (Van Oosterom and Strackee 1983).

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use ndf_core::hierarchy::{Child, Hierarchy, MAX_LEVELS, WIDTH};
use ndf_core::{BoundingBox, DVec3, TriangleMesh};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// How many radii away triangles are replaced by their expansion.
const BETA: f64 = 2.0;

/// Triangles summed exactly at a time.
const LANES: usize = WIDTH;

/// Bit of a child reference that says it is a packet.
const PACKET: u32 = 1 << 31;

const STACK: usize = (WIDTH - 1) * MAX_LEVELS + WIDTH;

/// The winding number of a mesh around any point. Counter-clockwise faces seen from outside count positive.
#[derive(Clone, Debug)]
pub struct WindingNumber {
    nodes: Vec<Node>,
    packets: Vec<Packet>,
    arch: Arch,
}

/// Expansions of the fields of eight children, by coordinate.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Node {
    center: [[f64; WIDTH]; 3],
    /// `(β r)²`; infinite in empty places, so that nothing is expanded there.
    reach_squared: [f64; WIDTH],
    /// `Σ A n`.
    dipole: [[f64; WIDTH]; 3],
    /// The form `Σ ∫ (n·r) (s·r) dA`, s from the centre: coefficients of xx, yy, zz, yz, zx, xy in r.
    quadrupole: [[f64; WIDTH]; 6],
    /// The form `Σ ∫ (n·r) (s·r)² dA`: coefficients of xxx, yyy, zzz, xxy, xxz, yyz, yyx, zzx, zzy, xyz.
    octupole: [[f64; WIDTH]; 10],
    children: [u32; WIDTH],
    /// Number of children; they come first.
    count: u32,
}

/// Eight triangles by corner, axis and lane; spare places hold points.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Packet {
    corners: [[[f64; LANES]; 3]; 3],
}

impl WindingNumber {
    /// Prepares a mesh. Faces with a corner that is not finite are left out. O(n log n) on all threads; about
    /// 120 bytes a triangle.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let triangles: Vec<[DVec3; 3]> =
            (0..mesh.face_count() as u32).map(|f| mesh.corner_positions(f)).collect();
        let box_of = |corners: &[DVec3; 3]| {
            if corners.iter().all(|p| p.is_finite()) {
                BoundingBox::of_points(corners)
            } else {
                BoundingBox::EMPTY
            }
        };
        let boxes: Vec<BoundingBox> = triangles.iter().map(box_of).collect();
        let hierarchy = Hierarchy::new(&boxes, LANES);
        let sorted: Vec<[DVec3; 3]> = hierarchy.order().iter().map(|&f| triangles[f as usize]).collect();
        let ranges = ranges(&hierarchy);

        let mut packets = Vec::new();
        let mut nodes = Vec::with_capacity(ranges.len());
        for node in hierarchy.nodes() {
            let mut reference = |child: &Child| match *child {
                Child::Empty => 0,
                Child::Node(below) => below,
                Child::Leaf { start, end } => {
                    packets.push(Packet::of(&sorted[start as usize..end as usize]));
                    PACKET | (packets.len() - 1) as u32
                }
            };
            let children = [0, 1, 2, 3, 4, 5, 6, 7].map(|place| reference(&node.children[place]));
            let count = node.children.iter().filter(|&&child| child != Child::Empty).count();
            nodes.push(Node::without_moments(children, count as u32));
        }
        nodes.par_iter_mut().zip(&ranges).for_each(|(node, ranges)| {
            for (place, &(start, end)) in ranges.iter().enumerate() {
                if start < end {
                    node.expand(place, &sorted[start..end]);
                }
            }
        });
        Self { nodes, packets, arch: Arch::new() }
    }

    /// The winding number around `p`: near 1 inside, near 0 outside, off by less than about 0.01 where
    /// triangles are replaced by expansions. NaN if `p` is not finite.
    pub fn at(&self, p: DVec3) -> f64 {
        if self.nodes.is_empty() || !p.is_finite() {
            return if p.is_finite() { 0.0 } else { f64::NAN };
        }
        self.arch.dispatch(Sum { field: self, p })
    }
}

/// Ranges of the sorted items below every child.
fn ranges(hierarchy: &Hierarchy) -> Vec<[(usize, usize); WIDTH]> {
    let mut ranges = vec![[(0, 0); WIDTH]; hierarchy.nodes().len()];
    for (i, node) in hierarchy.nodes().iter().enumerate().rev() {
        for (place, child) in node.children.iter().enumerate() {
            ranges[i][place] = match *child {
                Child::Empty => (0, 0),
                Child::Leaf { start, end } => (start as usize, end as usize),
                Child::Node(below) => {
                    // Items of a subtree are consecutive.
                    let filled = ranges[below as usize].iter().filter(|(start, end)| start < end);
                    filled.fold((usize::MAX, 0), |(s, e), &(start, end)| (s.min(start), e.max(end)))
                }
            };
        }
    }
    ranges
}

impl Node {
    fn without_moments(children: [u32; WIDTH], count: u32) -> Self {
        Self {
            center: [[0.0; WIDTH]; 3],
            reach_squared: [f64::INFINITY; WIDTH],
            dipole: [[0.0; WIDTH]; 3],
            quadrupole: [[0.0; WIDTH]; 6],
            octupole: [[0.0; WIDTH]; 10],
            children,
            count,
        }
    }

    /// Computes the expansion of the triangles below a child.
    fn expand(&mut self, place: usize, triangles: &[[DVec3; 3]]) {
        let moments = |&[a, b, c]: &[DVec3; 3]| (0.5 * (b - a).cross(c - a), (a + b + c) / 3.0);
        // Relative to one of them, so that a far origin costs no digits.
        let origin = triangles[0][0];
        let (mut area, mut weighted) = (0.0, DVec3::ZERO);
        for (normal, centroid) in triangles.iter().map(moments) {
            area += normal.length();
            weighted += normal.length() * (centroid - origin);
        }
        let center = if area > 0.0 { origin + weighted / area } else { origin };
        let radius_squared =
            triangles.iter().flatten().map(|p| p.distance_squared(center)).fold(0.0, f64::max);
        let mut dipole = DVec3::ZERO;
        let mut quadrupole = [0.0; 6];
        let mut octupole = [0.0; 10];
        for corners in triangles {
            let (n, centroid) = moments(corners);
            let d = centroid - center;
            dipole += n;
            add(&mut quadrupole, linear_times_linear(n, d));
            // The mean of (s·r)² over a triangle is that of its corners and nine times its centroid, over 12.
            for (s, weight) in corners.map(|p| (p - center, 1.0 / 12.0)).into_iter().chain([(d, 0.75)]) {
                add(&mut octupole, linear_times_square(weight * n, s));
            }
        }
        self.reach_squared[place] = BETA * BETA * radius_squared;
        for axis in 0..3 {
            self.center[axis][place] = center[axis];
            self.dipole[axis][place] = dipole[axis];
        }
        for (moment, value) in self.quadrupole.iter_mut().zip(quadrupole) {
            moment[place] = value;
        }
        for (moment, value) in self.octupole.iter_mut().zip(octupole) {
            moment[place] = value;
        }
    }

    /// Solid angles, as the expansions have them, of the children that are far, 0 for the others; and which are
    /// near.
    #[inline(always)]
    fn expansions(&self, p: DVec3) -> ([f64; WIDTH], u32) {
        let mut angles = [0.0; WIDTH];
        let mut r2 = [0.0; WIDTH];
        let [cx, cy, cz] = &self.center;
        let [nx, ny, nz] = &self.dipole;
        let [xx, yy, zz, yz, zx, xy] = &self.quadrupole;
        let [xxx, yyy, zzz, xxy, xxz, yyz, yyx, zzx, zzy, xyz] = &self.octupole;
        for i in 0..WIDTH {
            let (x, y, z) = (cx[i] - p.x, cy[i] - p.y, cz[i] - p.z);
            r2[i] = x * x + y * y + z * z;
            let u = 1.0 / r2[i];
            let dipole = nx[i] * x + ny[i] * y + nz[i] * z;
            let quadratic =
                x * (xx[i] * x + xy[i] * y) + y * (yy[i] * y + yz[i] * z) + z * (zz[i] * z + zx[i] * x);
            let first = xx[i] + yy[i] + zz[i] - 3.0 * quadratic * u;
            let cubic = x * x * (xxx[i] * x + xxy[i] * y + xxz[i] * z)
                + y * y * (yyy[i] * y + yyz[i] * z + yyx[i] * x)
                + z * z * (zzz[i] * z + zzx[i] * x + zzy[i] * y)
                + xyz[i] * x * y * z;
            let laplacian = (3.0 * xxx[i] + yyx[i] + zzx[i]) * x
                + (3.0 * yyy[i] + xxy[i] + zzy[i]) * y
                + (3.0 * zzz[i] + xxz[i] + yyz[i]) * z;
            let second = (7.5 * cubic * u - 1.5 * laplacian) * u;
            let angle = (dipole + first + second) * (u * u.sqrt());
            angles[i] = if r2[i] > self.reach_squared[i] { angle } else { 0.0 };
        }
        let near = (0..WIDTH).fold(0, |mask, i| mask | u32::from(r2[i] <= self.reach_squared[i]) << i);
        (angles, near & ((1 << self.count) - 1))
    }
}

fn add<const N: usize>(sums: &mut [f64; N], terms: [f64; N]) {
    sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
}

/// The form `(n·r) (d·r)`, in the order of [`Node::quadrupole`].
fn linear_times_linear(n: DVec3, d: DVec3) -> [f64; 6] {
    let (yz, zx, xy) = (n.y * d.z + n.z * d.y, n.z * d.x + n.x * d.z, n.x * d.y + n.y * d.x);
    [n.x * d.x, n.y * d.y, n.z * d.z, yz, zx, xy]
}

/// The form `(n·r) (s·r)²`, in the order of [`Node::octupole`].
fn linear_times_square(n: DVec3, s: DVec3) -> [f64; 10] {
    let mixed = |a: usize, b: usize| s[a] * (n[b] * s[a] + 2.0 * n[a] * s[b]);
    let xyz = 2.0 * (n.x * s.y * s.z + n.y * s.z * s.x + n.z * s.x * s.y);
    [
        n.x * s.x * s.x,
        n.y * s.y * s.y,
        n.z * s.z * s.z,
        mixed(0, 1),
        mixed(0, 2),
        mixed(1, 2),
        mixed(1, 0),
        mixed(2, 0),
        mixed(2, 1),
        xyz,
    ]
}

impl Packet {
    fn of(triangles: &[[DVec3; 3]]) -> Self {
        let mut packet = Self { corners: [[[0.0; LANES]; 3]; 3] };
        for lane in 0..LANES {
            let point = [triangles[0][0]; 3];
            for (corner, p) in triangles.get(lane).unwrap_or(&point).iter().enumerate() {
                for axis in 0..3 {
                    packet.corners[corner][axis][lane] = p[axis];
                }
            }
        }
        packet
    }

    /// Signed solid angles seen from `p`.
    #[inline(always)]
    fn solid_angles(&self, p: DVec3) -> [f64; LANES] {
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

/// `atan2(y, x)` without branches, so that a loop over it becomes SIMD; 0 for (0, 0). Cephes' rational
/// approximation (Moshier 1989), correct to 4e-16.
#[inline(always)]
fn arc_tangent(y: f64, x: f64) -> f64 {
    let (ax, ay) = (x.abs(), y.abs());
    let (small, large) = if ay < ax { (ay, ax) } else { (ax, ay) };
    // The angle from the nearer axis, in [0, π/4], or from the diagonal if that is closer.
    let beyond = small > 0.66 * large;
    let (numerator, denominator) = if beyond { (small - large, small + large) } else { (small, large) };
    let ratio = numerator / denominator;
    let ratio = if denominator > 0.0 { ratio } else { 0.0 };
    let z = ratio * ratio;
    let p = (((-8.750_608_600_031_904e-1 * z - 1.615_753_718_733_365e1) * z - 7.500_855_792_314_705e1) * z
        - 1.228_866_684_490_136_2e2)
        * z
        - 6.485_021_904_942_025e1;
    let q = ((((z + 2.485_846_490_142_306_3e1) * z + 1.650_270_098_316_988_5e2) * z
        + 4.328_810_604_912_902_7e2)
        * z
        + 4.853_903_996_359_137e2)
        * z
        + 1.945_506_571_482_614e2;
    let angle = ratio + ratio * (z * p / q) + if beyond { FRAC_PI_4 } else { 0.0 };
    let angle = if ay < ax { angle } else { FRAC_PI_2 - angle };
    let angle = if large > 0.0 { angle } else { 0.0 };
    let angle = if x < 0.0 { PI - angle } else { angle };
    angle.copysign(y)
}

struct Sum<'a> {
    field: &'a WindingNumber,
    p: DVec3,
}

impl WithSimd for Sum<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let mut sums = [0.0; WIDTH];
        let mut stack = [0_u32; STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let child = stack[top];
            let angles = if child & PACKET != 0 {
                self.field.packets[(child & !PACKET) as usize].solid_angles(self.p)
            } else {
                let node = &self.field.nodes[child as usize];
                let (angles, mut near) = node.expansions(self.p);
                while near != 0 {
                    let lane = near.trailing_zeros() as usize;
                    near &= near - 1;
                    stack[top] = node.children[lane];
                    top += 1;
                }
                angles
            };
            for (sum, angle) in sums.iter_mut().zip(angles) {
                *sum += angle;
            }
        }
        sums.iter().sum::<f64>() / (4.0 * PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use ndf_core::mesh::shapes;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    fn direct(mesh: &TriangleMesh, p: DVec3) -> f64 {
        let angle = |f: u32| {
            let [a, b, c] = mesh.corner_positions(f).map(|x| x - p);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            let den = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            2.0 * a.dot(b.cross(c)).atan2(den)
        };
        (0..mesh.face_count() as u32).map(angle).sum::<f64>() / (4.0 * PI)
    }

    fn cloud(mesh: &TriangleMesh, count: usize) -> Vec<DVec3> {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let bounds = mesh.bounds().padded(0.2 * mesh.bounds().diagonal());
        (0..count).map(|_| bounds.min + bounds.extent() * DVec3::from_array(rng.random())).collect()
    }

    #[test]
    fn the_arc_tangent_is_right_in_all_quadrants() {
        for i in 0..4000 {
            let angle = (f64::from(i) / 2000.0 - 1.0) * PI;
            let (y, x) = angle.sin_cos();
            assert_abs_diff_eq!(arc_tangent(y, x), y.atan2(x), epsilon = 1e-15);
        }
        for (y, x) in [(0.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0), (-0.0, -1.0), (0.0, 0.0), (3.0, 3.0)]
        {
            assert_abs_diff_eq!(arc_tangent(y, x), f64::atan2(y, x), epsilon = 1e-15);
        }
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
