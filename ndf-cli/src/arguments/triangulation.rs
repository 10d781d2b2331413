//! The triangulation that geodesics and spectra are computed on: a mesh file, or the mesh of a model.

use std::path::PathBuf;

use clap::Args;

use ndf::{Parts, RepairOptions};

use super::numbers::length;
use super::{PartArguments, edge_length};

/// Where the triangulation comes from.
#[derive(Args, Clone, Debug)]
pub struct TriangulationArguments {
    /// A mesh, or a model together with an edge length.
    pub input: PathBuf,
    /// Target edge length of the mesh extracted from a model, in the input's units.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length, conflicts_with = "relative_edge_length")]
    edge_length: Option<f64>,
    /// The same in the box [-1.5, 1.5]³ that the base mesh fills.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length)]
    relative_edge_length: Option<f64>,
    /// Measure lengths on the mesh of a model as they are, without the metric of the true surface that the model
    /// carries.
    #[arg(long)]
    pub no_metric: bool,
    #[command(flatten)]
    parts: PartArguments,
}

impl TriangulationArguments {
    /// What of a mesh is used: all of it unless less is asked for.
    pub fn repair(&self) -> RepairOptions {
        self.parts.options(Parts::All)
    }

    /// The edge length, where one is given.
    pub fn edge_length(&self) -> Option<ndf::EdgeLength> {
        edge_length::of(self.edge_length, self.relative_edge_length)
    }
}
