//! Small fully connected networks in `f32`, evaluated and differentiated for blocks of samples.
//!
//! Matrices are row-major with one row a sample, as in every deep-learning framework. Rows are padded with
//! zeros to a multiple of [`LANES`], so that every kernel works on whole vectors; a block is [`BLOCK`] rows,
//! so that all activations of a block stay in the first-level cache. [`Mlp`] holds the parameters as anyone
//! would write them to a file; [`Packed`] holds them as the kernels want them.
//!
//! Kernels are generic over [`pulp::Simd`], chosen at run time: AVX-512, AVX2 with FMA, NEON, or plain code.

pub mod activation;
pub mod backward;
pub mod encoding;
pub mod forward;
pub mod kernels;
mod lines;
mod mlp;

pub use activation::Activation;
pub use backward::{Gradients, backward, backward_tangent};
pub use forward::{Activations, Packed, forward, forward_tangent};
pub use lines::Lines;
pub use mlp::{Mlp, MlpShape};

/// Rows are padded to a multiple of this many floats (one AVX-512 register).
pub const LANES: usize = 16;

/// Samples in a block.
pub const BLOCK: usize = 32;

/// `width` rounded up to a multiple of [`LANES`].
pub const fn padded(width: usize) -> usize {
    width.next_multiple_of(LANES)
}
