//! Files of splats. What a file is, is decided by its content.

mod antimatter;
mod compressed_ply;
mod inria_ply;
mod spz;

use std::fmt;

use super::Splat;

pub use inria_ply::write_splats;

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
}

impl fmt::Display for SplatFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::InriaPly => "PLY",
            Self::CompressedPly => "compressed PLY",
            Self::Spz => "SPZ",
            Self::Antimatter => "splat",
        })
    }
}

/// Why splats could not be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SplatError {
    /// The content is none of the formats.
    #[error(
        "the file is not a splat file (PLY with opacity, scale and rot, compressed PLY, SPZ or 32-byte records)"
    )]
    Unknown,
    /// The file ends early or contradicts itself.
    #[error("the file is damaged: {0}")]
    Damaged(String),
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

fn damaged(what: impl Into<String>) -> SplatError {
    SplatError::Damaged(what.into())
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
    if spz::recognises(bytes) {
        return Some(SplatFormat::Spz);
    }
    antimatter::recognises(bytes).then_some(SplatFormat::Antimatter)
}

/// Reads the splats of a file of any format. Coordinates are those of the authors' PLY: SPZ, which turns y and z, is
/// turned back. Splats that are not sound are kept, for [`SplatDensity`](super::SplatDensity) to leave out and count.
///
/// # Errors
/// See [`SplatError`].
pub fn parse_splats(bytes: &[u8]) -> Result<(SplatFormat, Vec<Splat>), SplatError> {
    let format = splat_format(bytes).ok_or(SplatError::Unknown)?;
    let splats = match format {
        SplatFormat::InriaPly => inria_ply::read(bytes),
        SplatFormat::CompressedPly => compressed_ply::read(bytes),
        SplatFormat::Spz => spz::read(bytes),
        SplatFormat::Antimatter => Ok(antimatter::read(bytes)),
    }?;
    if splats.is_empty() { Err(SplatError::Empty) } else { Ok((format, splats)) }
}

fn sigmoid(x: f32) -> f32 {
    (1.0 + (-x).exp()).recip()
}
