//! Point clouds and their files: PLY, XYZ and its kin, PTS, PTX, PCD, E57, LAS and LAZ.
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
use ndf_mesh::io::{self, FileDefect, MeshFormat, Signature, VertexScalars};

pub use cleaning::{CleaningReport, PointCloud, RawCloud, TooFewPoints};
#[cfg(feature = "las")]
pub use las::silence_damaged_laz;
pub use text::UnknownColumns;

/// The formats of point clouds known here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CloudFormat {
    /// Lines of numbers: XYZ, PWN, CSV, COLMAP's `points3D.txt`.
    Text,
    /// PTS: a count, then lines of a place, an intensity and perhaps a colour.
    Pts,
    /// PTX, Leica's format of scans on grids.
    Ptx,
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
            Self::Pts => f.write_str("PTS"),
            Self::Ptx => f.write_str("PTX"),
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
    #[error("{} is not a point cloud: {reason}; PLY, XYZ, PWN, PTS, PTX, PCD, E57, LAS and LAZ can be read", path.display())]
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

/// How a file of points is to be read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CloudOptions {
    /// What the columns of a text file are, in order: `x`, `y`, `z`, and perhaps `nx`, `ny`, `nz`; a column of any
    /// other name is passed over. Told from the file if `None`.
    pub columns: Option<Vec<String>>,
    /// Whether to keep points that a LAS file marks as withheld or as noise.
    pub keep_flagged: bool,
}

/// What a format's reader makes of the bytes; the error says the defect.
type Parsed = Result<RawCloud, FileDefect>;

/// Reads a file of points of any known format.
///
/// # Errors
/// If the file cannot be read, is of no known format, is malformed, or holds fewer than 4 usable points; the message
/// names file and defect.
pub fn read_cloud(path: impl AsRef<Path>, options: &CloudOptions) -> Result<CloudFile, ReadError> {
    let path = path.as_ref();
    let bytes = std::fs::read(path).map_err(|source| ReadError::Io { path: path.to_owned(), source })?;
    parse_cloud(&bytes, path, options)
}

/// Reads a cloud from the bytes of a file, whose path is used in messages, and its extension where columns without names
/// could be normals or colours.
///
/// # Errors
/// As [`read_cloud`].
pub fn parse_cloud(bytes: &[u8], path: &Path, options: &CloudOptions) -> Result<CloudFile, ReadError> {
    let owned = || path.to_owned();
    // Whoever names the columns knows that it is a text.
    let is_text = options.columns.is_some() && Signature::of(bytes).is_none() && !bytes.contains(&0);
    let format = sniff(bytes).or_else(|| is_text.then_some(CloudFormat::Text)).ok_or_else(|| {
        let empty = bytes.iter().all(u8::is_ascii_whitespace);
        match Signature::of(bytes) {
            Some(Signature::Foreign(what)) => ReadError::Foreign { path: owned(), what },
            Some(other) => ReadError::Unrecognised { path: owned(), reason: other.clause() },
            None if empty => ReadError::Unrecognised { path: owned(), reason: "it is empty" },
            None => ReadError::Unrecognised { path: owned(), reason: "its content is of no known format" },
        }
    })?;
    let parsed = match format {
        CloudFormat::Text | CloudFormat::Pts | CloudFormat::Ptx => {
            text::read(bytes, path, options.columns.as_deref())
        }
        CloudFormat::Pcd => pcd::read(bytes),
        #[cfg(feature = "e57")]
        CloudFormat::E57 => e57::read(bytes),
        #[cfg(not(feature = "e57"))]
        CloudFormat::E57 => return Err(ReadError::NotBuilt { path: owned(), format, feature: "e57" }),
        #[cfg(feature = "las")]
        CloudFormat::Las => las::read(bytes, options.keep_flagged),
        #[cfg(not(feature = "las"))]
        CloudFormat::Las => return Err(ReadError::NotBuilt { path: owned(), format, feature: "las" }),
        CloudFormat::Vertices(_) => Ok(vertices(io::parse_mesh(bytes, path)?)),
    };
    let raw = parsed.map_err(|defect| ReadError::Malformed { path: owned(), format, defect })?;
    let (cloud, report) =
        PointCloud::cleaned(raw).map_err(|source| ReadError::TooFewPoints { path: owned(), source })?;
    Ok(CloudFile { cloud, report, format })
}

/// The format of a file of points, told from its content; `None` if it is none of them. Asks in the order of
/// [`sniff`](crate::sniff): magic numbers, structure, text, size. A mesh file is one whatever else it holds, if its
/// vertices have places; splats and meshes are to be recognised before.
pub fn sniff(bytes: &[u8]) -> Option<CloudFormat> {
    match Signature::of(bytes) {
        Some(Signature::E57) => Some(CloudFormat::E57),
        Some(Signature::Las) => Some(CloudFormat::Las),
        Some(Signature::Ply) => Some(CloudFormat::Vertices(MeshFormat::Ply)),
        Some(_) => None,
        None if pcd::recognises(bytes) => Some(CloudFormat::Pcd),
        None => io::sniff(bytes).map(CloudFormat::Vertices).or_else(|| text::recognises(bytes)),
    }
}

/// The vertices of a mesh file, with their normals where the reader keeps them.
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
    RawCloud { positions, normals, ..RawCloud::default() }
}
