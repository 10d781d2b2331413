//! Meshes to files.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::gltf::{self, GlbOptions, NotGlb};
use super::{MeshFormat, Rounding, VertexScalars, atomic_write, format_of_extension, obj, ply, stl};
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
    #[error("the name {} does not tell the format; end it in .ply, .glb, .obj or .stl", path.display())]
    UnknownExtension {
        /// The file.
        path: PathBuf,
    },
    /// The extension is not one of those in which lines can be written.
    #[error("the name {} does not tell a format of lines; end it in .ply, .glb or .obj", path.display())]
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
    /// Two scalars of one name.
    #[error("two scalars have the name {name}; give each a name of its own")]
    ScalarTwice {
        /// The name.
        name: String,
    },
    /// A mesh that binary glTF cannot hold.
    #[error("cannot write {}: {source}", path.display())]
    Glb {
        /// The file.
        path: PathBuf,
        /// Why.
        source: NotGlb,
    },
}

/// The format in which a mesh will be written to `path`: `.ply`, `.glb`, `.obj` or `.stl`, in either case.
///
/// # Errors
/// If the extension is none of these.
pub fn format_to_write(path: &Path) -> Result<MeshFormat, WriteError> {
    match format_of_extension(path) {
        Some(format) if !matches!(format, MeshFormat::Off | MeshFormat::Gltf) => Ok(format),
        _ => Err(WriteError::UnknownExtension { path: path.to_owned() }),
    }
}

/// Whether scalars can have this name in a PLY file: one word of ASCII other than x, y, z.
pub fn is_property_name(name: &str) -> bool {
    let is_word = !name.is_empty() && name.bytes().all(|b| b.is_ascii_graphic());
    is_word && !["x", "y", "z"].contains(&name)
}

/// Names that scalars can have in one PLY file, as like `names` as may be: what is not printable ASCII becomes an underscore,
/// and a name that is taken gets a number. For files that nobody reads under these names, such as those in pages.
pub fn property_names(names: &[&str]) -> Vec<String> {
    let mut taken: HashSet<String> = HashSet::new();
    let word = |name: &str| -> String {
        let word: String = name.chars().map(|c| if c.is_ascii_graphic() { c } else { '_' }).collect();
        if is_property_name(&word) { word } else { format!("{word}_") }
    };
    let free = |name: &&str| {
        let word = word(name);
        let numbered = (2..).map(|k| format!("{word}_{k}"));
        let free = std::iter::once(word.clone()).chain(numbered).find(|name| taken.insert(name.clone()));
        free.expect("numbers do not end")
    };
    names.iter().map(free).collect()
}

/// How positions are stored in formats that leave the choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Positions {
    /// In single precision, unless that would move a vertex by more than a millionth of the diagonal: far from the origin,
    /// as georeferenced coordinates are.
    #[default]
    Suited,
    /// In single precision only where that moves no vertex at all.
    Exact,
    /// In double precision.
    Double,
}

impl Positions {
    /// Whether points whose single precision rounds so much are stored in double.
    pub(super) fn is_double(self, rounding: Rounding) -> bool {
        match self {
            Self::Suited => rounding.is_coarse(),
            Self::Exact => rounding.moved > 0.0,
            Self::Double => true,
        }
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
/// vertices), `.glb` (binary glTF, see [`to_glb`](gltf::to_glb)), `.obj` (decimals that read back the same) or `.stl`
/// (binary). OBJ and STL have no place for scalars; they are left out. STL and glTF have single precision, glTF about the
/// middle of a mesh that is far from the origin. The file appears only when it is complete. Says how far vertices moved.
///
/// # Errors
/// If the extension is unknown, a scalar does not fit the mesh, the format cannot hold it, or the file cannot be written.
pub fn write_mesh_with(
    path: impl AsRef<Path>,
    mesh: &TriangleMesh,
    scalars: &[VertexScalars],
    positions: Positions,
) -> Result<Rounding, WriteError> {
    let path = path.as_ref();
    check_scalars(mesh, scalars)?;
    let format = format_to_write(path)?;
    let written = |written: std::io::Result<()>| {
        written.map_err(|source| WriteError::Io { path: path.to_owned(), source })
    };
    if format == MeshFormat::Glb {
        let layout = gltf::Layout::new(mesh, scalars, &GlbOptions::default())
            .map_err(|source| WriteError::Glb { path: path.to_owned(), source })?;
        written(atomic_write(path, |out| layout.write(out)))?;
        return Ok(layout.rounding());
    }
    let rounding = Rounding::to_single(mesh.positions());
    let is_double = positions.is_double(rounding);
    written(atomic_write(path, |out| match format {
        MeshFormat::Ply => ply::write(out, mesh, scalars, is_double),
        MeshFormat::Stl => stl::write(out, mesh),
        _ => obj::write(out, mesh),
    }))?;
    Ok(match format {
        MeshFormat::Ply if !is_double => rounding,
        MeshFormat::Stl => rounding,
        _ => Rounding::default(),
    })
}

/// The bytes of a PLY file as [`write_mesh_with`] writes it. O(n).
///
/// # Errors
/// If a scalar does not fit the mesh.
pub fn to_ply(
    mesh: &TriangleMesh,
    scalars: &[VertexScalars],
    positions: Positions,
) -> Result<Vec<u8>, WriteError> {
    check_scalars(mesh, scalars)?;
    let is_double = positions.is_double(Rounding::to_single(mesh.positions()));
    let mut bytes = Vec::new();
    ply::write(&mut bytes, mesh, scalars, is_double).expect("memory takes all that is written");
    Ok(bytes)
}

/// Whether scalars belong to a mesh, and a file can name them and tell them apart.
fn check_scalars(mesh: &TriangleMesh, scalars: &[VertexScalars]) -> Result<(), WriteError> {
    let mut names = HashSet::new();
    for VertexScalars { name, values } in scalars {
        if !names.insert(name) {
            return Err(WriteError::ScalarTwice { name: name.clone() });
        }
        if values.len() != mesh.vertex_count() {
            let (values, vertices) = (values.len(), mesh.vertex_count());
            return Err(WriteError::ScalarLength { name: name.clone(), values, vertices });
        }
        if !is_property_name(name) {
            return Err(WriteError::ScalarName { name: name.clone() });
        }
    }
    Ok(())
}
