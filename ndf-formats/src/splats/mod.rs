//! 3D Gaussian splats (Kerbl, Kopanas, Leimkühler and Drettakis 2023) and their files: the authors' PLY, packed PLY, SPZ,
//! records of 32 bytes, `.ksplat`, SOG, binary glTF, and the checkpoints of training.

mod antimatter;
mod checkpoint;
mod compressed_ply;
mod glb;
mod inria_ply;
mod ksplat;
#[cfg(any(all(test, feature = "full"), feature = "samples"))]
pub mod samples;
#[cfg(feature = "sog")]
mod sog;
#[cfg(feature = "spz")]
mod spz;
#[cfg(test)]
mod tests;

use std::fmt;

use ndf_core::DVec3;
use ndf_mesh::io::{FileDefect, Signature};

pub use checkpoint::splats_of_tensors;
pub use inria_ply::write_splats;

use crate::tensors::{self, Container};

/// A Gaussian: opacity times exp(−½ ρ²), ρ the distance in units of its standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat {
    /// Its centre.
    pub center: [f64; 3],
    /// Standard deviations along its own axes.
    pub scales: [f32; 3],
    /// From its own axes to those of space: a quaternion w, x, y, z, of any length but zero.
    pub rotation: [f32; 4],
    /// Opacity at the centre, in `[0, 1]`.
    pub opacity: f32,
}

impl Splat {
    /// Whether everything is finite and the scales are not negative.
    pub fn is_sound(&self) -> bool {
        let mut numbers = self.scales.iter().chain(&self.rotation).chain([&self.opacity]);
        self.center.iter().all(|x| x.is_finite())
            && numbers.all(|x| x.is_finite())
            && self.scales.iter().all(|&s| s >= 0.0)
            && self.rotation.iter().any(|&q| q != 0.0)
    }

    /// Its axes in space, columns of a rotation.
    pub fn axes(&self) -> [DVec3; 3] {
        let [w, x, y, z] = self.rotation.map(f64::from);
        let rotation = ndf_core::glam::DQuat::from_xyzw(x, y, z, w).normalize();
        DVec3::AXES.map(|axis| rotation * axis)
    }
}

/// Formats of splats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplatFormat {
    /// The PLY of the authors, properties in any order.
    InriaPly,
    /// PlayCanvas' PLY of packed numbers.
    CompressedPly,
    /// Niantic's SPZ.
    Spz,
    /// Records of 32 bytes, as antimatter15's viewer has them; there is nothing else to know it by.
    Antimatter,
    /// The packed splats of the viewer GaussianSplats3D.
    Ksplat,
    /// PlayCanvas' SOG: images in an archive.
    Sog,
    /// Binary glTF with `KHR_gaussian_splatting`.
    Glb,
    /// A checkpoint of gsplat, nerfstudio or the authors' code.
    Checkpoint(Container),
}

impl fmt::Display for SplatFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::InriaPly => "PLY",
            Self::CompressedPly => "compressed PLY",
            Self::Spz => "SPZ",
            Self::Antimatter => "splat",
            Self::Ksplat => "ksplat",
            Self::Sog => "SOG",
            Self::Glb => "GLB",
            Self::Checkpoint(container) => return container.fmt(f),
        })
    }
}

/// Why splats could not be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SplatError {
    /// The content is none of the formats.
    #[error(
        "the file is not a splat file (PLY with opacity, scale and rot, compressed PLY, SPZ, SOG, GLB with KHR_gaussian_splatting, .ksplat or 32-byte records)"
    )]
    Unknown,
    /// The file ends early or contradicts itself.
    #[error("{}", told(.0))]
    Damaged(#[from] FileDefect),
    /// The format is known, but its reader was left out of this build.
    #[error("{format} is not read by this build; build with the feature {feature} of ndf-formats")]
    NotBuilt {
        /// The format.
        format: SplatFormat,
        /// The feature that reads it.
        feature: &'static str,
    },
    /// A property without which there are no splats.
    #[error("the vertices have no property {0}")]
    MissingProperty(&'static str),
    /// A version of a format that is not read.
    #[error("version {0} of SPZ is not supported; versions 1 to 4 are")]
    Version(u32),
    /// The file has no splat.
    #[error("the file has no splats")]
    Empty,
}

/// What is not read need not be damaged.
fn told(defect: &FileDefect) -> String {
    match defect {
        FileDefect::Unsupported(_) => defect.to_string(),
        _ => format!("the file is damaged: {defect}"),
    }
}

/// The format of a file, if it is one of splats.
pub fn splat_format(bytes: &[u8]) -> Option<SplatFormat> {
    if bytes.starts_with(b"ply") {
        let header = &bytes[..bytes.len().min(1 << 16)];
        let end = header.windows(10).position(|w| w == b"end_header").unwrap_or(header.len());
        let header = String::from_utf8_lossy(&header[..end]);
        let has = |word: &str| header.split_whitespace().any(|w| w == word);
        if has("packed_position") {
            return Some(SplatFormat::CompressedPly);
        }
        return (has("opacity") && has("scale_0") && has("rot_0")).then_some(SplatFormat::InriaPly);
    }
    match Signature::of(bytes) {
        Some(Signature::Zip) => return tensors::is_sog(bytes).then_some(SplatFormat::Sog),
        Some(Signature::Glb) => return glb::recognises(bytes).then_some(SplatFormat::Glb),
        _ if is_spz(bytes) => return Some(SplatFormat::Spz),
        None if ksplat::recognises(bytes) => return Some(SplatFormat::Ksplat),
        _ => {}
    }
    let is_unsigned = Signature::of(bytes).is_none();
    (is_unsigned && antimatter::recognises(bytes)).then_some(SplatFormat::Antimatter)
}

/// Reads the splats of a file of any format. Coordinates are those of the authors' PLY: SPZ, which turns y and z, is
/// turned back. Splats that are not sound are kept, for the reader of the list to leave out and count.
///
/// # Errors
/// See [`SplatError`].
pub fn parse_splats(bytes: &[u8]) -> Result<(SplatFormat, Vec<Splat>), SplatError> {
    let format = splat_format(bytes).ok_or(SplatError::Unknown)?;
    let splats = match format {
        SplatFormat::InriaPly => inria_ply::read(bytes),
        SplatFormat::CompressedPly => compressed_ply::read(bytes),
        #[cfg(feature = "spz")]
        SplatFormat::Spz => spz::read(bytes),
        #[cfg(not(feature = "spz"))]
        SplatFormat::Spz => Err(SplatError::NotBuilt { format, feature: "spz" }),
        SplatFormat::Antimatter => Ok(antimatter::read(bytes)),
        SplatFormat::Ksplat => ksplat::read(bytes),
        #[cfg(feature = "sog")]
        SplatFormat::Sog => sog::read(bytes),
        #[cfg(not(feature = "sog"))]
        SplatFormat::Sog => Err(SplatError::NotBuilt { format, feature: "sog" }),
        SplatFormat::Glb => glb::read(bytes),
        // Tensors are read before.
        SplatFormat::Checkpoint(_) => Err(SplatError::Unknown),
    }?;
    if splats.is_empty() { Err(SplatError::Empty) } else { Ok((format, splats)) }
}

fn sigmoid(x: f32) -> f32 {
    (1.0 + (-x).exp()).recip()
}

/// The first bytes of SPZ, bare or within gzip.
const SPZ_MAGIC: &[u8; 4] = b"NGSP";

/// Whether a file is SPZ. Without its reader, gzip is not looked into.
fn is_spz(bytes: &[u8]) -> bool {
    #[cfg(feature = "spz")]
    let within_gzip = spz::begins_within_gzip(bytes, SPZ_MAGIC);
    #[cfg(not(feature = "spz"))]
    let within_gzip = false;
    bytes.starts_with(SPZ_MAGIC) || within_gzip
}
