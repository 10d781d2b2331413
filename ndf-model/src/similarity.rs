//! The uniform scale and shift between a user's units and the box of the method.

use ndf_core::{BoundingBox, DVec3};

/// Half the side of the cube `[-1.5, 1.5]³` that the base mesh fills (supplement, §1.1).
pub const BOX_HALF_SIDE: f64 = 1.5;

/// A uniform scale and a shift: `normalised = scale · (world − center)`.
///
/// ```
/// use ndf_core::{BoundingBox, DVec3};
/// use ndf_model::Similarity;
/// let s = Similarity::from_bounds(&BoundingBox { min: DVec3::ZERO, max: DVec3::new(10.0, 2.0, 4.0) });
/// assert_eq!(s.to_normalised(DVec3::new(10.0, 1.0, 2.0)), DVec3::new(1.5, 0.0, 0.0));
/// assert_eq!(s.length_to_world(3.0), 10.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    scale: f64,
    center: DVec3,
}

/// With others, points of the box would not be finite in the world, or squares of lengths neither finite nor above 0.
const SCALES: std::ops::RangeInclusive<f64> = 1e-150..=1e150;

/// A scale that is too small, too large or no number, or a centre that is not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the scale or the centre is out of range")]
pub struct SimilarityError;

impl Similarity {
    /// The identity.
    pub const IDENTITY: Self = Self { scale: 1.0, center: DVec3::ZERO };

    /// The map with the given scale and centre.
    ///
    /// # Errors
    /// Unless the scale is between 10⁻¹⁵⁰ and 10¹⁵⁰ and the centre finite.
    pub fn new(scale: f64, center: DVec3) -> Result<Self, SimilarityError> {
        match (SCALES.contains(&scale), center.is_finite()) {
            (true, true) => Ok(Self { scale, center }),
            _ => Err(SimilarityError),
        }
    }

    /// The map under which `bounds` fills the box: its centre goes to the origin and its longest side gets
    /// length 3. A box without extent is only centred.
    pub fn from_bounds(bounds: &BoundingBox) -> Self {
        let side = bounds.extent().max_element();
        let center = if bounds.is_empty() { DVec3::ZERO } else { bounds.center() };
        Self::new(2.0 * BOX_HALF_SIDE / side, center)
            .or_else(|_| Self::new(1.0, center))
            .unwrap_or(Self::IDENTITY)
    }

    /// Normalised length of a unit of the world.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// The world point that goes to the origin.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// World point → normalised point.
    pub fn to_normalised(&self, p: DVec3) -> DVec3 {
        (p - self.center) * self.scale
    }

    /// Normalised point → world point.
    pub fn to_world(&self, p: DVec3) -> DVec3 {
        p / self.scale + self.center
    }

    /// World length → normalised length.
    pub fn length_to_normalised(&self, length: f64) -> f64 {
        length * self.scale
    }

    /// Normalised length → world length.
    pub fn length_to_world(&self, length: f64) -> f64 {
        length / self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn round_trip_is_the_identity() {
        let s = Similarity::new(0.37, DVec3::new(12.0, -5.0, 1e3)).unwrap();
        let p = DVec3::new(-3.0, 0.25, 17.0);
        assert_relative_eq!((s.to_world(s.to_normalised(p)) - p).length(), 0.0, epsilon = 1e-12);
        assert_relative_eq!(s.length_to_world(s.length_to_normalised(2.5)), 2.5, epsilon = 1e-15);
    }

    #[test]
    fn degenerate_scales_are_refused() {
        assert!(Similarity::new(0.0, DVec3::ZERO).is_err());
        assert!(Similarity::new(f64::NAN, DVec3::ZERO).is_err());
        assert!(Similarity::new(f64::MIN_POSITIVE, DVec3::ZERO).is_err());
        assert!(Similarity::new(1e151, DVec3::ZERO).is_err());
        assert_eq!(Similarity::from_bounds(&BoundingBox::EMPTY), Similarity::IDENTITY);
    }
}
