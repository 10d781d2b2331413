//! The model: a displacement field, the similarity to the user's units, and where it came from; and the `.ndf`
//! file that holds it.

mod base;
mod bytes;
mod connectivity;
mod features;
mod format;
mod grid;
mod network;
mod precision;
mod range_coder;

pub use format::{ModelError, SectionSizes};
pub use precision::{Grids, Precision, stored_base};

use crate::{DisplacementField, Similarity};

/// Everything a `.ndf` file holds.
#[derive(Clone, Debug)]
pub struct Model {
    /// The field, in the normalised box.
    pub field: DisplacementField,
    /// From the user's units to the box.
    pub similarity: Similarity,
    /// How the model was made, as a JSON object: settings, seed, version, metrics. Opaque here.
    pub provenance: String,
}
