//! Layout of triangles in the plane.

use robust::{Coord, orient2d};

use crate::triangle;

/// A point of the plane.
pub(crate) type Point = [f64; 2];

/// Positive if a, b, c turn counter-clockwise, exactly (Shewchuk 1997).
pub(crate) fn orientation(a: Point, b: Point, c: Point) -> f64 {
    let coord = |p: Point| Coord { x: p[0], y: p[1] };
    orient2d(coord(a), coord(b), coord(c))
}

pub(crate) fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

pub(crate) fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub(crate) fn lerp(a: Point, b: Point, t: f64) -> Point {
    [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
}

pub(crate) fn distance(a: Point, b: Point) -> f64 {
    let d = minus(a, b);
    // Not `hypot`, which takes several times as long: lengths whose squares overflow are no lengths of meshes.
    dot(d, d).sqrt()
}

/// The point with coordinates `local` in the frame that has its origin at `a` and its x axis towards `b`.
pub(crate) fn in_frame(a: Point, b: Point, local: Point) -> Point {
    let d = minus(b, a);
    let length = distance(a, b);
    let u = if length > 0.0 { [d[0] / length, d[1] / length] } else { [1.0, 0.0] };
    [a[0] + local[0] * u[0] - local[1] * u[1], a[1] + local[0] * u[1] + local[1] * u[0]]
}

/// The third corner of a triangle with these sides, the first from `a` to `b`, to the left of it.
pub(crate) fn third_corner(a: Point, b: Point, sides: [f64; 3]) -> Point {
    in_frame(a, b, triangle::apex(sides))
}

/// The point with these barycentric coordinates.
pub(crate) fn from_barycentric(corners: [Point; 3], b: [f64; 3]) -> Point {
    [0, 1].map(|k| corners[0][k] * b[0] + corners[1][k] * b[1] + corners[2][k] * b[2])
}

/// Barycentric coordinates of the point of a triangle nearest to `p`, nearly: coordinates below zero are taken
/// as zero. In a triangle without area, those of its centre.
pub(crate) fn barycentric_clamped(corners: [Point; 3], p: Point) -> [f64; 3] {
    let part = |c: usize| {
        let (a, b) = (corners[(c + 1) % 3], corners[(c + 2) % 3]);
        cross(minus(b, a), minus(p, a)).max(0.0)
    };
    normalised([part(0), part(1), part(2)])
}

/// Non-negative weights scaled to the sum 1.
pub(crate) fn normalised(weights: [f64; 3]) -> [f64; 3] {
    let sum: f64 = weights.iter().sum();
    if sum > 0.0 && sum.is_finite() { weights.map(|w| w / sum) } else { [1.0 / 3.0; 3] }
}
