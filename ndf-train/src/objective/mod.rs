//! The objective: a weighted sum of [terms](Term), stage after stage.
//!
//! A [`Term`] sees a [`Block`] of samples and returns its value with the gradients by what it looks at; the engine carries
//! these through the network to features and weights. To add one, implement the trait and hand it to
//! [`Trainer::with_term`](crate::Trainer::with_term); [`loss_conformance!`](crate::loss_conformance) tests its gradients.
//! They may be written by hand, as here, or left to a differentiator: `examples/keep_area.rs` lets a [tape](crate::tape) do
//! it. The terms of the paper, its cycle loss, anchors and identity stage are made of nothing else.

mod anchors;
mod block;
mod conformal;
mod cycle;
mod dirichlet;
mod normal;
pub(crate) mod origin;
mod place;
mod point;
mod projection;
mod stage;
mod target;
mod term;
#[cfg(test)]
mod tests;

pub use anchors::Anchors;
pub use block::{Block, Epoch, Gradients, OwnNetwork};
pub use conformal::Conformal;
pub use cycle::Cycle;
pub use dirichlet::Dirichlet;
pub use normal::NormalAlignment;
pub use point::PointTarget;
pub use projection::ProjectionDistance;
pub use target::{FixedPoints, Target};
pub use term::{Needs, Prepared, Projecting, Term};

pub(crate) use place::Place;
pub(crate) use stage::{Images, Stage, stages};
