//! Telling whether two runs learn the same surface.

use ndf_core::{BoundingBox, DVec3, Query, Surface};
use serde::{Deserialize, Serialize};

/// Points that are projected.
const POINTS: usize = 24;
/// How far apart two answers of one surface may be, as a share of its diagonal: machines round differently.
const TOLERANCE: f64 = 1e-6;
/// How many answers may differ all the same: where two feet are equally near, rounding decides.
const MAX_DIFFERENT: usize = POINTS / 6;

/// A few projections onto a surface, by which it is recognised later. Changes in a small part of a surface go unnoticed. Costs
/// 24 projections; lengths are in the surface's units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Likeness {
    bounds: [[f64; 3]; 2],
    /// The feet of a fixed set of points in the bounds; none where a point has no foot.
    feet: Vec<Option<[f64; 3]>>,
}

impl Likeness {
    /// Projects onto a surface.
    pub fn of(surface: &dyn Surface) -> Self {
        let bounds = surface.bounds();
        let queries: Vec<Query> = (0..POINTS).map(|k| Query::at(point_in(&bounds, k))).collect();
        let mut answers = vec![Err(ndf_core::Miss::OutOfReach); POINTS];
        surface.project(&queries, &mut answers);
        let feet = answers.into_iter().map(|answer| answer.ok().map(|foot| foot.point.to_array()));
        Self { bounds: [bounds.min.to_array(), bounds.max.to_array()], feet: feet.collect() }
    }

    /// Whether the surface answers as the one that this was made of, up to rounding and what its tolerance allows.
    pub fn is_of(&self, surface: &dyn Surface) -> bool {
        let other = Self::of(surface);
        let reach = TOLERANCE * surface.bounds().diagonal() + 2.0 * surface.tolerance();
        let near = |a: &[f64; 3], b: &[f64; 3]| DVec3::from(*a).distance(DVec3::from(*b)) <= reach;
        let alike = |(a, b): (&Option<[f64; 3]>, &Option<[f64; 3]>)| match (a, b) {
            (Some(a), Some(b)) => near(a, b),
            (a, b) => a == b,
        };
        let different = self.feet.iter().zip(&other.feet).filter(|&pair| !alike(pair)).count();
        let same_box = self.bounds.iter().zip(&other.bounds).all(|(a, b)| near(a, b));
        same_box && self.feet.len() == other.feet.len() && different <= MAX_DIFFERENT
    }
}

/// A point of Roberts' R₃ sequence (2018), which fills a box evenly and lies in no plane of symmetry.
fn point_in(bounds: &BoundingBox, k: usize) -> DVec3 {
    /// The root of x⁴ = x + 1.
    const G: f64 = 1.220_744_084_605_759_6;
    let steps = DVec3::new(1.0 / G, 1.0 / (G * G), 1.0 / (G * G * G));
    let share = ((k + 1) as f64 * steps + 0.37).map(f64::fract);
    bounds.min + share * bounds.extent()
}

#[cfg(test)]
mod tests {
    use ndf_core::analytic::{Sphere, Torus};

    use super::*;

    #[test]
    fn a_surface_is_known_again_and_others_are_not() {
        let sphere = Sphere::UNIT;
        let likeness = Likeness::of(&sphere);
        let text = serde_json::to_string(&likeness).unwrap();
        let read: Likeness = serde_json::from_str(&text).unwrap();
        assert!(read.is_of(&sphere));
        assert!(!likeness.is_of(&Sphere { radius: 1.001, ..sphere }));
        assert!(!likeness.is_of(&Sphere { center: DVec3::new(0.0, 0.0, 1e-3), ..sphere }));
        let torus = Torus { center: DVec3::ZERO, ring: 0.7, tube: 0.3 };
        assert!(Likeness::of(&torus).is_of(&torus));
        // Their boxes differ by 0.0001 in one direction.
        assert!(!Likeness::of(&torus).is_of(&Torus { ring: 0.6999, tube: 0.3001, ..torus }));
    }
}
