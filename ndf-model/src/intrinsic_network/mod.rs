//! The *intrinsic encoding* and the network that it feeds.
//!
//! A point x of a base mesh is known to a perceptron by `[z(x), x, PE(x)]`: the intrinsic encoding z, which is a feature
//! vector at every base vertex interpolated by barycentric coordinates, the coordinates themselves, and a positional
//! encoding of them. The displacement field and the scalars on it are such networks.
//!
//! [`IntrinsicEncoding`] alone knows how the input of the network comes about: it writes rows of input, their
//! derivatives, and carries gradients back to the features. Everything else sees rows.

mod encoding;
mod error;
mod evaluation;
mod network;
mod shape;

pub use encoding::{IntrinsicEncoding, single};
pub use error::{NetworkError, ShapeError};
pub use network::IntrinsicNetwork;
pub use shape::{ChannelIndex, NetworkShape, Passes};

pub(crate) use evaluation::Part;
pub(crate) use shape::MAX_FEATURES;
