//! The triangulation that geodesics and spectra are computed on: a mesh file, or the mesh of a model.

use std::path::PathBuf;

use clap::Args;

use ndf::{Parts, RepairOptions};

use super::{EdgeLength, PartArguments, Reading};
use crate::streams::input_file;

/// Where the triangulation comes from.
#[derive(Args, Clone, Debug)]
pub struct TriangulationArguments {
    /// A mesh or a model. Of anything else that `ndf fit` takes a model is fitted first, with its defaults.
    #[arg(value_parser = input_file())]
    pub input: PathBuf,
    /// How fine the mesh of a model is.
    #[command(flatten)]
    pub edge_length: EdgeLength,
    /// Measure lengths on the mesh of a model as they are, without the metric of the true surface that the model
    /// carries.
    #[arg(long)]
    pub no_metric: bool,
    /// What of a mesh is used.
    #[command(flatten)]
    pub parts: PartArguments,
    /// How the input is to be understood.
    #[command(flatten)]
    pub reading: Reading,
}

impl TriangulationArguments {
    /// What of a mesh is used: all of it unless less is asked for.
    pub fn repair(&self) -> RepairOptions {
        self.parts.options(Parts::All)
    }
}
