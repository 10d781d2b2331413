//! The triangulation that geodesics and spectra are computed on: a mesh file, or the mesh of a model.

use std::path::PathBuf;

use clap::Args;
use ndf::{NoTriangulation, Triangulated};

use super::edge_length;
use super::numbers::length;
use crate::context::Context;
use crate::files::{no_mesh, no_model};
use crate::output::Failure;

/// Where the triangulation comes from.
#[derive(Args, Clone, Debug)]
pub struct TriangulationArguments {
    /// A mesh, or a model together with an edge length.
    pub input: PathBuf,
    /// Length of the edges of a model's mesh, about, in the input's units.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length, conflicts_with = "relative_edge_length")]
    edge_length: Option<f64>,
    /// The same where the base mesh fills the box [-1.5, 1.5]³.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length)]
    relative_edge_length: Option<f64>,
}

impl TriangulationArguments {
    /// The triangulation, with the vertex order of the file where that is a manifold; otherwise mended, or, where that
    /// cannot be, its usable triangles.
    ///
    /// # Errors
    /// If the input cannot be read, or is a model without an edge length.
    pub fn read(&self, context: &Context) -> Result<Triangulated, Failure> {
        let edge_length = edge_length::of(self.edge_length, self.relative_edge_length);
        let found = Triangulated::open(&self.input, edge_length).map_err(|error| match error {
            NoTriangulation::Mesh(error) => no_mesh(&error),
            NoTriangulation::Model(error) => no_model(&error),
            NoTriangulation::NoEdgeLength { .. } => {
                Failure::new(error.to_string()).try_instead("say how fine with --edge-length")
            }
            error => error.into(),
        })?;
        found.notes.iter().for_each(|note| context.warn_of(&self.input.display(), note));
        Ok(found)
    }
}
