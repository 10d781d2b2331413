//! What a bit is worth.

use ndf_mesh::ManifoldMesh;

use super::options::Budget;

/// The smallest budget by faces: what a few faces are said to need.
const FEW_BYTES: f64 = 600.0;

/// The least price of a bit: what is closer than a millionth of the diagonal needs no bits.
const MIN_PRICE: f64 = 1e-9;

/// Below this root mean square distance, in units, more bytes are not worth having where they are not asked for.
const CLOSE_ENOUGH: f64 = 0.1;

/// The price of a bit, which follows the size that is wanted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Price {
    pub(super) lambda: f64,
    /// Bytes that are wanted.
    bytes: Option<f64>,
    /// The price does not fall any more below this distance.
    close_enough: f64,
}

impl Price {
    pub(super) fn new(budget: Budget, base: &ManifoldMesh, rms: f64) -> Self {
        // Distances fall with the reciprocal of the size, D = c / bits², so that a bit is worth 2 D / bits; at first the
        // distance is several times what it will be.
        let guess = |bytes: f64| ((rms / 4.0).powi(2) / (4.0 * bytes)).max(MIN_PRICE);
        match budget {
            Budget::Price(lambda) => Self { lambda, bytes: None, close_enough: 0.0 },
            Budget::Bytes(bytes) => {
                let bytes = bytes as f64;
                Self { lambda: guess(bytes), bytes: Some(bytes), close_enough: 0.0 }
            }
            Budget::PerFace(bytes) => {
                let bytes = (bytes * base.face_count() as f64).max(FEW_BYTES);
                Self { lambda: guess(bytes), bytes: Some(bytes), close_enough: CLOSE_ENOUGH }
            }
        }
    }

    /// The same at this λ.
    pub(super) fn at(self, lambda: f64) -> Self {
        Self { lambda, ..self }
    }

    /// Changes λ so that the size comes nearer to what is wanted: as long as it is annealed to the price at which the
    /// law above has that size, from the distance and the size that there are; then by what the size is off, which is
    /// proportional to λ^(−1/3). Half of that correction is made, since the numbers follow slowly.
    pub(super) fn follow(&mut self, sizes: [usize; 2], on_grid: bool, rms: f64) {
        let Some(bytes) = self.bytes else { return };
        let size = sizes.into_iter().sum::<usize>() as f64;
        let factor = if on_grid {
            (size / bytes).powf(1.5).clamp(0.6, 1.6)
        } else {
            let rms = rms.max(self.close_enough);
            let wanted = rms * rms * size * size / (4.0 * bytes.powi(3));
            (wanted / self.lambda).clamp(0.05, 20.0)
        };
        if !on_grid || rms > self.close_enough || factor > 1.0 {
            self.lambda = (self.lambda * factor).max(MIN_PRICE);
        }
    }
}
