//! How much longer lengths on the true surface are than on a model.
//!
//! A model in few bytes leaves out fine bumps, so paths on it are short and its eigenvalues high, by a factor that is
//! nearly the same everywhere. That factor is stored. Operators need it; shortest paths go round bumps of which the area
//! counts, so distances need a power of it. Triangles between points of the model are smaller than the surface through
//! them in turn, by a share that grows with the square of their edges
//! ([`LevelSurface::bulge`](crate::levels::LevelSurface::bulge)). Positions stay what they are.
//!
//! A factor for every region, from areas or from distances along many paths, and tensors in place of factors were
//! measured, too: they make no difference beyond chance for distances, and a tenth at best for eigenvalues.

use serde::Serialize;

/// The mean stretch of lengths from a model to the true surface, and its power for distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metric {
    stretch: f32,
    exponent: f32,
}

/// A number of a metric that is out of range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MetricError {
    /// The stretch.
    #[error("the stretch of lengths is not between 0.5 and 2")]
    Stretch,
    /// The exponent.
    #[error("the exponent of distances is not between 0 and 2")]
    Exponent,
}

/// By what lengths on a mesh of a model are multiplied.
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

    /// The metric with this stretch, of which distances take this power.
    ///
    /// # Errors
    /// Unless the stretch is between 0.5 and 2, and the exponent between 0 and 2.
    pub fn new(stretch: f32, exponent: f32) -> Result<Self, MetricError> {
        let [least, largest] = Self::FACTORS;
        if !(least..=largest).contains(&f64::from(stretch)) {
            return Err(MetricError::Stretch);
        }
        if !(0.0..=2.0).contains(&exponent) {
            return Err(MetricError::Exponent);
        }
        Ok(Self { stretch, exponent })
    }

    /// Lengths on the true surface over those on the model, in the mean: the root of what areas are.
    pub fn stretch(&self) -> f32 {
        self.stretch
    }

    /// The power of the stretch that distances take.
    pub fn exponent(&self) -> f32 {
        self.exponent
    }

    /// The factors for triangles between points of a model whose own area is larger by the share `bulge`.
    pub fn factors(&self, bulge: f64) -> LengthFactors {
        let [least, largest] = Self::FACTORS;
        let chords = (1.0 + bulge).max(0.0).sqrt();
        let factor = |exponent: f64| (f64::from(self.stretch).powf(exponent) * chords).clamp(least, largest);
        LengthFactors { operators: factor(1.0), distances: factor(f64::from(self.exponent)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_powers_of_the_stretch_and_roots_of_areas() {
        assert_eq!(Metric::new(1.0, 0.5).unwrap().factors(0.0), LengthFactors::ONE);
        let metric = Metric::new(1.21, 0.5).unwrap();
        let LengthFactors { operators, distances } = metric.factors(0.0);
        assert!((operators - 1.21).abs() < 1e-6 && (distances - 1.1).abs() < 1e-6);
        let LengthFactors { operators, distances } = metric.factors(0.44);
        assert!((operators - 1.21 * 1.2).abs() < 1e-6 && (distances - 1.1 * 1.2).abs() < 1e-6);
        assert_eq!(metric.factors(1e9), LengthFactors { operators: 2.0, distances: 2.0 });
        assert_eq!(metric.factors(-9.0), LengthFactors { operators: 0.5, distances: 0.5 });
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        for stretch in [0.0, -1.0, 0.49, 2.01, f32::NAN, f32::INFINITY] {
            assert_eq!(Metric::new(stretch, 1.0), Err(MetricError::Stretch));
        }
        for exponent in [-0.1, 2.1, f32::NAN] {
            assert_eq!(Metric::new(1.0, exponent), Err(MetricError::Exponent));
        }
    }
}
