//! The Euclidean triangle by its side lengths.
//!
//! Sides are `[a, b, c]` in the order of a face's half-edges: side `i` runs from corner `i` to corner `i + 1`.

/// By how much `a + b` exceeds `c` for the longest side `c`; negative where the triangle inequality fails.
pub fn slack(sides: [f64; 3]) -> f64 {
    let [a, b, c] = sides;
    (a + b - c).min(b + c - a).min(c + a - b)
}

/// Area by Kahan's arrangement of Heron's formula (Kahan 2014, "Miscalculating area and angles of a
/// needle-like triangle"): accurate to a few units in the last place also for needles. Sides that violate the
/// triangle inequality give 0.
pub fn area(sides: [f64; 3]) -> f64 {
    let [mut a, mut b, mut c] = sides;
    if a < b {
        (a, b) = (b, a);
    }
    if a < c {
        (a, c) = (c, a);
    }
    if b < c {
        (b, c) = (c, b);
    }
    let product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    0.25 * product.max(0.0).sqrt()
}

/// Twice the dot product of the two sides that meet at the corner opposite to side `side`.
fn twice_dot_opposite(sides: [f64; 3], side: usize) -> f64 {
    let (c, a, b) = (sides[side], sides[(side + 1) % 3], sides[(side + 2) % 3]);
    // a² + b² − c² with less cancellation where the corner is sharp.
    a * a + (b - c) * (b + c)
}

/// Cotangent of the angle opposite to side `side`; ±∞ in a triangle without area.
pub fn cotangent_opposite(sides: [f64; 3], side: usize) -> f64 {
    let dot = twice_dot_opposite(sides, side);
    let area = area(sides);
    if area == 0.0 { f64::INFINITY.copysign(dot) } else { dot / (4.0 * area) }
}

/// Cotangents of the angles opposite to the three sides; ±∞ in a triangle without area.
pub fn cotangents(sides: [f64; 3]) -> [f64; 3] {
    let area = area(sides);
    [0, 1, 2].map(|side| {
        let dot = twice_dot_opposite(sides, side);
        if area == 0.0 { f64::INFINITY.copysign(dot) } else { dot / (4.0 * area) }
    })
}

/// Angle at corner `corner`, in radians, in `[0, π]`.
pub fn angle(sides: [f64; 3], corner: usize) -> f64 {
    (4.0 * area(sides)).atan2(twice_dot_opposite(sides, (corner + 1) % 3))
}

/// The smallest of the three angles, in radians: the one opposite to the shortest side.
pub fn smallest_angle(sides: [f64; 3]) -> f64 {
    let [a, b, c] = sides;
    let corner = if a <= b && a <= c { 2 } else { usize::from(c < b) };
    angle(sides, corner)
}

/// Circumradius; ∞ in a triangle without area.
pub fn circumradius(sides: [f64; 3]) -> f64 {
    let area = area(sides);
    if area == 0.0 { f64::INFINITY } else { sides[0] * sides[1] * sides[2] / (4.0 * area) }
}

/// Barycentric coordinates of the circumcentre; `None` without area.
pub fn circumcenter(sides: [f64; 3]) -> Option<[f64; 3]> {
    let weight = |corner: usize| {
        let opposite = (corner + 1) % 3;
        sides[opposite] * sides[opposite] * twice_dot_opposite(sides, opposite)
    };
    let w = [weight(0), weight(1), weight(2)];
    let sum: f64 = w.iter().sum();
    (sum > 0.0 && sum.is_finite()).then(|| w.map(|x| x / sum))
}

/// The apex of a triangle whose first side lies on the x axis from the origin: the position of corner 2 when
/// corner 0 is at `(0, 0)` and corner 1 at `(sides[0], 0)`; its y is not negative.
pub fn apex(sides: [f64; 3]) -> [f64; 2] {
    let [c, a, b] = sides;
    if c == 0.0 {
        return [0.0, b];
    }
    let x = 0.5 * (c + (b - a) * ((b + a) / c));
    [x, 2.0 * area(sides) / c]
}

/// Length of the vector with barycentric displacement `d` (its three entries sum to 0).
pub fn displacement_length(sides: [f64; 3], d: [f64; 3]) -> f64 {
    // |Σ dᵢ pᵢ|² = − Σ_{i<j} dᵢ dⱼ |pᵢ − pⱼ|²
    let squared = -(d[0] * d[1] * sides[0] * sides[0]
        + d[1] * d[2] * sides[1] * sides[1]
        + d[2] * d[0] * sides[2] * sides[2]);
    squared.max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn right_triangle() {
        let sides = [3.0, 4.0, 5.0];
        assert_relative_eq!(area(sides), 6.0);
        assert_relative_eq!(angle(sides, 1), std::f64::consts::FRAC_PI_2);
        assert_relative_eq!(angle(sides, 0), (4.0_f64 / 3.0).atan());
        assert_relative_eq!(cotangent_opposite(sides, 2), 0.0);
        assert_relative_eq!(circumradius(sides), 2.5);
        let center = circumcenter(sides).unwrap();
        assert_relative_eq!(center[0], 0.5);
        assert_relative_eq!(center[1], 0.0);
        assert_relative_eq!(center[2], 0.5);
        let p = apex(sides);
        assert_relative_eq!(p[0], 3.0);
        assert_relative_eq!(p[1], 4.0);
        assert_relative_eq!(displacement_length(sides, [-1.0, 0.5, 0.5]), (9.0_f64 + 4.0).sqrt());
    }

    #[test]
    fn needles_and_impossible_triangles() {
        let needle = [1.0, 1.0, 1e-12];
        assert_relative_eq!(area(needle), 0.5e-12, max_relative = 1e-12);
        assert_relative_eq!(angle(needle, 1), 1e-12, max_relative = 1e-3);
        assert_eq!(area([1.0, 1.0, 3.0]), 0.0);
        assert_eq!(slack([1.0, 1.0, 3.0]), -1.0);
        assert_eq!(cotangent_opposite([1.0, 1.0, 2.0], 2), f64::NEG_INFINITY);
        assert!(circumcenter([0.0, 0.0, 0.0]).is_none());
    }
}
