//! What is wrong with the parts of a network.

/// Sizes of a network that are not supported: no model is so large, and a hostile file must not cost memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShapeError {
    /// Features of a vertex.
    #[error("more than 4096 features a vertex are not supported")]
    Features,
    /// Octaves of the positional encoding.
    #[error("more than 20 octaves exceed single precision")]
    Octaves,
    /// Number of hidden layers.
    #[error("more than 255 hidden layers are not supported")]
    Layers,
    /// Width of a hidden layer.
    #[error("hidden layers must have 1 to 4096 neurons")]
    Neurons,
}

/// Why parts do not make a network on a base mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// The sizes are not supported.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// Number of features or parameters.
    #[error("{what}: {found} values, {expected} expected")]
    Count {
        /// Features or network parameters.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many the shape asks for.
        expected: usize,
    },
    /// A feature or parameter is NaN or infinite.
    #[error("{0}: a value is not finite")]
    NotFinite(&'static str),
    /// The field is one of levels.
    #[error("the field has no network")]
    NoNetwork,
    /// A base vertex cannot be rounded to `f32`.
    #[error("base vertex {0} is outside the range of single precision")]
    BaseVertex(usize),
}
