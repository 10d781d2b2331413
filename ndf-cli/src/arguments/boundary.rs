//! Boundary conditions.

use clap::ValueEnum;

/// What functions are at the boundary of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Boundary {
    /// Values are held: modes are zero, and temperatures stay what they are at first.
    Dirichlet,
    /// Values are free, and nothing flows out.
    #[default]
    Neumann,
}
