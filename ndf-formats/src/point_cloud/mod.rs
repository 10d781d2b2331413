//! Point clouds and their files: PLY, XYZ and its kin, PCD, E57, LAS and LAZ.
//!
//! [`read_cloud`] reads the files scanners and their programs write; a [`PointCloud`] is what is left once everything
//! unusable is out.

mod cleaning;
#[cfg(feature = "e57")]
mod e57;
#[cfg(feature = "las")]
mod las;
mod lzf;
mod pcd;
#[cfg(any(all(test, feature = "full"), feature = "samples"))]
pub mod samples;
#[cfg(test)]
mod tests;
mod text;

use std::fmt;
use std::path::{Path, PathBuf};

use ndf_core::DVec3;
use ndf_mesh::io::{self, FileDefect, MeshFormat, VertexScalars};

pub use cleaning::{CleaningReport, PointCloud, RawCloud, TooFewPoints};
#[cfg(feature = "las")]
pub use las::silence_damaged_laz;

/// The formats of point clouds known here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CloudFormat {
    /// Lines of numbers: XYZ, PWN, PTS, CSV.
    Text,
    /// PCD, the format of the Point Cloud Library (text, binary or compressed).
    Pcd,
    /// E57, ASTM E2807.
    E57,
    /// LAS of the ASPRS, and LAZ, the same compressed.
    Las,
    /// The vertices of a mesh file.
    Vertices(MeshFormat),
}

impl fmt::Display for CloudFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text => f.write_str("XYZ"),
            Self::Pcd => f.write_str("PCD"),
            Self::E57 => f.write_str("E57"),
            Self::Las => f.write_str("LAS"),
            Self::Vertices(format) => format.fmt(f),
        }
    }
}

/// What a file of points held.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudFile {
    /// The usable points.
    pub cloud: PointCloud,
    /// What was left out of it, or changed.
    pub report: CleaningReport,
    /// The format of the file.
    pub format: CloudFormat,
}

/// Why a file gave no cloud.
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
    #[error("{} is not a point cloud: {reason}; PLY, XYZ, PWN, PTS, PCD, E57, LAS and LAZ can be read", path.display())]
    Unrecognised {
        /// The file.
        path: PathBuf,
        /// What was seen instead.
        reason: &'static str,
    },
    /// The file breaks the rules of its format.
    #[error("{} is not a valid {format} file: {defect}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The format it was recognised as.
        format: CloudFormat,
        /// What is wrong and where.
        defect: FileDefect,
    },
    /// The format is known, but its reader was left out of this build.
    #[error("{} is an {format} file, which this build does not read; build with the feature {feature} of ndf-formats", path.display())]
    NotBuilt {
        /// The file.
        path: PathBuf,
        /// The format it was recognised as.
        format: CloudFormat,
        /// The feature that reads it.
        feature: &'static str,
    },
    /// The vertices of a mesh file could not be read.
    #[error(transparent)]
    Mesh(#[from] io::ReadError),
    /// Too little is left.
    #[error("{}: {source}", path.display())]
    TooFewPoints {
        /// The file.
        path: PathBuf,
        /// The counts.
        source: TooFewPoints,
    },
}

/// What a format's reader makes of the bytes; the error says the defect.
type Parsed = Result<RawCloud, FileDefect>;

/// Reads a file of points of any known format.
///
/// # Errors
/// If the file cannot be read, is of no known format, is malformed, or holds fewer than 4 usable points; the message
/// names file and defect.
pub fn read_cloud(path: impl AsRef<Path>) -> Result<CloudFile, ReadError> {
    let path = path.as_ref();
    let bytes = std::fs::read(path).map_err(|source| ReadError::Io { path: path.to_owned(), source })?;
    parse_cloud(&bytes, path)
}

/// Reads a cloud from the bytes of a file, whose path is used in messages.
///
/// # Errors
/// As [`read_cloud`].
pub fn parse_cloud(bytes: &[u8], path: &Path) -> Result<CloudFile, ReadError> {
    let owned = || path.to_owned();
    let format = sniff(bytes).ok_or_else(|| {
        let empty = bytes.iter().all(u8::is_ascii_whitespace);
        let reason = if empty { "it is empty" } else { "its content is of no known format" };
        ReadError::Unrecognised { path: owned(), reason }
    })?;
    let parsed = match format {
        CloudFormat::Text => text::read(bytes),
        CloudFormat::Pcd => pcd::read(bytes),
        #[cfg(feature = "e57")]
        CloudFormat::E57 => e57::read(bytes),
        #[cfg(not(feature = "e57"))]
        CloudFormat::E57 => return Err(ReadError::NotBuilt { path: owned(), format, feature: "e57" }),
        #[cfg(feature = "las")]
        CloudFormat::Las => las::read(bytes),
        #[cfg(not(feature = "las"))]
        CloudFormat::Las => return Err(ReadError::NotBuilt { path: owned(), format, feature: "las" }),
        CloudFormat::Vertices(_) => Ok(vertices(io::parse_mesh(bytes, path)?)),
    };
    let raw = parsed.map_err(|defect| ReadError::Malformed { path: owned(), format, defect })?;
    let (cloud, report) =
        PointCloud::cleaned(raw).map_err(|source| ReadError::TooFewPoints { path: owned(), source })?;
    Ok(CloudFile { cloud, report, format })
}

/// The format of a file of points, told from its content; `None` if it is none of them. A PLY file is one whatever
/// else it holds, if its vertices have places; splats and meshes are to be recognised before.
pub fn sniff(bytes: &[u8]) -> Option<CloudFormat> {
    if bytes.starts_with(b"ASTM-E57") {
        Some(CloudFormat::E57)
    } else if bytes.starts_with(b"LASF") {
        Some(CloudFormat::Las)
    } else if pcd::recognises(bytes) {
        Some(CloudFormat::Pcd)
    } else if let Some(format) = io::sniff(bytes) {
        Some(CloudFormat::Vertices(format))
    } else if text::recognises(bytes) {
        Some(CloudFormat::Text)
    } else {
        None
    }
}

/// The vertices of a mesh file, with the normals of PLY files.
fn vertices(file: io::MeshFile) -> RawCloud {
    let column = |names: &[&str]| {
        let named = |s: &&VertexScalars| names.iter().any(|name| s.name.eq_ignore_ascii_case(name));
        file.scalars.iter().find(named)
    };
    let columns = (column(&["nx", "normal_x"]), column(&["ny", "normal_y"]), column(&["nz", "normal_z"]));
    let normals = match columns {
        (Some(x), Some(y), Some(z)) => {
            let normal = |i: usize| DVec3::new(x.values[i].into(), y.values[i].into(), z.values[i].into());
            Some((0..x.values.len()).map(normal).collect())
        }
        _ => None,
    };
    let (positions, _) = file.mesh.into_parts();
    RawCloud { positions, normals }
}
