//! Surfaces with known answers for the tests.

use ndf_core::{Answer, BoundingBox, DVec3, Foot, Hint, ImplicitField, Inside, Query, Surface};

/// A sphere around the origin.
pub(crate) struct Sphere(pub(crate) f64);

impl Surface for Sphere {
    fn bounds(&self) -> BoundingBox {
        BoundingBox { min: DVec3::splat(-self.0), max: DVec3::splat(self.0) }
    }
    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        for (query, foot) in queries.iter().zip(feet) {
            let normal = query.point.normalize_or(DVec3::X);
            *foot = Ok(Foot { point: normal * self.0, normal, hint: Hint::NONE });
        }
    }
    fn as_field(&self) -> Option<&dyn ImplicitField> {
        Some(self)
    }
}

impl ImplicitField for Sphere {
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
    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        for (query, foot) in queries.iter().zip(feet) {
            let p = query.point;
            let core = self.0 * DVec3::new(p.x, p.y, 0.0).normalize_or(DVec3::X);
            let normal = (p - core).normalize_or(DVec3::Z);
            *foot = Ok(Foot { point: core + self.1 * normal, normal, hint: Hint::NONE });
        }
    }
    fn as_field(&self) -> Option<&dyn ImplicitField> {
        Some(self)
    }
}

impl ImplicitField for Torus {
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
