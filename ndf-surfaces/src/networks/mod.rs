//! Neural fields: distances, occupancies and densities that are networks, from the checkpoints people have.
//!
//! [`NeuralField::from_tensors`] recognises the layout of a checkpoint by the names and shapes of its tensors and
//! builds the network as a [`Graph`], which gives values and exact gradients of whole batches.

mod activation;
mod encoding;
mod field;
mod graph;
mod hash_grid;
mod layouts;
#[cfg(any(all(test, feature = "instant-ngp"), feature = "samples"))]
pub mod samples;
#[cfg(feature = "instant-ngp")]
mod snapshot;
#[cfg(test)]
mod tests;

pub use activation::{Activation, UnknownActivation};
pub use encoding::Encoding;
pub use field::NeuralField;
pub use graph::{Dense, Graph, NodeId};
pub use hash_grid::{HashGrid, HashGridShape};
pub use layouts::{Latent, LayoutError, NetworkOptions, Quantity};
#[cfg(feature = "instant-ngp")]
pub use snapshot::is_snapshot;
