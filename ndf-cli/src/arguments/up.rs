//! What points up.

use clap::Args;

use crate::render::Up;

/// What points up in pictures.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UpArgument {
    /// The direction that points up [default: z for STL, surveys (LAS, E57, PTS, PTX), NeRF and splats and y for the rest, but
    /// the other of both where the shape stands on that one only].
    #[arg(
        long,
        value_enum,
        allow_hyphen_values = true,
        hide_possible_values = true,
        value_name = "x|y|z|-x|-y|-z"
    )]
    pub up: Option<Up>,
}
