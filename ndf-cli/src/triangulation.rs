//! The triangulation that geodesics and spectra are computed on: a mesh file, or the mesh of a model.

use std::path::PathBuf;

use clap::Args;
use ndf_core::ManifoldMesh;
use ndf_core::mesh::repair;

use crate::commands::extract::{EdgeLength, extracted, length};
use crate::commands::read_faces;
use crate::context::Context;
use crate::input::{begins_as_model, read_model};
use crate::output::Failure;

/// Where the triangulation comes from.
#[derive(Args, Clone, Debug)]
pub struct TriangulationArguments {
    /// A mesh, or a model together with an edge length.
    pub input: PathBuf,
    /// Longest edge of a model's mesh, in the input's units.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length, conflicts_with = "relative_edge_length")]
    edge_length: Option<f64>,
    /// Longest edge of a model's mesh where the base mesh fills the box [-1.5, 1.5]³.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length)]
    relative_edge_length: Option<f64>,
}

impl TriangulationArguments {
    /// The triangulation, with the vertex order of the file where that is a manifold; otherwise mended.
    ///
    /// # Errors
    /// If the input cannot be read, cannot be mended, or is a model without an edge length.
    pub fn read(&self, context: &Context) -> Result<ManifoldMesh, Failure> {
        let name = self.input.display();
        if begins_as_model(&self.input) {
            let Some(edge_length) = EdgeLength::of(self.edge_length, self.relative_edge_length) else {
                let failure =
                    Failure::new(format!("{name} is a model, of which meshes of any size can be made"));
                return Err(failure.try_instead("say how fine with --edge-length"));
            };
            let model = read_model(&self.input)?;
            let (mesh, _) =
                extracted(&model, edge_length).map_err(|e| Failure::new(format!("{name}: {e}")))?;
            return Ok(mesh);
        }
        let file = read_faces(&self.input, context)?;
        if self.edge_length.is_some() || self.relative_edge_length.is_some() {
            context.warn(&format!("{name} is a mesh, used as it is; the edge length is for models"));
        }
        if let Ok(mesh) = ManifoldMesh::try_from(file.mesh.clone()) {
            return Ok(mesh);
        }
        let mended = repair::mended(&file.mesh).map_err(|e| {
            Failure::new(format!("{name}: {e}")).try_instead("`ndf info` lists what is wrong with it")
        })?;
        mended.notes.iter().for_each(|note| context.warn(&format!("{name}: {note}")));
        Ok(mended.mesh)
    }
}
