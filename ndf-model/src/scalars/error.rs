//! Why parts do not make scalar fields.

use crate::intrinsic_network::NetworkError;

/// More channels than this are refused.
pub const MAX_CHANNELS: usize = 4096;

/// Why parts do not make scalar fields.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ScalarsError {
    /// There is no channel.
    #[error("no scalar fields given")]
    Empty,
    /// There are too many channels.
    #[error("{0} scalar fields given; at most {MAX_CHANNELS} are supported")]
    TooMany(usize),
    /// A name that cannot stand in a file.
    #[error(
        "{0:?} cannot name a scalar field: it must be one word of up to 255 characters of ASCII other than x, y, z"
    )]
    Name(String),
    /// Two channels of one name.
    #[error("two scalar fields are named {0}")]
    Repeated(String),
    /// The range, mean or deviation of a channel make no sense.
    #[error("the range of the scalar field {0} makes no sense")]
    Range(String),
    /// Features and parameters do not make a network.
    #[error(transparent)]
    Network(#[from] NetworkError),
}
