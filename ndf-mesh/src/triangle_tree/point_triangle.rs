//! The closest point of one triangle, exact also for slivers and triangles without area.

use ndf_core::DVec3;

/// The point of a triangle closest to `p`, and its barycentric coordinates.
///
/// The point is the foot on the plane if that lies inside, else the closest of the three edges. The normal is a
/// cross product, not differences of dot products (Ericson 2005, §5.1.5), which lose half the digits in
/// slivers; a triangle without area has no inside and is the union of its edges.
pub fn closest_point_on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> (DVec3, [f64; 3]) {
    let (ab, ac, bc, v) = (b - a, c - a, c - b, p - a);
    let n = ab.cross(ac);
    let n2 = n.length_squared();
    let (beta, gamma) = (n.dot(v.cross(ac)), n.dot(ab.cross(v)));
    if n2 > 0.0 && beta >= 0.0 && gamma >= 0.0 && beta + gamma <= n2 {
        let (beta, gamma) = (beta / n2, gamma / n2);
        return (p - n * (n.dot(v) / n2), [1.0 - beta - gamma, beta, gamma]);
    }
    let s = parameter_on_segment(v, ab);
    let t = parameter_on_segment(v, ac);
    let u = parameter_on_segment(p - b, bc);
    let candidates =
        [(a + ab * s, [1.0 - s, s, 0.0]), (a + ac * t, [1.0 - t, 0.0, t]), (b + bc * u, [0.0, 1.0 - u, u])];
    let distances = candidates.map(|(q, _)| q.distance_squared(p));
    let mut best = 0;
    for i in 1..3 {
        if distances[i] < distances[best] {
            best = i;
        }
    }
    candidates[best]
}

/// The parameter in `[0, 1]` of the point of the segment from 0 to `e` closest to `v`; 0 if `e` is 0.
fn parameter_on_segment(v: DVec3, e: DVec3) -> f64 {
    let t = v.dot(e) / e.length_squared();
    // NaN, from a segment without length, is not greater than 0.
    if t > 0.0 { t.min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    /// The least distance over a grid of the triangle.
    fn sampled(p: DVec3, [a, b, c]: [DVec3; 3], n: u32) -> f64 {
        let mut least = f64::INFINITY;
        for i in 0..=n {
            for j in 0..=n - i {
                let (s, t) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                least = least.min((a + (b - a) * s + (c - a) * t).distance(p));
            }
        }
        least
    }

    #[test]
    fn no_sampled_point_is_closer() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut point = || DVec3::from_array(rng.random::<[f64; 3]>());
        for case in 0..400 {
            let (p, a, b) = (point() * 2.0 - 0.5, point(), point());
            let c = match case % 4 {
                0 | 1 => point(),
                2 => a.lerp(b, 0.3),
                _ => a,
            };
            let b = if case % 8 == 3 { a } else { b };
            let (q, bary) = closest_point_on_triangle(p, [a, b, c]);
            assert_abs_diff_eq!(bary.iter().sum::<f64>(), 1.0, epsilon = 1e-14);
            assert!(bary.iter().all(|&x| x >= -1e-14));
            assert!((a * bary[0] + b * bary[1] + c * bary[2]).distance(q) < 1e-13);
            let least = sampled(p, [a, b, c], 60);
            assert!(q.distance(p) <= least + 1e-14 && q.distance(p) >= least - 0.05, "case {case}");
        }
    }

    #[test]
    fn slivers_keep_their_digits() {
        let tip = DVec3::new(0.5, 1e-9, 0.0);
        let triangle = [DVec3::ZERO, DVec3::X, tip];
        let (q, _) = closest_point_on_triangle(DVec3::new(0.5, 0.4e-9, 0.25), triangle);
        assert!(q.distance(DVec3::new(0.5, 0.4e-9, 0.0)) < 1e-15, "{q:?}");
        let (q, _) = closest_point_on_triangle(DVec3::new(0.5, 1.0, 0.0), triangle);
        assert!(q.distance(tip) < 1e-15, "{q:?}");
    }
}
