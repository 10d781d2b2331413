//! The edge length of meshes of models.

use clap::Args;

use super::numbers::length;

/// The edge length wanted.
#[derive(Args, Clone, Copy, Debug)]
#[group(required = true, multiple = false)]
pub struct EdgeLength {
    /// Edge length in the input's units: a target, or a maximum with `--no-refine`.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length)]
    edge_length: Option<f64>,
    /// The same in the box [-1.5, 1.5]³ that the base mesh fills.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length)]
    relative_edge_length: Option<f64>,
}

impl EdgeLength {
    /// The same for the library.
    pub fn get(self) -> ndf::EdgeLength {
        of(self.edge_length, self.relative_edge_length).expect("the group of arguments is required")
    }
}

/// The one of two lengths that is given.
pub(super) fn of(edge_length: Option<f64>, relative_edge_length: Option<f64>) -> Option<ndf::EdgeLength> {
    edge_length.map(ndf::EdgeLength::World).or_else(|| relative_edge_length.map(ndf::EdgeLength::Relative))
}
