//! The model: a displacement field on a base mesh, scalar fields on it, the similarity to the user's units, and the
//! `.ndf` file that holds them.
//!
//! Networks are `f32`, geometry is `f64`; the conversion happens in one place, [the displacement field](field).

pub mod field;
pub mod file;
pub mod scalars;
pub mod similarity;

pub use field::{DisplacementField, FieldShape};
pub use file::Model;
pub use scalars::StoredScalars;
pub use similarity::Similarity;
