//! Quadric error metrics (Garland and Heckbert 1997): squared distances to planes, summed.

use ndf_core::DVec3;

/// The quadratic function `xᵀ A x + 2 b·x + c` with symmetric A.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quadric {
    /// A: xx, yy, zz, xy, xz, yz.
    matrix: [f64; 6],
    vector: DVec3,
    constant: f64,
}

impl Quadric {
    /// `weight` times the squared distance from a plane through `point`; the normal is a unit vector.
    pub fn plane(point: DVec3, normal: DVec3, weight: f64) -> Self {
        let (n, offset) = (normal, -normal.dot(point));
        Self {
            matrix: [n.x * n.x, n.y * n.y, n.z * n.z, n.x * n.y, n.x * n.z, n.y * n.z].map(|x| weight * x),
            vector: weight * offset * n,
            constant: weight * offset * offset,
        }
    }

    fn times(&self, x: DVec3) -> DVec3 {
        let [xx, yy, zz, xy, xz, yz] = self.matrix;
        DVec3::new(
            xx * x.x + xy * x.y + xz * x.z,
            xy * x.x + yy * x.y + yz * x.z,
            xz * x.x + yz * x.y + zz * x.z,
        )
    }

    /// The value at a point; not negative, though rounding would have it so.
    pub fn at(&self, x: DVec3) -> f64 {
        (x.dot(self.times(x) + 2.0 * self.vector) + self.constant).max(0.0)
    }

    /// The minimiser of `Q(x) + softness · tr A · |x − near|²`: the second term decides where the planes do
    /// not. `steps` above 1 repeat from the point found (iterated Tikhonov regularisation), which makes the pull
    /// vanish in directions the planes determine, so that a corner is met exactly, while in flat regions and
    /// along creases the point stays level with `near`. `None` for a quadric that is zero or not finite.
    pub fn minimiser(&self, near: DVec3, softness: f64, steps: u32) -> Option<DVec3> {
        let [xx, yy, zz, xy, xz, yz] = self.matrix;
        let soft = softness * (xx + yy + zz);
        let (xx, yy, zz) = (xx + soft, yy + soft, zz + soft);
        // Cholesky factorisation of a matrix with smallest eigenvalue `soft` or more.
        let l00 = xx.sqrt();
        let (l10, l20) = (xy / l00, xz / l00);
        let l11 = (yy - l10 * l10).sqrt();
        let l21 = (yz - l20 * l10) / l11;
        let l22 = (zz - l20 * l20 - l21 * l21).sqrt();
        let mut found = near;
        for _ in 0..steps {
            let r = -(self.times(found) + self.vector);
            let y0 = r.x / l00;
            let y1 = (r.y - l10 * y0) / l11;
            let y2 = (r.z - l20 * y0 - l21 * y1) / l22;
            let z = y2 / l22;
            let y = (y1 - l21 * z) / l11;
            let x = (y0 - l10 * y - l20 * z) / l00;
            found += DVec3::new(x, y, z);
        }
        found.is_finite().then_some(found)
    }
}

impl std::ops::Add for Quadric {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            matrix: std::array::from_fn(|i| self.matrix[i] + other.matrix[i]),
            vector: self.vector + other.vector,
            constant: self.constant + other.constant,
        }
    }
}

impl std::ops::AddAssign for Quadric {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_planes_meet_in_the_minimiser() {
        let p = DVec3::new(1.0, -2.0, 0.5);
        let q = DVec3::AXES.iter().map(|&n| Quadric::plane(p, n, 2.0)).fold(Quadric::default(), |a, b| a + b);
        let found = q.minimiser(DVec3::ZERO, 1e-2, 8).unwrap();
        assert!(found.distance(p) < 1e-7);
        assert!(q.at(p) < 1e-12);
        assert!((q.at(p + DVec3::ONE) - 6.0).abs() < 1e-9);
    }

    #[test]
    fn a_single_plane_keeps_the_point_level() {
        let q = Quadric::plane(DVec3::ZERO, DVec3::Z, 1.0);
        let found = q.minimiser(DVec3::new(3.0, 4.0, 1.0), 1e-6, 1).unwrap();
        assert!(found.distance(DVec3::new(3.0, 4.0, 0.0)) < 1e-5);
        assert!(Quadric::default().minimiser(DVec3::ZERO, 1e-6, 1).is_none());
    }
}
