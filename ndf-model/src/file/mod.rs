//! The model: a displacement field, the similarity to the user's units, and where it came from; and the `.ndf`
//! file that holds it.

mod base;
pub(crate) mod bytes;
mod connectivity;
mod container;
mod format;
mod grid;
mod network;
pub(crate) mod numbers;
mod precision;
mod range_coder;
mod tensors;
#[cfg(test)]
mod tests;

pub use format::{ModelError, SectionSizes};
pub use precision::{Grids, Precision, StoredBase};
pub use tensors::TensorsError;

use crate::{DisplacementField, Similarity, StoredScalars};

/// Everything a `.ndf` file holds.
#[derive(Clone, Debug)]
pub struct Model {
    /// The field, in the normalised box.
    pub field: DisplacementField,
    /// From the user's units to the box.
    pub similarity: Similarity,
    /// Scalar fields over the base mesh, in the order in which they were learned.
    pub scalars: Vec<StoredScalars>,
    /// How the model was made, as a JSON object: settings, seed, version, metrics. Opaque here.
    pub provenance: String,
}
