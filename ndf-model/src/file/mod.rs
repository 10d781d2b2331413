//! The `.ndf` file, how finely it keeps numbers, and models as `.safetensors`.

mod base;
mod bytes;
mod connectivity;
mod container;
mod error;
mod format;
mod grid;
mod levels;
mod metric;
mod network;
mod numbers;
mod precision;
mod range_coder;
mod scalar_levels;
mod scalars;
mod tensors;
#[cfg(test)]
mod tests;

pub use connectivity::BaseOrder;
pub use error::{ModelError, PartDefect, TensorsError};
pub use format::SectionSizes;
pub use levels::LevelCoder;
pub use precision::{Grids, Precision, StoredBase};
