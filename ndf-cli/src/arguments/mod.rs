//! Arguments that several commands share, and the values of the library they stand for.

mod edge_length;
mod numbers;
mod parts;
mod reading;
mod training;
mod triangulation;

pub use edge_length::EdgeLength;
pub use numbers::{bits, length, point, seconds, share};
pub use parts::PartArguments;
pub use reading::Reading;
pub use training::{PresetName, Training};
pub use triangulation::TriangulationArguments;
