//! Small fully connected networks in `f32`, evaluated and differentiated for blocks of samples.
//!
//! Matrices are row-major with one row a sample, as in every deep-learning framework. Rows are padded with
//! zeros to a multiple of [`LANES`], so that every kernel works on whole vectors; a block is [`BLOCK`] rows,
//! so that all activations of a block stay in the first-level cache. [`Mlp`] holds the parameters as anyone
//! would write them to a file; [`Packed`] holds them as the kernels want them.
//!
//! Kernels are generic over pulp's `Simd`, chosen at run time: AVX-512, AVX2 with FMA, NEON, or plain code. Crates that
//! fuse them into loops of their own find them in the hidden module `simd`, which promises no stable interface.
//!
//! ```
//! use ndf_network::{Activation, Mlp, MlpShape};
//! // |x| = max(x, 0) + max(−x, 0): weights and biases of each layer in turn.
//! let shape = MlpShape { inputs: 1, hidden: vec![2], outputs: 1, activation: Activation::Relu };
//! let network = Mlp::new(shape, vec![1.0, -1.0, 0.0, 0.0, 1.0, 1.0, 0.0])?;
//! assert_eq!(network.evaluate(&[-3.0, 0.5]), [3.0, 0.5]);
//! # Ok::<(), ndf_network::ParameterCount>(())
//! ```

pub mod activation;
mod backward;
pub mod encoding;
mod forward;
mod fused;
mod kernels;
mod lines;
mod mlp;

pub use activation::Activation;
pub use backward::Gradients;
pub use forward::{Activations, Packed};
pub use mlp::{Mlp, MlpShape, ParameterCount};

use lines::Lines;

/// What is generic over pulp's `Simd`: for crates that fuse it into loops of their own.
#[doc(hidden)]
pub mod simd {
    pub use crate::backward::{InputGradient, backward, backward_tangent};
    pub use crate::forward::{forward, forward_tangent};
}

/// Rows are padded to a multiple of this many floats (one AVX-512 register).
pub const LANES: usize = 16;

/// Samples in a block.
pub const BLOCK: usize = 32;

/// `width` rounded up to a multiple of [`LANES`].
pub const fn padded(width: usize) -> usize {
    width.next_multiple_of(LANES)
}
