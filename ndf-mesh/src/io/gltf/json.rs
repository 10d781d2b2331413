//! The parts of a document that say where its meshes are. What is not named here is passed over.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::{Map, Value};

/// A document. Places in its lists are the numbers by which its parts name each other.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Root {
    pub(super) asset: Asset,
    pub(super) scene: Option<u32>,
    pub(super) scenes: Vec<Scene>,
    pub(super) nodes: Vec<Node>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<BufferView>,
    pub(super) buffers: Vec<Buffer>,
    pub(super) extensions_required: Vec<String>,
}

/// The version by itself: documents of version 1 are of another shape.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Versioned {
    pub(super) asset: Asset,
}

#[derive(Debug, Deserialize)]
#[serde(default)]
pub(super) struct Asset {
    pub(super) version: String,
}

impl Default for Asset {
    fn default() -> Self {
        Self { version: "2.0".to_owned() }
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Scene {
    pub(super) nodes: Vec<u32>,
}

/// Boxes keep nodes small, of which a file may have one in three bytes.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub(super) mesh: Option<u32>,
    pub(super) skin: Option<u32>,
    pub(super) children: Vec<u32>,
    pub(super) matrix: Option<Box<[f64; 16]>>,
    pub(super) translation: Option<Box<[f64; 3]>>,
    pub(super) rotation: Option<Box<[f64; 4]>>,
    pub(super) scale: Option<Box<[f64; 3]>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Mesh {
    pub(super) primitives: Vec<Primitive>,
    pub(super) extensions: MeshExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct MeshExtensions {
    #[serde(rename = "EXT_mesh_manifold")]
    pub(super) manifold: Option<Box<Manifold>>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Manifold {
    pub(super) manifold_primitive: Primitive,
}

/// A part of a mesh with one material.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Primitive {
    /// Names of attributes, and the accessors of their values.
    pub attributes: BTreeMap<String, u32>,
    /// What other specifications say of it.
    pub extensions: Map<String, Value>,
    pub(super) indices: Option<u32>,
    pub(super) mode: Mode,
    pub(super) targets: Vec<IgnoredAny>,
    pub(super) extras: Value,
}

/// What corners of a primitive make; triangles if nothing is said.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(transparent)]
pub(super) struct Mode(pub(super) u32);

impl Mode {
    pub(super) const POINTS: Self = Self(0);
    pub(super) const LINES: Self = Self(1);
    pub(super) const LINE_LOOP: Self = Self(2);
    pub(super) const LINE_STRIP: Self = Self(3);
    pub(super) const TRIANGLES: Self = Self(4);
    pub(super) const TRIANGLE_STRIP: Self = Self(5);
    pub(super) const TRIANGLE_FAN: Self = Self(6);
}

impl Default for Mode {
    fn default() -> Self {
        Self::TRIANGLES
    }
}

impl Primitive {
    /// Whether it is made of triangles.
    pub(super) fn has_triangles(&self) -> bool {
        [Mode::TRIANGLES, Mode::TRIANGLE_STRIP, Mode::TRIANGLE_FAN].contains(&self.mode)
    }
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<u32>,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) shape: Option<Box<str>>,
    pub(super) sparse: Option<Box<Sparse>>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Sparse {
    pub(super) count: usize,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub(super) buffer_view: u32,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub(super) buffer_view: u32,
    #[serde(default)]
    pub(super) byte_offset: usize,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct BufferView {
    pub(super) buffer: u32,
    pub(super) byte_offset: usize,
    pub(super) byte_length: Option<usize>,
    pub(super) byte_stride: Option<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    pub(super) byte_length: usize,
}
