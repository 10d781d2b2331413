//! What a user may decide about levels.

use std::time::Duration;

use ndf_mesh::ManifoldMesh;
use ndf_model::levels::MAX_FACES;
use serde::{Deserialize, Serialize};

use super::LevelFitError;

/// What a user may decide about levels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LevelOptions {
    /// Levels with displacements; by the number of base faces where it is `None`.
    pub levels: Option<usize>,
    /// How many bytes there are.
    pub budget: Budget,
    /// Iterations before and after control vertices are on their grid.
    pub iterations: [usize; 2],
    /// Seed of the samples on which the result is measured: nothing else is random.
    pub seed: u64,
    /// Wall time after which learning ends, with few more iterations to end well.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_limit: Option<Duration>,
}

impl LevelOptions {
    /// Levels with displacements above this base mesh.
    pub(super) fn levels_above(&self, base: &ManifoldMesh) -> usize {
        self.levels.unwrap_or(if base.face_count() < FEW_FACES { 3 } else { 2 })
    }
}

/// Fewer base faces than this have a level more.
const FEW_FACES: usize = 2000;

/// How many bytes base mesh and levels may take.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Budget {
    /// So many for every face of the base mesh, and no more than bring the distance below a hundred-thousandth of the
    /// diagonal.
    PerFace(f64),
    /// About so many.
    Bytes(usize),
    /// As many as are worth their price: the price of a bit, in squares of a ten-thousandth of the surface's diagonal.
    Price(f64),
}

impl Budget {
    /// How many faces of a base mesh go with it, where that can be told beforehand.
    pub fn base_faces(self) -> Option<usize> {
        match self {
            Self::Bytes(bytes) => Some(faces_for(bytes)),
            Self::PerFace(_) | Self::Price(_) => None,
        }
    }

    pub(super) fn validate(self) -> Result<(), LevelFitError> {
        let is_valid = match self {
            Self::PerFace(x) | Self::Price(x) => x.is_finite() && x > 0.0,
            Self::Bytes(bytes) => bytes > 0,
        };
        is_valid.then_some(()).ok_or(LevelFitError::Option("the budget of levels must be positive"))
    }
}

/// Bytes for every base face where nothing else is asked for: what balances control vertices with displacements.
pub const BYTES_PER_FACE: f64 = 2.2;

/// The number of base faces that balances control vertices with displacements in so many bytes.
fn faces_for(bytes: usize) -> usize {
    ((bytes as f64 / BYTES_PER_FACE).round() as usize).clamp(MIN_BASE_FACES, MAX_FACES)
}

/// A base mesh with fewer faces hardly has a shape.
const MIN_BASE_FACES: usize = 100;

impl Default for LevelOptions {
    fn default() -> Self {
        let budget = Budget::PerFace(BYTES_PER_FACE);
        Self { levels: None, budget, iterations: [20, 40], seed: 0, time_limit: None }
    }
}
