//! The triangulation that geodesics and spectra are computed on: a mesh file, or the mesh of a model.

use std::path::PathBuf;

use clap::Args;
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_mesh::{NotManifold, repair};

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

/// A triangulation, or what is left of a file that cannot be mended to be one.
pub enum Triangles {
    /// An oriented manifold.
    Manifold(ManifoldMesh),
    /// Triangles of any kind, all of them usable, and why they are no manifold.
    Other(TriangleMesh, NotManifold),
}

impl TriangulationArguments {
    /// The triangulation, with the vertex order of the file where that is a manifold; otherwise mended.
    ///
    /// # Errors
    /// If the input cannot be read, cannot be mended, or is a model without an edge length.
    pub fn read(&self, context: &Context) -> Result<ManifoldMesh, Failure> {
        match self.read_triangles(context)? {
            Triangles::Manifold(mesh) => Ok(mesh),
            Triangles::Other(_, defects) => {
                let failure = Failure::new(format!("{}: {defects}", self.input.display()));
                Err(failure.try_instead("`ndf info` lists what is wrong with it"))
            }
        }
    }

    /// The triangulation as [`read`](Self::read) has it; where the file cannot be mended, its triangles, with vertices
    /// in one place merged.
    ///
    /// # Errors
    /// If the input cannot be read, or is a model without an edge length.
    pub fn read_triangles(&self, context: &Context) -> Result<Triangles, Failure> {
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
            return Ok(Triangles::Manifold(mesh));
        }
        let file = read_faces(&self.input, context)?;
        if self.edge_length.is_some() || self.relative_edge_length.is_some() {
            context.warn(&format!("{name} is a mesh, used as it is; the edge length is for models"));
        }
        if let Ok(mesh) = ManifoldMesh::try_from(file.mesh.clone()) {
            return Ok(Triangles::Manifold(mesh));
        }
        match repair::mended(&file.mesh) {
            Ok(mended) => {
                mended.notes.iter().for_each(|note| context.warn(&format!("{name}: {note}")));
                Ok(Triangles::Manifold(mended.mesh))
            }
            Err(defects) => {
                let usable = repair::without_unusable_faces(&repair::welded(&file.mesh, 0.0));
                Ok(Triangles::Other(repair::without_unreferenced_vertices(&usable).0, defects))
            }
        }
    }
}
