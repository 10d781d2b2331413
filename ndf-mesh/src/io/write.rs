//! Meshes to files.

use std::path::{Path, PathBuf};

use super::{MeshFormat, VertexScalars, atomic_write, format_of_extension, obj, ply, stl};
use crate::TriangleMesh;

/// Why a mesh file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file cannot be created or written.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The extension is not one of those that can be written.
    #[error("the name {} does not tell the format; end it in .ply, .obj or .stl", path.display())]
    UnknownExtension {
        /// The file.
        path: PathBuf,
    },
    /// Scalars that do not belong to the mesh.
    #[error("the scalar {name} has {values} values for {vertices} vertices")]
    ScalarLength {
        /// Name of the scalar.
        name: String,
        /// How many values it has.
        values: usize,
        /// How many vertices the mesh has.
        vertices: usize,
    },
    /// A name that cannot stand in a PLY header.
    #[error("{name:?} cannot name a PLY property: it must be one word of ASCII other than x, y, z")]
    ScalarName {
        /// The name.
        name: String,
    },
}

/// The format in which a mesh will be written to `path`: `.ply`, `.obj` or `.stl`, in either case.
///
/// # Errors
/// If the extension is none of these.
pub fn format_to_write(path: &Path) -> Result<MeshFormat, WriteError> {
    match format_of_extension(path) {
        Some(format) if format != MeshFormat::Off => Ok(format),
        _ => Err(WriteError::UnknownExtension { path: path.to_owned() }),
    }
}

/// Whether scalars can have this name in a PLY file: one word of ASCII other than x, y, z.
pub fn is_property_name(name: &str) -> bool {
    let is_word = !name.is_empty() && name.bytes().all(|b| b.is_ascii_graphic());
    is_word && !["x", "y", "z"].contains(&name)
}

/// Writes a mesh in the format its extension names: `.ply` (binary little-endian, float positions, the
/// scalars as float properties of the vertices), `.obj` (decimals that read back the same) or `.stl` (binary,
/// float). OBJ and STL have no place for scalars; they are left out. The file appears only when it is
/// complete.
///
/// # Errors
/// If the extension is unknown, a scalar does not fit the mesh, or the file cannot be written.
pub fn write_mesh(
    path: impl AsRef<Path>,
    mesh: &TriangleMesh,
    scalars: &[VertexScalars],
) -> Result<(), WriteError> {
    let path = path.as_ref();
    for VertexScalars { name, values } in scalars {
        if values.len() != mesh.vertex_count() {
            let (values, vertices) = (values.len(), mesh.vertex_count());
            return Err(WriteError::ScalarLength { name: name.clone(), values, vertices });
        }
        if !is_property_name(name) {
            return Err(WriteError::ScalarName { name: name.clone() });
        }
    }
    let format = format_to_write(path)?;
    atomic_write(path, |out| match format {
        MeshFormat::Ply => ply::write(out, mesh, scalars),
        MeshFormat::Stl => stl::write(out, mesh),
        MeshFormat::Obj | MeshFormat::Off => obj::write(out, mesh),
    })
    .map_err(|source| WriteError::Io { path: path.to_owned(), source })
}
