//! Taylor expansions of the fields of many sources about their centre, eight at a time.
//!
//! With r the vector from the query to a source, a dipole m has the potential `m·r / |r|³` and a charge q the
//! potential `q / |r|`. The winding number is the potential of dipoles (area times normal) over 4π. Charges are the
//! transposed problem: the gradient of their potential sums over the points what the winding number spreads from
//! them.

use ndf_core::DVec3;
use ndf_mesh::hierarchy::WIDTH;

/// How many radii away sources are replaced by their expansion.
pub(super) const BETA: f64 = 2.0;

/// Sums over sources, relative to a centre.
#[derive(Clone, Debug, Default)]
pub(super) struct Moments {
    charge: f64,
    dipole: DVec3,
    quadrupole: [f64; 6],
    octupole: [f64; 10],
}

impl Moments {
    /// Adds a dipole at offset `d`.
    pub(super) fn add_dipole(&mut self, m: DVec3, d: DVec3) {
        self.add_first_order(m, d);
        self.add_second_order(m, d);
    }

    /// Adds the total of dipoles whose centroid is `d`; their spread about the centre is added by
    /// [`add_second_order`](Self::add_second_order).
    pub(super) fn add_first_order(&mut self, m: DVec3, d: DVec3) {
        self.dipole += m;
        add(&mut self.quadrupole, linear_times_linear(m, d));
    }

    /// Adds what a dipole at offset `s` contributes to the second order.
    pub(super) fn add_second_order(&mut self, m: DVec3, s: DVec3) {
        add(&mut self.octupole, linear_times_square(m, s));
    }

    /// Adds a charge at offset `d`. On the way from the centre to its place its potential changes as a dipole along
    /// that way does: `1/|r + d| = 1/|r| − ∫₀¹ d·(r + td)/|r + td|³ dt`.
    pub(super) fn add_charge(&mut self, q: f64, d: DVec3) {
        self.charge += q;
        self.dipole -= q * d;
        add(&mut self.quadrupole, linear_times_linear(-0.5 * q * d, d));
        add(&mut self.octupole, linear_times_square(-q / 3.0 * d, d));
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

/// Expansions of the fields of eight children, by coordinate.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Node {
    center: [[f64; WIDTH]; 3],
    /// Square of the distance up to which nothing is expanded; infinite in empty places.
    reach_squared: [f64; WIDTH],
    /// `Σ q`.
    charge: [f64; WIDTH],
    /// `Σ m`.
    dipole: [[f64; WIDTH]; 3],
    /// The form `Σ (m·r) (s·r)`, s from the centre: coefficients of xx, yy, zz, yz, zx, xy in r.
    quadrupole: [[f64; WIDTH]; 6],
    /// The form `Σ (m·r) (s·r)²`: coefficients of xxx, yyy, zzz, xxy, xxz, yyz, yyx, zzx, zzy, xyz.
    octupole: [[f64; WIDTH]; 10],
    /// What is below each place.
    pub(super) children: [u32; WIDTH],
    /// Number of children; they come first.
    pub(super) count: u32,
}

/// Eight potentials with their gradients by the query.
pub(super) type ValuesAndGradients = [[f64; WIDTH]; 4];

impl Node {
    pub(super) fn without_moments(children: [u32; WIDTH], count: u32) -> Self {
        Self {
            center: [[0.0; WIDTH]; 3],
            reach_squared: [f64::INFINITY; WIDTH],
            charge: [0.0; WIDTH],
            dipole: [[0.0; WIDTH]; 3],
            quadrupole: [[0.0; WIDTH]; 6],
            octupole: [[0.0; WIDTH]; 10],
            children,
            count,
        }
    }

    /// Fixes about which centre a child is expanded, and from which distance.
    pub(super) fn set_reach(&mut self, place: usize, center: DVec3, reach: f64) {
        self.reach_squared[place] = reach * reach;
        for axis in 0..3 {
            self.center[axis][place] = center[axis];
        }
    }

    /// The centre about which a child is expanded.
    pub(super) fn center(&self, place: usize) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis| self.center[axis][place]))
    }

    pub(super) fn set_moments(&mut self, place: usize, moments: &Moments) {
        self.charge[place] = moments.charge;
        for axis in 0..3 {
            self.dipole[axis][place] = moments.dipole[axis];
        }
        for (lanes, value) in self.quadrupole.iter_mut().zip(moments.quadrupole) {
            lanes[place] = value;
        }
        for (lanes, value) in self.octupole.iter_mut().zip(moments.octupole) {
            lanes[place] = value;
        }
    }

    /// Potentials of the dipoles below the children that are far, 0 for the others; and which are near.
    #[inline(always)]
    pub(super) fn values(&self, p: DVec3) -> ([f64; WIDTH], u32) {
        let mut values = [0.0; WIDTH];
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
            let value = (dipole + first + second) * (u * u.sqrt());
            values[i] = if r2[i] > self.reach_squared[i] { value } else { 0.0 };
        }
        (values, self.near(&r2))
    }

    /// Potentials of dipoles and charges, and their gradients, below the children that are far, 0 for the others;
    /// and which are near. The gradients are exact derivatives of the expansions.
    #[inline(always)]
    pub(super) fn values_and_gradients(&self, p: DVec3) -> (ValuesAndGradients, u32) {
        let mut out = [[0.0; WIDTH]; 4];
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
            // Gradients of the forms by r; a form is r·gradient over its degree (Euler).
            let qx = 2.0 * xx[i] * x + xy[i] * y + zx[i] * z;
            let qy = 2.0 * yy[i] * y + xy[i] * x + yz[i] * z;
            let qz = 2.0 * zz[i] * z + yz[i] * y + zx[i] * x;
            let quadratic = 0.5 * (x * qx + y * qy + z * qz);
            let kx = x * (3.0 * xxx[i] * x + 2.0 * (xxy[i] * y + xxz[i] * z))
                + (yyx[i] * y * y + zzx[i] * z * z + xyz[i] * y * z);
            let ky = y * (3.0 * yyy[i] * y + 2.0 * (yyz[i] * z + yyx[i] * x))
                + (xxy[i] * x * x + zzy[i] * z * z + xyz[i] * x * z);
            let kz = z * (3.0 * zzz[i] * z + 2.0 * (zzx[i] * x + zzy[i] * y))
                + (xxz[i] * x * x + yyz[i] * y * y + xyz[i] * x * y);
            let cubic = (x * kx + y * ky + z * kz) / 3.0;
            let lx = 3.0 * xxx[i] + yyx[i] + zzx[i];
            let ly = 3.0 * yyy[i] + xxy[i] + zzy[i];
            let lz = 3.0 * zzz[i] + xxz[i] + yyz[i];
            let laplacian = lx * x + ly * y + lz * z;
            // The potential is (polynomial in r and u) u^(3/2), where ∇u = −2 u² r.
            let trace = xx[i] + yy[i] + zz[i];
            let polynomial = dipole + trace + u * (-3.0 * quadratic - 1.5 * laplacian + 7.5 * cubic * u);
            let by_u = -3.0 * quadratic - 1.5 * laplacian + 15.0 * cubic * u;
            let root = u.sqrt();
            let cube = u * root;
            let radial = -u * (3.0 * polynomial + 2.0 * u * by_u) - self.charge[i];
            let gradient = |n: f64, q: f64, k: f64, l: f64, r: f64| {
                -cube * (n + u * (-3.0 * q - 1.5 * l + 7.5 * u * k) + radial * r)
            };
            let far = r2[i] > self.reach_squared[i];
            let kept = |value: f64| if far { value } else { 0.0 };
            out[0][i] = kept(polynomial * cube + self.charge[i] * root);
            out[1][i] = kept(gradient(nx[i], qx, kx, lx, x));
            out[2][i] = kept(gradient(ny[i], qy, ky, ly, y));
            out[3][i] = kept(gradient(nz[i], qz, kz, lz, z));
        }
        (out, self.near(&r2))
    }

    /// Which children are too near to be expanded, as bits.
    #[inline(always)]
    fn near(&self, r2: &[f64; WIDTH]) -> u32 {
        let near = (0..WIDTH).fold(0, |mask, i| mask | u32::from(r2[i] <= self.reach_squared[i]) << i);
        near & ((1 << self.count) - 1)
    }
}
