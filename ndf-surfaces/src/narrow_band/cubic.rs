//! Adini's element: the polynomial of a cube through values and gradients at its corners.

use ndf_core::DVec3;

/// The polynomial of a cube. Of Adini's element in three dimensions (Adini and Clough 1961 for plates): trilinear
/// functions times 1, x², y² and z², so that all cubics are among them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cubic {
    /// Value and derivatives at each corner, bits of the corner's number telling the upper sides x, y, z. Derivatives
    /// are by coordinates in `[0, 1]`, thus gradients times the side.
    corners: [[f32; 4]; 8],
    /// Side of the cube.
    side: f32,
    /// Added to the polynomial, so that single precision resolves values near the level.
    level: f64,
}

impl Cubic {
    pub(super) fn new(corners: [(f64, DVec3); 8], side: f64, level: f64) -> Self {
        let single = |(v, g): (f64, DVec3)| {
            let d = side * g;
            [v - level, d.x, d.y, d.z].map(|x| x as f32)
        };
        Self { corners: corners.map(single), side: side as f32, level }
    }

    pub(super) fn value(&self, t: DVec3) -> f64 {
        let mut sum = 0.0;
        for (i, corner) in self.corners.iter().enumerate() {
            let (a, sign) = weights(t, i);
            sum += a.x * a.y * a.z * bracket(corner, a, sign);
        }
        self.level + sum
    }

    pub(super) fn value_and_gradient(&self, t: DVec3) -> (f64, DVec3) {
        let (mut sum, mut gradient) = (0.0, DVec3::ZERO);
        for (i, corner) in self.corners.iter().enumerate() {
            let (a, sign) = weights(t, i);
            let b = bracket(corner, a, sign);
            let [v, d @ ..] = corner.map(f64::from);
            let d = DVec3::from_array(d);
            sum += a.x * a.y * a.z * b;
            // By the weights, of which the derivatives by the coordinates are −sign.
            let of_bracket = v * (3.0 - 4.0 * a) + sign * d * (1.0 - 2.0 * a);
            let others = DVec3::new(a.y * a.z, a.z * a.x, a.x * a.y);
            gradient -= sign * others * (b + a * of_bracket);
        }
        (self.level + sum, gradient / f64::from(self.side))
    }
}

/// Linear weights of a corner along each axis, and 1 for lower sides, −1 for upper ones.
fn weights(t: DVec3, corner: usize) -> (DVec3, DVec3) {
    let upper = glam_mask(corner);
    (DVec3::select(upper, t, 1.0 - t), DVec3::select(upper, DVec3::NEG_ONE, DVec3::ONE))
}

fn glam_mask(corner: usize) -> ndf_core::glam::BVec3 {
    ndf_core::glam::BVec3::new(corner & 1 != 0, corner & 2 != 0, corner & 4 != 0)
}

/// What a corner contributes, without the product of its weights.
fn bracket(corner: &[f32; 4], a: DVec3, sign: DVec3) -> f64 {
    let [v, d @ ..] = corner.map(f64::from);
    let q = (2.0 * a - 1.0) * (1.0 - a);
    v * (1.0 + q.element_sum()) + (sign * DVec3::from_array(d) * a * (1.0 - a)).element_sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cubic with every monomial, and its gradient.
    fn polynomial(p: DVec3) -> (f64, DVec3) {
        let (x, y, z) = (p.x, p.y, p.z);
        let value = 1.0 + 2.0 * x - y + x * x - 3.0 * y * z + x * y * z + x * x * x - 2.0 * x * x * y
            + z * z * z
            + 0.5 * y * y * z
            - x * z * z;
        let gradient = DVec3::new(
            2.0 + 2.0 * x + y * z + 3.0 * x * x - 4.0 * x * y - z * z,
            -1.0 - 3.0 * z + x * z - 2.0 * x * x + y * z,
            -3.0 * y + x * y + 3.0 * z * z + 0.5 * y * y - 2.0 * x * z,
        );
        (value, gradient)
    }

    #[test]
    fn cubics_are_reproduced() {
        let (origin, side) = (DVec3::new(0.3, -0.2, 0.1), 0.7);
        let place = |t: DVec3| origin + side * t;
        let corner = |i: usize| DVec3::select(glam_mask(i), DVec3::ONE, DVec3::ZERO);
        let cube = Cubic::new(std::array::from_fn(|i| polynomial(place(corner(i)))), side, 0.9);
        for i in 0..50 {
            let t = (DVec3::new(0.618, 0.755, 0.57) * f64::from(i)).fract();
            let (value, gradient) = polynomial(place(t));
            let (found, slope) = cube.value_and_gradient(t);
            assert!((found - value).abs() < 2e-6 && (slope - gradient).length() < 1e-5, "{found} {value}");
            assert_eq!(found, cube.value(t));
        }
    }
}
