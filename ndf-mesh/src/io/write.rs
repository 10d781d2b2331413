//! Meshes to files.

use std::path::{Path, PathBuf};

use ndf_core::{BoundingBox, DVec3};

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
    /// The extension is not one of those in which lines can be written.
    #[error("the name {} does not tell a format of lines; end it in .ply or .obj", path.display())]
    NoLines {
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

/// How positions are stored in formats that leave the choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Positions {
    /// In single precision, unless that would move a vertex by more than a millionth of the diagonal: far from the origin,
    /// as georeferenced coordinates are.
    #[default]
    Suited,
    /// In double precision.
    Double,
}

/// The share of the diagonal by which single precision may move a vertex.
const MAX_MOVE: f64 = 1e-6;

/// What rounding did to the positions of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rounding {
    /// The largest distance by which a vertex moved.
    pub moved: f64,
    /// The same as a share of the diagonal.
    pub share: f64,
}

impl Rounding {
    /// What single precision does to these positions.
    pub fn to_single(positions: &[DVec3]) -> Self {
        let moved = |p: &DVec3| p.distance(p.as_vec3().as_dvec3());
        let moved = positions.iter().map(moved).fold(0.0, f64::max);
        let diagonal = BoundingBox::of_points(positions).diagonal();
        Self { moved, share: if moved > 0.0 { moved / diagonal } else { 0.0 } }
    }

    /// Whether vertices moved by more than a millionth of the diagonal.
    pub fn is_coarse(&self) -> bool {
        self.share > MAX_MOVE
    }
}

/// Writes a mesh in the format its extension names, with positions as suits them: see [`write_mesh_with`].
///
/// # Errors
/// As [`write_mesh_with`].
pub fn write_mesh(
    path: impl AsRef<Path>,
    mesh: &TriangleMesh,
    scalars: &[VertexScalars],
) -> Result<Rounding, WriteError> {
    write_mesh_with(path, mesh, scalars, Positions::Suited)
}

/// Writes a mesh in the format its extension names: `.ply` (binary little-endian, the scalars as float properties of the
/// vertices), `.obj` (decimals that read back the same) or `.stl` (binary, always in single precision). OBJ and STL have no
/// place for scalars; they are left out. The file appears only when it is complete. Says how far vertices moved.
///
/// # Errors
/// If the extension is unknown, a scalar does not fit the mesh, or the file cannot be written.
pub fn write_mesh_with(
    path: impl AsRef<Path>,
    mesh: &TriangleMesh,
    scalars: &[VertexScalars],
    positions: Positions,
) -> Result<Rounding, WriteError> {
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
    let rounding = Rounding::to_single(mesh.positions());
    let is_double = positions == Positions::Double || rounding.is_coarse();
    let written = atomic_write(path, |out| match format {
        MeshFormat::Ply => ply::write(out, mesh, scalars, is_double),
        MeshFormat::Stl => stl::write(out, mesh),
        MeshFormat::Obj | MeshFormat::Off => obj::write(out, mesh),
    });
    written.map_err(|source| WriteError::Io { path: path.to_owned(), source })?;
    Ok(match format {
        MeshFormat::Ply if !is_double => rounding,
        MeshFormat::Stl => rounding,
        _ => Rounding::default(),
    })
}
