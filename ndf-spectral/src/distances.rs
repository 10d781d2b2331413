//! Distances by modes: those between the rows of `Φ` under weights that fall with the eigenvalue.

use crate::error::SpectralError;
use crate::modes::Modes;

/// Which distance. Squared, each is `Σ w(λ) (φ(x) − φ(y))²`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpectralDistance {
    /// `w = exp(−2λt)` (Coifman and Lafon 2006), for a time in squared units of length: compares how
    /// heat from the two points has spread after that time.
    Diffusion(f64),
    /// `w = 1/λ` (Fouss et al. 2007). On a surface the sum over all modes diverges (as a logarithm): a measure of scale
    /// only for a given number of modes.
    Commute,
    /// `w = 1/λ²` (Lipman, Rustamov and Funkhouser 2010, eq. 3): smooth, and like a geodesic distance near the source.
    /// In units of length.
    Biharmonic,
}

impl Modes {
    /// Distances of all vertices from one, summed over the modes at hand. Between components, diffusion distances
    /// are finite and the others infinite. O(V · modes).
    ///
    /// # Errors
    /// If the time of a diffusion is not positive.
    ///
    /// # Panics
    /// If the vertex does not exist.
    pub fn distances_from(
        &self,
        source: usize,
        distance: SpectralDistance,
    ) -> Result<Vec<f64>, SpectralError> {
        let weight: Box<dyn Fn(f64) -> f64> = match distance {
            SpectralDistance::Diffusion(time) if time.is_nan() || time <= 0.0 => {
                return Err(SpectralError::NotPositive { name: "the time", value: time });
            }
            SpectralDistance::Diffusion(time) => Box::new(move |lambda| (-2.0 * lambda * time).exp()),
            SpectralDistance::Commute => Box::new(f64::recip),
            SpectralDistance::Biharmonic => Box::new(|lambda| lambda.powi(-2)),
        };
        let mut squares = vec![0.0; self.functions.vertex_count()];
        for (function, &lambda) in self.functions.iter().zip(&self.eigenvalues) {
            let (weight, from) = (weight(lambda), function[source]);
            for (square, x) in squares.iter_mut().zip(function.iter()) {
                // Differences of functions that are constant there: zero, also times infinity.
                if *x != from {
                    *square += weight * (x - from).powi(2);
                }
            }
        }
        Ok(squares.into_iter().map(f64::sqrt).collect())
    }
}
