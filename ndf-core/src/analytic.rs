//! Surfaces in closed form, for examples and as the truth of tests: [`Sphere`] and [`Torus`].
//!
//! Both are exact: feet are closest points, and their [fields](ImplicitField) are signed distances, negative inside.

use std::f64::consts::PI;

use crate::{Answer, BoundingBox, DVec3, Foot, Hint, ImplicitField, Inside, Miss, Query, Surface};

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Its centre.
    pub center: DVec3,
    /// Its radius, positive.
    pub radius: f64,
}

impl Sphere {
    /// The unit sphere around the origin.
    pub const UNIT: Self = Self { center: DVec3::ZERO, radius: 1.0 };
}

/// A torus around the z axis through its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torus {
    /// Its centre.
    pub center: DVec3,
    /// Distance of the core circle from the axis.
    pub ring: f64,
    /// Radius of the tube, less than the ring.
    pub tube: f64,
}

impl Torus {
    /// The point of the core circle closest to `p`; any of them where `p` is on the axis.
    fn core(&self, p: DVec3) -> DVec3 {
        let from_axis = (p - self.center).with_z(0.0);
        self.center + self.ring * from_axis.try_normalize().unwrap_or(DVec3::X)
    }
}

/// The foot of `query` on the sphere of `radius` around `center`; straight up where the query is the centre.
fn foot_on_sphere(query: &Query, center: DVec3, radius: f64) -> Answer {
    if !query.point.is_finite() {
        return Err(Miss::NotFinite);
    }
    let normal = (query.point - center).try_normalize().unwrap_or(DVec3::Z);
    Ok(Foot { point: center + radius * normal, normal, hint: Hint::NONE })
}

impl Surface for Sphere {
    fn bounds(&self) -> BoundingBox {
        BoundingBox { min: self.center - self.radius, max: self.center + self.radius }
    }

    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        for (query, foot) in queries.iter().zip(feet) {
            *foot = foot_on_sphere(query, self.center, self.radius);
        }
    }

    fn area(&self) -> Option<f64> {
        Some(4.0 * PI * self.radius * self.radius)
    }

    fn as_field(&self) -> Option<&dyn ImplicitField> {
        Some(self)
    }
}

impl Surface for Torus {
    fn bounds(&self) -> BoundingBox {
        let extent = DVec3::new(self.ring + self.tube, self.ring + self.tube, self.tube);
        BoundingBox { min: self.center - extent, max: self.center + extent }
    }

    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        for (query, foot) in queries.iter().zip(feet) {
            *foot = foot_on_sphere(query, self.core(query.point), self.tube);
        }
    }

    fn area(&self) -> Option<f64> {
        Some(4.0 * PI * PI * self.ring * self.tube)
    }

    fn as_field(&self) -> Option<&dyn ImplicitField> {
        Some(self)
    }
}

/// Signed distances by a function of the point.
macro_rules! signed_distance_field {
    ($surface:ty, $distance:expr) => {
        impl ImplicitField for $surface {
            fn values(&self, points: &[DVec3], values: &mut [f64]) {
                let distance: fn(&Self, DVec3) -> f64 = $distance;
                points.iter().zip(values).for_each(|(&p, value)| *value = distance(self, p));
            }

            fn gradients(&self, points: &[DVec3], gradients: &mut [DVec3]) {
                for (&p, gradient) in points.iter().zip(gradients) {
                    let mut answer = [Err(Miss::NotFinite)];
                    self.project(&[Query::at(p)], &mut answer);
                    *gradient = answer[0].map_or(DVec3::NAN, |foot| foot.normal);
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

            fn lipschitz(&self) -> Option<f64> {
                Some(1.0)
            }
        }
    };
}

signed_distance_field!(Sphere, |sphere, p| p.distance(sphere.center) - sphere.radius);
signed_distance_field!(Torus, |torus, p| p.distance(torus.core(p)) - torus.tube);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::Facts;

    const TORUS: Torus = Torus { center: DVec3::new(3.0, -1.0, 0.5), ring: 2.0, tube: 0.5 };

    crate::surface_conformance!(
        sphere,
        Sphere::UNIT,
        Facts::closed().through([DVec3::X, -DVec3::Y, DVec3::Z])
    );
    crate::surface_conformance!(
        torus,
        TORUS,
        Facts::closed().through([
            DVec3::new(5.5, -1.0, 0.5),
            DVec3::new(3.0, 0.5, 0.5),
            DVec3::new(3.0, -3.0, 1.0)
        ])
    );
}
