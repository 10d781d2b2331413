//! Axis-aligned bounding boxes.

use glam::DVec3;

/// An axis-aligned box `min ≤ p ≤ max`; empty when any `min` exceeds its `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingBox {
    /// Corner with the smallest coordinates.
    pub min: DVec3,
    /// Corner with the largest coordinates.
    pub max: DVec3,
}

impl BoundingBox {
    /// The box that contains nothing.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The smallest box around `points`. Points with a NaN coordinate are ignored in that coordinate.
    pub fn of_points<'a>(points: impl IntoIterator<Item = &'a DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| b.including(*p))
    }

    /// This box, grown to contain `p`.
    #[must_use]
    pub fn including(self, p: DVec3) -> Self {
        // In this order a NaN gives way to what there is.
        Self { min: p.min(self.min), max: p.max(self.max) }
    }

    /// The smallest box that contains both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// This box with every side moved outward by `margin`.
    #[must_use]
    pub fn padded(self, margin: f64) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// Whether the box contains no point.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// Edge lengths of the box (negative in an empty box).
    pub fn extent(&self) -> DVec3 {
        self.max - self.min
    }

    /// Length of the diagonal; 0 for an empty box.
    pub fn diagonal(&self) -> f64 {
        if self.is_empty() { 0.0 } else { self.extent().length() }
    }

    /// Centre of the box.
    pub fn center(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Squared distance from `p` to the box, 0 inside.
    pub fn distance_squared(&self, p: DVec3) -> f64 {
        (self.min - p).max(p - self.max).max(DVec3::ZERO).length_squared()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_that_are_no_numbers_are_ignored_wherever_they_come() {
        let [a, b] = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 5.0, 0.0)];
        let odd = DVec3::new(f64::NAN, 7.0, f64::NAN);
        let truth = BoundingBox { min: DVec3::new(-1.0, 2.0, 0.0), max: DVec3::new(1.0, 7.0, 3.0) };
        for points in [[odd, a, b], [a, odd, b], [a, b, odd]] {
            assert_eq!(BoundingBox::of_points(&points), truth);
        }
    }

    #[test]
    fn empty_box_has_no_diagonal_and_absorbs_nothing() {
        let b = BoundingBox::EMPTY;
        assert!(b.is_empty());
        assert_eq!(b.diagonal(), 0.0);
        let c = b.including(DVec3::ONE);
        assert_eq!((c.min, c.max), (DVec3::ONE, DVec3::ONE));
        assert!(!c.is_empty());
    }

    #[test]
    fn distance_is_zero_inside_and_euclidean_outside() {
        let b = BoundingBox { min: DVec3::ZERO, max: DVec3::ONE };
        assert_eq!(b.distance_squared(DVec3::splat(0.5)), 0.0);
        assert_eq!(b.distance_squared(DVec3::new(4.0, 5.0, 0.5)), 25.0);
    }
}
