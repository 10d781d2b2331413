//! The shape of a triangle, and whether one may take the place of another.

use ndf_core::DVec3;
use ndf_mesh::ManifoldMesh;

/// `(b − a) × (c − a)`: twice the area, along the normal.
pub fn cross([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Shape from 0 (no area) to 1 (equilateral): 4 √3 area / sum of squared sides (Bank 1979).
pub fn quality(triangle: [DVec3; 3]) -> f64 {
    let [a, b, c] = triangle;
    let sides = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    let quality = 2.0 * 3.0_f64.sqrt() * cross(triangle).length() / sides;
    if quality.is_finite() { quality } else { 0.0 }
}

/// Whether two normals, of any length, enclose an angle with a cosine above `cosine ≥ 0`.
pub fn agree(a: DVec3, b: DVec3, cosine: f64) -> bool {
    let dot = a.dot(b);
    dot > 0.0 && dot * dot > cosine * cosine * a.length_squared() * b.length_squared()
}

/// The smallest angle of every face, in radians, sorted.
pub fn smallest_angles(mesh: &ManifoldMesh) -> Vec<f64> {
    let angle = |[a, b, c]: [DVec3; 3]| {
        let between = |p: DVec3, q: DVec3| p.cross(q).length().atan2(p.dot(q));
        between(b - a, c - a).min(between(c - b, a - b)).min(between(a - c, b - c))
    };
    let mut all: Vec<f64> = mesh.face_indices().map(|f| angle(mesh.corner_positions(f))).collect();
    all.sort_unstable_by(f64::total_cmp);
    all
}
