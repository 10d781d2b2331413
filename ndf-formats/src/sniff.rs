//! What a file is: one answer for all readers.
//!
//! They are asked in a fixed order, from what says most to what says least: magic numbers; structure, such as the header of
//! safetensors or PCD; the words of text formats; and last, for binary STL and records of splats, which have none of
//! these, sizes and what the numbers look like.

use ndf_mesh::io::{self, MeshFormat, Signature, ply_elements};

use crate::point_cloud::{self, CloudFormat};
use crate::splats::{self, SplatFormat};
use crate::tensors::{self, Container};

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// A mesh, with faces.
    Mesh(MeshFormat),
    /// Points.
    Cloud(CloudFormat),
    /// Gaussian splats.
    Splats(SplatFormat),
    /// Named arrays of numbers.
    Tensors(Container),
    /// A format that is not read, or what stands in the place of a file, in words that complete "the file is …".
    Foreign(&'static str),
}

/// What a file is, told from its content; `None` if it is of no known format.
pub fn sniff(bytes: &[u8]) -> Option<Format> {
    match Signature::of(bytes) {
        Some(Signature::Foreign(what)) => return Some(Format::Foreign(what)),
        Some(Signature::Ply) => return Some(ply(bytes)),
        _ => {}
    }
    if let Some(container) = tensors::container_of(bytes) {
        return Some(Format::Tensors(container));
    }
    match Signature::of(bytes) {
        Some(Signature::Zip) => return Some(Format::Foreign(tensors::other_archive(bytes))),
        Some(Signature::Gzip) => {
            let splats = splats::splat_format(bytes).map(Format::Splats);
            return Some(splats.unwrap_or(Format::Foreign("packed by gzip; unpack it first")));
        }
        Some(Signature::Glb) => {
            return Some(Format::Foreign("binary glTF, which is not read; export it as OBJ, PLY or STL"));
        }
        _ => {}
    }
    match point_cloud::sniff(bytes) {
        Some(CloudFormat::Vertices(format)) if io::has_faces(bytes, format) => Some(Format::Mesh(format)),
        Some(format) => Some(Format::Cloud(format)),
        None => splats::splat_format(bytes).map(Format::Splats),
    }
}

/// A PLY file is a mesh if it announces faces, else splats if its vertices have what splats have, else points.
fn ply(bytes: &[u8]) -> Format {
    let is_mesh = ply_elements(bytes).is_none() || io::has_faces(bytes, MeshFormat::Ply);
    match splats::splat_format(bytes) {
        _ if is_mesh => Format::Mesh(MeshFormat::Ply),
        Some(format) => Format::Splats(format),
        None => Format::Cloud(CloudFormat::Vertices(MeshFormat::Ply)),
    }
}
