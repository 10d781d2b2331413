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
    /// The base mesh has too many faces for so many nodes.
    #[error("the base mesh has too many faces to be split so often")]
    Nodes,
    /// The base mesh has vertices of absurd degrees.
    #[error("the base mesh is too irregular for scalars on levels")]
    Irregular,
    /// Not as many integers or steps as the nodes have.
    #[error("there are not as many integers and steps as the nodes of the base mesh need")]
    Integers,
    /// A step that is not positive, or not finite.
    #[error("the step of the scalars is not a positive number")]
    Step,
    /// Integers and steps lead to no numbers.
    #[error("the scalars have values that are not finite")]
    NotFinite,
    /// Features and parameters do not make a network.
    #[error(transparent)]
    Network(#[from] NetworkError),
}
