//! glTF 2.0 (Khronos 2017): a scene in JSON with its numbers in buffers, all in one file (`.glb`) or in several (`.gltf`).
//!
//! [`to_glb`] writes a mesh as a file that viewers of glTF show as it is: with normals, colours of a scalar, every scalar as an
//! attribute, and `EXT_mesh_manifold` where it is closed. Readers of meshes take the triangles of a scene, and those of splats
//! use the [`Document`] below them.
//!
//! The crate `gltf` is not used: it reads positions as single precision, where files with `KHR_mesh_quantization` have
//! integers, and asks neither whether the nodes are a tree nor whether sparse items are there.

mod buffers;
mod container;
mod document;
mod json;
mod layout;
mod lines;
mod names;
mod read;
mod scene;
#[cfg(test)]
mod tests;
mod write;

pub use document::Document;
pub use json::Primitive;
pub use scene::PlacedMesh;
pub use write::{GlbOptions, NotGlb, to_glb};

pub(super) use lines::{lines, write_lines};
pub(super) use read::read;
pub(super) use write::Layout;

use super::text;

/// The extension of splats: points that are no mesh.
pub const SPLATS: &str = "KHR_gaussian_splatting";

/// Whether a file, binary or JSON, names this word outside its buffers. O(n).
pub fn names(bytes: &[u8], word: &str) -> bool {
    let json = match container::chunks(bytes) {
        Ok((json, _)) => json,
        Err(_) => text::without_mark(bytes),
    };
    json.windows(word.len()).any(|window| window == word.as_bytes())
}
