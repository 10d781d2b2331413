//! A mesh file that is read and one that is written.

use std::path::PathBuf;

use clap::Args;
use ndf_mesh::io::format_to_write;

use super::PartArguments;
use crate::output::{Failure, check_output};
use crate::streams::{input_file, output_file};

/// What commands have in common that make a mesh of a mesh.
#[derive(Args, Clone, Debug)]
pub struct MeshToMesh {
    /// A mesh. What is no manifold is repaired first, as `ndf repair` does.
    #[arg(value_parser = input_file())]
    pub input: PathBuf,
    /// The mesh to write, with the scalars of the input where the format has some (.ply, .glb); the extension sets the format
    /// (.ply, .glb, .obj, .stl).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    pub output: PathBuf,
    /// What of the mesh is used.
    #[command(flatten)]
    pub parts: PartArguments,
}

impl MeshToMesh {
    /// Whether the output can be expected to appear.
    ///
    /// # Errors
    /// If its format is unknown, its folder is not there, or it is the input.
    pub fn check(&self) -> Result<(), Failure> {
        format_to_write(&self.output)?;
        check_output(&self.output, &[&self.input])
    }
}
