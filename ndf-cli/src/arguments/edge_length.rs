//! The edge length of meshes of models.

use clap::Args;

use super::numbers::length;

/// The edge length wanted of the mesh that is made of a model.
#[derive(Args, Clone, Copy, Debug)]
#[group(multiple = false)]
pub struct EdgeLength {
    /// About how long the edges of the mesh that is made of a model are, in the input's units [default: a quarter of the mean
    /// edge length of its base mesh].
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length)]
    edge_length: Option<f64>,
    /// The same in the box [-1.5, 1.5]³ that the base mesh fills.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length)]
    relative_edge_length: Option<f64>,
}

impl EdgeLength {
    /// The same for the library, where one is given.
    pub fn get(self) -> Option<ndf::EdgeLength> {
        let relative = || self.relative_edge_length.map(ndf::EdgeLength::Relative);
        self.edge_length.map(ndf::EdgeLength::World).or_else(relative)
    }

    /// A length in words, and whether it is the default.
    pub fn in_words(self, length: f64) -> String {
        let whose = if self.get().is_some() { "" } else { ", a quarter of the mean edge of the base mesh" };
        format!("about {}{whose}", ndf::text::readable(length))
    }
}
