//! Mesh files: Wavefront OBJ, PLY, STL, OFF and glTF read; all but OFF written, glTF in its binary container.
//!
//! What a file is, is decided by its content, in this order: magic numbers ([`Signature`]), the words of text formats, and
//! last, for binary STL, which has neither, its size. Readers take every file apart without trusting it: counts
//! reserve no memory before the data is there, and every malformed file ends in a [`ReadError`] of one sentence.

mod atomic;
mod defect;
pub mod gltf;
mod lines;
mod note;
mod obj;
mod off;
mod ply;
mod polygons;
mod rounding;
mod signature;
mod stl;
mod text;
mod write;

use std::fmt;
use std::path::{Path, PathBuf};

use crate::TriangleMesh;

pub use atomic::{atomic_write, check_folder, remove_temporary_files, remove_unfinished};
pub use defect::FileDefect;
pub use lines::{Lines, format_of_lines, read_lines, write_lines};
pub use note::ReadNote;
pub use ply::{PlyElement, ply_elements};
pub use rounding::Rounding;
pub use signature::Signature;
pub use text::beginning_to_sniff;
pub use write::{
    Positions, WriteError, format_to_write, is_property_name, property_names, to_ply, write_mesh,
    write_mesh_with,
};

/// The mesh file formats known here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Wavefront OBJ (text).
    Obj,
    /// PLY, the Stanford polygon format (text or binary of either byte order).
    Ply,
    /// STL, stereolithography (text or binary).
    Stl,
    /// OFF, the Geomview object file format (text).
    Off,
    /// glTF 2.0 in one binary file.
    Glb,
    /// glTF 2.0 in JSON.
    Gltf,
}

impl fmt::Display for MeshFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
            Self::Off => "OFF",
            Self::Glb => "GLB",
            Self::Gltf => "glTF",
        })
    }
}

/// A named value for every vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexScalars {
    /// Name of the property.
    pub name: String,
    /// One value a vertex, in the order of the vertices.
    pub values: Vec<f32>,
}

impl VertexScalars {
    /// A tuple for every vertex as a property for each of its numbers.
    pub fn of_tuples<const N: usize>(names: [&str; N], tuples: &[[f64; N]]) -> Vec<Self> {
        let column = |(k, name): (usize, &str)| Self {
            name: name.to_owned(),
            values: tuples.iter().map(|tuple| tuple[k] as f32).collect(),
        };
        names.into_iter().enumerate().map(column).collect()
    }

    /// Normals as three properties, `nx`, `ny` and `nz`.
    fn of_normals(normals: &[[f64; 3]]) -> Vec<Self> {
        Self::of_tuples(["nx", "ny", "nz"], normals)
    }
}

/// What a mesh file held.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// Vertices in the order of the file (STL and glTF: of first occurrence) and faces, polygons cut into fans of
    /// triangles. A point set has no faces.
    pub mesh: TriangleMesh,
    /// The vertex properties of a PLY file other than `x`, `y`, `z`, in the order of the file; the normals `nx`, `ny`,
    /// `nz` of an OBJ or OFF file without faces, if there is one for each vertex; the attributes of glTF that begin with an
    /// underscore and are single numbers, NaN where a part of the scene does not have them.
    pub scalars: Vec<VertexScalars>,
    /// The format of the file.
    pub format: MeshFormat,
    /// What the reader changed or left out.
    pub notes: Vec<ReadNote>,
}

/// Why a mesh file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The content is none of the known formats.
    #[error("{} is not a mesh file: {reason}; OBJ, PLY, STL, OFF and glTF can be read", path.display())]
    Unrecognised {
        /// The file.
        path: PathBuf,
        /// What was seen instead.
        reason: &'static str,
    },
    /// The content is of a format that nothing here reads, or something else stands in the place of the file.
    #[error("{} is {what}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it is.
        what: &'static str,
    },
    /// The file breaks the rules of its format.
    #[error("{} is not a valid {format} file: {defect}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The format it was recognised as.
        format: MeshFormat,
        /// What is wrong and where.
        defect: FileDefect,
    },
}

/// What a format's reader makes of the bytes; the error says the defect.
type Parsed = Result<Content, FileDefect>;

/// A mesh before it knows which file it came from.
struct Content {
    mesh: TriangleMesh,
    scalars: Vec<VertexScalars>,
    notes: Vec<ReadNote>,
}

/// Reads a mesh file of any known format. O(n); memory stays within a small multiple of the file's size.
///
/// # Errors
/// If the file cannot be read, is of no known format, or is malformed; the message names file and defect.
pub fn read_mesh(path: impl AsRef<Path>) -> Result<MeshFile, ReadError> {
    let path = path.as_ref();
    let bytes = std::fs::read(path).map_err(|source| ReadError::Io { path: path.to_owned(), source })?;
    parse_mesh(&bytes, path)
}

/// Reads a mesh from the bytes of a file. `path` is used in messages, its extension to tell files apart whose content
/// leaves it open (a file of comments only), and its folder for the buffers of a `.gltf`.
///
/// # Errors
/// As [`read_mesh`].
pub fn parse_mesh(bytes: &[u8], path: &Path) -> Result<MeshFile, ReadError> {
    let unrecognised = |reason| ReadError::Unrecognised { path: path.to_owned(), reason };
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(unrecognised("it is empty"));
    }
    let format = match Signature::of(bytes) {
        Some(Signature::Ply) => MeshFormat::Ply,
        Some(Signature::Glb) => MeshFormat::Glb,
        Some(Signature::Gltf) => MeshFormat::Gltf,
        Some(Signature::Foreign(what)) => return Err(ReadError::Foreign { path: path.to_owned(), what }),
        Some(other) => return Err(unrecognised(other.clause())),
        None => {
            let by_name = || format_of_extension(path).filter(|_| !text::is_binary(bytes));
            sniff(bytes).or_else(by_name).ok_or_else(|| unrecognised("its content is of no known format"))?
        }
    };
    let bytes = text::without_mark(bytes);
    let parsed = match format {
        MeshFormat::Obj => obj::read(bytes),
        MeshFormat::Ply => ply::read(bytes),
        MeshFormat::Stl => stl::read(bytes),
        MeshFormat::Off => off::read(bytes),
        MeshFormat::Glb | MeshFormat::Gltf => gltf::read(bytes, path),
    };
    match parsed {
        Ok(Content { mesh, scalars, notes }) => Ok(MeshFile { mesh, scalars, format, notes }),
        Err(defect) => Err(ReadError::Malformed { path: path.to_owned(), format, defect }),
    }
}

/// The mesh format of a file, told from its content; `None` if it is none of them. Looks at the first kilobytes, and,
/// where they leave it open, at whole files: for OFF without its keyword at the number of lines, for binary STL at the
/// size and the triangles.
pub fn sniff(bytes: &[u8]) -> Option<MeshFormat> {
    match Signature::of(bytes) {
        Some(Signature::Ply) => return Some(MeshFormat::Ply),
        Some(Signature::Glb) if !gltf::names(bytes, gltf::SPLATS) => return Some(MeshFormat::Glb),
        Some(Signature::Gltf) => return Some(MeshFormat::Gltf),
        Some(_) => return None,
        None => {}
    }
    let bytes = text::without_mark(bytes);
    if off::recognises(bytes) {
        Some(MeshFormat::Off)
    } else if stl::recognises_text(bytes) {
        Some(MeshFormat::Stl)
    } else if obj::recognises(bytes) {
        Some(MeshFormat::Obj)
    } else if off::recognises_without_keyword(bytes) {
        Some(MeshFormat::Off)
    } else if stl::recognises_binary(bytes) {
        Some(MeshFormat::Stl)
    } else {
        None
    }
}

/// Whether a mesh file announces faces: those of PLY and OFF in the header, those of OBJ as lines. Files of STL and glTF count
/// always, since they are read for nothing else.
pub fn has_faces(bytes: &[u8], format: MeshFormat) -> bool {
    let bytes = text::without_mark(bytes);
    match format {
        MeshFormat::Ply => ply_elements(bytes).is_some_and(|elements| {
            elements.iter().any(|e| e.count > 0 && matches!(e.name.as_str(), "face" | "tristrips"))
        }),
        MeshFormat::Off => off::announces_faces(bytes),
        MeshFormat::Obj => obj::has_faces(bytes),
        MeshFormat::Stl | MeshFormat::Glb | MeshFormat::Gltf => true,
    }
}

/// The format an extension stands for, in either case.
fn format_of_extension(path: &Path) -> Option<MeshFormat> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "obj" => Some(MeshFormat::Obj),
        "ply" => Some(MeshFormat::Ply),
        "stl" => Some(MeshFormat::Stl),
        "off" => Some(MeshFormat::Off),
        "glb" => Some(MeshFormat::Glb),
        "gltf" => Some(MeshFormat::Gltf),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
