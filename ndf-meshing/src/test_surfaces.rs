//! Surfaces with known answers for the tests.

use ndf_core::{
    BoundingBox, DVec3, Foot, Hint, Inside, ManifoldMesh, Miss, Projection, Query, ScalarField, Surface,
};

/// A sphere around the origin.
pub(crate) struct Sphere(pub(crate) f64);

impl Surface for Sphere {
    fn bounds(&self) -> BoundingBox {
        BoundingBox { min: DVec3::splat(-self.0), max: DVec3::splat(self.0) }
    }
    fn project(&self, queries: &[Query], feet: &mut [Projection]) {
        for (query, foot) in queries.iter().zip(feet) {
            let normal = query.point.normalize_or(DVec3::X);
            *foot = Ok(Foot { point: normal * self.0, normal, hint: Hint::NONE });
        }
    }
    fn as_field(&self) -> Option<&dyn ScalarField> {
        Some(self)
    }
}

impl ScalarField for Sphere {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        points.iter().zip(values).for_each(|(p, v)| *v = p.length() - self.0);
    }
    fn bounds(&self) -> BoundingBox {
        Surface::bounds(self)
    }
    fn level(&self) -> f64 {
        0.0
    }
    fn inside(&self) -> Inside {
        Inside::Below
    }
    fn lipschitz(&self) -> Option<f64> {
        Some(1.0)
    }
}

/// A torus around the z axis: radii of the ring and the tube.
pub(crate) struct Torus(pub(crate) f64, pub(crate) f64);

impl Surface for Torus {
    fn bounds(&self) -> BoundingBox {
        let side = self.0 + self.1;
        let corner = DVec3::new(side, side, self.1);
        BoundingBox { min: -corner, max: corner }
    }
    fn project(&self, queries: &[Query], feet: &mut [Projection]) {
        for (query, foot) in queries.iter().zip(feet) {
            let p = query.point;
            let core = self.0 * DVec3::new(p.x, p.y, 0.0).normalize_or(DVec3::X);
            let normal = (p - core).normalize_or(DVec3::Z);
            *foot = Ok(Foot { point: core + self.1 * normal, normal, hint: Hint::NONE });
        }
    }
    fn as_field(&self) -> Option<&dyn ScalarField> {
        Some(self)
    }
}

impl ScalarField for Torus {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        for (p, v) in points.iter().zip(values) {
            *v = DVec3::new(p.truncate().length() - self.0, 0.0, p.z).length() - self.1;
        }
    }
    fn bounds(&self) -> BoundingBox {
        Surface::bounds(self)
    }
    fn level(&self) -> f64 {
        0.0
    }
    fn inside(&self) -> Inside {
        Inside::Below
    }
}

/// Closest points of a mesh by trying every face.
pub(crate) struct BruteForce<'a>(pub(crate) &'a ManifoldMesh);

impl Surface for BruteForce<'_> {
    fn bounds(&self) -> BoundingBox {
        self.0.bounds()
    }
    fn project(&self, queries: &[Query], feet: &mut [Projection]) {
        for (query, foot) in queries.iter().zip(feet) {
            let p = query.point;
            let closest = |f: u32| (closest_on_triangle(p, self.0.corner_positions(f)), f);
            let all = (0..self.0.face_count() as u32).map(closest);
            let best = all.min_by(|x, y| x.0.distance_squared(p).total_cmp(&y.0.distance_squared(p)));
            let foot_of = |(point, f): (DVec3, u32)| Foot {
                point,
                normal: self.0.as_triangle_mesh().face_normal(f),
                hint: Hint::NONE,
            };
            *foot = best.map(foot_of).ok_or(Miss::OutOfReach);
        }
    }
}

/// The foot on the plane if inside, otherwise the closest point of the three sides.
fn closest_on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let normal = (b - a).cross(c - a);
    let foot = p - normal * (normal.dot(p - a) / normal.length_squared());
    let sides = [[a, b], [b, c], [c, a]];
    if sides.iter().all(|[x, y]| normal.cross(y - x).dot(foot - x) >= 0.0) {
        return foot;
    }
    let on_side =
        |[x, y]: [DVec3; 2]| x + (y - x) * ((p - x).dot(y - x) / x.distance_squared(y)).clamp(0.0, 1.0);
    let all = sides.map(on_side);
    all.into_iter().min_by(|x, y| x.distance_squared(p).total_cmp(&y.distance_squared(p))).unwrap()
}
