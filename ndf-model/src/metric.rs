//! How much longer lengths on the true surface are than on a mesh of the model.
//!
//! A model in few bytes leaves out fine bumps, so paths on it are short and its eigenvalues high, by a factor that is
//! nearly the same everywhere. What is stored is the area of the true surface: the root of its ratio to the area of an
//! extracted mesh is the mean stretch of lengths, that of chords between the mesh's vertices included. Operators need
//! that factor. Shortest paths go round bumps of which the area counts, so distances need a power of it. Positions stay
//! what they are.
//!
//! A factor for every region, from areas or from distances along many paths, tensors in place of factors, and the stretch
//! where the surface is not steep were no better than one area beyond chance (trials that no command repeats).

use serde::Serialize;

/// The area of the true surface, and what follows from it for lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metric {
    area: f32,
    exponent: f32,
}

/// A number of a metric that is out of range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MetricError {
    /// The area.
    #[error("the area of the true surface is not a positive number")]
    Area,
    /// The exponent.
    #[error("the exponent of distances is not between 0 and 2")]
    Exponent,
}

/// By what lengths on an extracted mesh are multiplied.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LengthFactors {
    /// Where operators are made of them: eigenvalues fall by its square.
    pub operators: f64,
    /// Where distances and paths are measured.
    pub distances: f64,
}

impl LengthFactors {
    /// Lengths as they are.
    pub const ONE: Self = Self { operators: 1.0, distances: 1.0 };
}

impl Metric {
    /// The least and the largest factor: a mesh of which lengths are off by more is too coarse for the metric to be of
    /// use, or the metric is that of another surface.
    pub const FACTORS: [f64; 2] = [0.5, 2.0];

    /// The exponent of distances where it was not measured. On models of four meshes, in 6 to 9 kB and extracted at a
    /// hundredth of the diagonal, exact distances erred least with 0.6 to 0.8.
    pub const EXPONENT: f32 = 0.7;

    /// The metric of a true surface of this area in the box, of whose stretch distances take this power.
    ///
    /// # Errors
    /// Unless the area is positive and finite, and the exponent between 0 and 2.
    pub fn new(area: f32, exponent: f32) -> Result<Self, MetricError> {
        if !(area.is_finite() && area > 0.0) {
            return Err(MetricError::Area);
        }
        if !(0.0..=2.0).contains(&exponent) {
            return Err(MetricError::Exponent);
        }
        Ok(Self { area, exponent })
    }

    /// Area of the true surface in the box.
    pub fn area(&self) -> f32 {
        self.area
    }

    /// The power of the mean stretch that distances take.
    pub fn exponent(&self) -> f32 {
        self.exponent
    }

    /// The factors for a mesh of this area in the box.
    pub fn factors(&self, area: f64) -> LengthFactors {
        let [least, largest] = Self::FACTORS;
        let stretch = (f64::from(self.area) / area).sqrt();
        // A mesh without area has no lengths to be multiplied.
        let stretch = if stretch.is_finite() { stretch.clamp(least, largest) } else { 1.0 };
        let distances = stretch.powf(f64::from(self.exponent)).clamp(least, largest);
        LengthFactors { operators: stretch, distances }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_roots_of_areas_within_bounds() {
        let metric = Metric::new(4.0, 0.5).unwrap();
        assert_eq!(metric.factors(4.0), LengthFactors::ONE);
        let LengthFactors { operators, distances } = metric.factors(4.0 / 1.21);
        assert!((operators - 1.1).abs() < 1e-12 && (distances - 1.1_f64.sqrt()).abs() < 1e-12);
        assert_eq!(metric.factors(1e-9).operators, 2.0);
        assert_eq!(metric.factors(1e9), LengthFactors { operators: 0.5, distances: 0.5_f64.sqrt() });
        assert_eq!(metric.factors(0.0), LengthFactors::ONE);
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        for area in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(Metric::new(area, 1.0), Err(MetricError::Area));
        }
        for exponent in [-0.1, 2.1, f32::NAN] {
            assert_eq!(Metric::new(1.0, exponent), Err(MetricError::Exponent));
        }
    }
}
