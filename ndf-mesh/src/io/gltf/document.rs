//! A document with its buffers, and the numbers in them.

use std::path::Path;

use super::super::{FileDefect, Signature, text};
use super::buffers::Buffers;
use super::json::{Accessor, BufferView, Primitive, Root, Versioned};
use super::{SPLATS, container};

/// A file of glTF, taken apart: its scene and its numbers. Nothing in it is trusted; what contradicts itself is found where it
/// is asked for.
#[derive(Debug)]
pub struct Document<'a> {
    pub(super) root: Root,
    buffers: Buffers<'a>,
    pub(super) bytes: usize,
}

/// Extensions that say nothing of where triangles are, by their beginnings.
const OF_LOOKS: [&str; 9] = [
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_xmp",
    "EXT_texture_",
    "EXT_lights_",
    "MSFT_texture_",
    "MSFT_packing_",
    "EXT_structural_metadata",
];

/// Extensions of geometry that are read.
const READ: [&str; 4] = ["KHR_mesh_quantization", SPLATS, "EXT_mesh_manifold", "EXT_mesh_features"];

/// Extensions that pack numbers.
pub(super) const PACKINGS: [&str; 3] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

impl<'a> Document<'a> {
    /// Takes a file apart, binary or JSON. Buffers in files of their own are looked for in `folder`.
    ///
    /// # Errors
    /// If it is malformed, its buffers are not there, or it requires an extension that is not read.
    pub fn parse(bytes: &'a [u8], folder: &Path) -> Result<Self, FileDefect> {
        let (json, chunk) = split(bytes)?;
        let root = root(json)?;
        root.extensions_required.iter().try_for_each(|name| check_extension(name))?;
        let buffers = Buffers::of(&root, chunk, folder)?;
        let bytes = buffers.len() + json.len();
        Ok(Self { root, buffers, bytes })
    }

    /// The primitives of a mesh; none if there is no such mesh.
    pub fn primitives(&self, mesh: u32) -> &[Primitive] {
        self.root.meshes.get(mesh as usize).map_or(&[], |mesh| &mesh.primitives)
    }

    /// How many items an accessor has.
    ///
    /// # Errors
    /// If it does not exist.
    pub(super) fn count(&self, accessor: u32) -> Result<usize, FileDefect> {
        Ok(self.accessor(accessor)?.count)
    }

    /// The numbers of an accessor, `width` an item. Normalised integers are fractions of their largest. O(n); no more than
    /// the file has bytes for is reserved. `name` is for messages.
    ///
    /// # Errors
    /// If it has items of another width or kind, or reaches beyond its buffer.
    pub fn numbers(&self, accessor: u32, width: usize, name: &str) -> Result<Vec<f32>, FileDefect> {
        let accessor = self.accessor(accessor)?;
        let kind = Component::of(accessor.component_type, name)?;
        let is_normalised = accessor.normalized;
        self.items(accessor, kind, width, name, |bytes| {
            let number = kind.number(bytes);
            if is_normalised { kind.normalised(number) } else { number }
        })
    }

    /// The indices of an accessor. O(n).
    ///
    /// # Errors
    /// As [`numbers`](Self::numbers).
    pub(super) fn indices(&self, accessor: u32) -> Result<Vec<u32>, FileDefect> {
        let accessor = self.accessor(accessor)?;
        let kind = Component::of(accessor.component_type, "indices")?;
        if !kind.is_index() {
            return Err(FileDefect::value("its indices are not unsigned integers"));
        }
        self.items(accessor, kind, 1, "indices", |bytes| kind.index(bytes))
    }

    pub(super) fn accessor(&self, accessor: u32) -> Result<&Accessor, FileDefect> {
        let missing = || FileDefect::mismatch(format!("it names accessor {accessor}, which is not there"));
        self.root.accessors.get(accessor as usize).ok_or_else(missing)
    }

    fn items<T: Copy>(
        &self,
        accessor: &Accessor,
        kind: Component,
        width: usize,
        name: &str,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, FileDefect> {
        if let Some(shape) = &accessor.shape
            && width_of(shape) != Some(width)
        {
            return Err(FileDefect::mismatch(format!("{name} has items of the shape {shape}")));
        }
        let size = kind.size();
        let numbers = accessor.count.checked_mul(width).filter(|&n| n <= self.max_numbers());
        let numbers = numbers.ok_or_else(|| self.too_many(accessor.count, name))?;
        let mut items = match accessor.buffer_view {
            None => vec![read(&[0; 4]); numbers],
            Some(view) => {
                let items = self.rows(view, accessor.byte_offset, accessor.count, size * width, name)?;
                let mut found = Vec::with_capacity(numbers);
                found.extend(items.flat_map(|item| item.chunks_exact(size)).map(&read));
                found
            }
        };
        let Some(sparse) = &accessor.sparse else { return Ok(items) };
        if sparse.count > accessor.count {
            let (places, all) = (sparse.count, accessor.count);
            return Err(FileDefect::mismatch(format!("{name} replaces {places} of its {all} items")));
        }
        let index = Component::of(sparse.indices.component_type, "indices of sparse items")?;
        if !index.is_index() {
            return Err(FileDefect::value("indices of sparse items are not unsigned integers"));
        }
        let (at, values) = (&sparse.indices, &sparse.values);
        let places = self.rows(at.buffer_view, at.byte_offset, sparse.count, index.size(), name)?;
        let values = self.rows(values.buffer_view, values.byte_offset, sparse.count, size * width, name)?;
        for (place, value) in places.zip(values) {
            let from = index.index(place) as usize * width;
            let item = items.get_mut(from..from + width);
            let item =
                item.ok_or_else(|| FileDefect::mismatch(format!("a sparse item of {name} has no place")))?;
            item.iter_mut().zip(value.chunks_exact(size)).for_each(|(x, bytes)| *x = read(bytes));
        }
        Ok(items)
    }

    /// So many rows of bytes of a view.
    fn rows(
        &self,
        view: u32,
        offset: usize,
        count: usize,
        size: usize,
        name: &str,
    ) -> Result<impl Iterator<Item = &[u8]>, FileDefect> {
        let missing = || FileDefect::mismatch(format!("{name} is in buffer view {view}, which is not there"));
        let short =
            || FileDefect::truncated(format!("{name} reaches beyond its buffer; the file is cut off"));
        let view = self.root.buffer_views.get(view as usize).ok_or_else(missing)?;
        let data = self.view(view).ok_or_else(short)?.get(offset..).ok_or_else(short)?;
        let stride = view.byte_stride.unwrap_or(size);
        if stride < size {
            return Err(FileDefect::mismatch(format!("items of {name} overlap")));
        }
        let end = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
        let data = end.and_then(|end| data.get(..end)).ok_or_else(short)?;
        Ok((0..count).map(move |i| &data[i * stride..i * stride + size]))
    }

    fn view(&self, view: &BufferView) -> Option<&[u8]> {
        let data = self.buffers.get(view.buffer)?.get(view.byte_offset..)?;
        view.byte_length.map_or(Some(data), |length| data.get(..length))
    }

    /// Numbers that are read at most: several parts may share their bytes, and items that are not stored are zero, but not
    /// without end.
    pub(super) fn max_numbers(&self) -> usize {
        (1 << 24) + 4 * self.bytes
    }

    /// That there are more than [`max_numbers`](Self::max_numbers).
    pub(super) fn too_many(&self, count: usize, name: &str) -> FileDefect {
        FileDefect::too_large(format!(
            "{name} has {count} items, too many for a file of {} bytes; its data is not there, or is repeated very often",
            self.bytes
        ))
    }
}

/// The JSON of a file, and the buffer of its container, if it has one.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), FileDefect> {
    match Signature::of(bytes) {
        Some(Signature::Glb) => container::chunks(bytes).map(|(json, chunk)| (json, Some(chunk))),
        _ => Ok((text::without_mark(bytes), None)),
    }
}

fn root(json: &[u8]) -> Result<Root, FileDefect> {
    let parsed = serde_json::from_slice::<Root>(json);
    let version = match &parsed {
        Ok(root) => root.asset.version.clone(),
        Err(_) => {
            serde_json::from_slice::<Versioned>(json).map_or_else(|_| "2".to_owned(), |v| v.asset.version)
        }
    };
    if version.split('.').next() != Some("2") {
        return Err(FileDefect::unsupported(format!(
            "version {version} of glTF is not read; convert it to 2.0, as by `gltf-pipeline -i IN -o OUT`"
        )));
    }
    parsed.map_err(|e| FileDefect::undecodable(format!("its JSON: {e}")))
}

fn check_extension(name: &str) -> Result<(), FileDefect> {
    if PACKINGS.contains(&name) {
        return Err(packed(name));
    }
    if READ.contains(&name) || OF_LOOKS.iter().any(|beginning| name.starts_with(beginning)) {
        return Ok(());
    }
    Err(FileDefect::unsupported(format!(
        "it requires the extension {name}, which is not read; export it without, or as PLY or OBJ"
    )))
}

/// That numbers are packed in this way.
pub(super) fn packed(name: &str) -> FileDefect {
    FileDefect::unsupported(format!(
        "its meshes are packed by {name}, which is not read; unpack them first, as by `gltf-transform copy IN.glb OUT.glb`"
    ))
}

/// Numbers an item of this shape has; `None` for matrices, whose columns are padded.
fn width_of(shape: &str) -> Option<usize> {
    match shape {
        "SCALAR" => Some(1),
        "VEC2" => Some(2),
        "VEC3" => Some(3),
        "VEC4" => Some(4),
        _ => None,
    }
}

/// Kinds of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32, name: &str) -> Result<Self, FileDefect> {
        Ok(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return Err(FileDefect::value(format!("{name} has numbers of the unknown kind {code}"))),
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    fn is_index(self) -> bool {
        matches!(self, Self::U8 | Self::U16 | Self::U32)
    }

    fn number(self, b: &[u8]) -> f32 {
        match self {
            Self::I8 => f32::from(b[0].cast_signed()),
            Self::U8 => f32::from(b[0]),
            Self::I16 => f32::from(i16::from_le_bytes([b[0], b[1]])),
            Self::U16 => f32::from(u16::from_le_bytes([b[0], b[1]])),
            Self::U32 => u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32,
            Self::F32 => f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        }
    }

    /// The fraction that an integer stands for.
    fn normalised(self, number: f32) -> f32 {
        match self {
            Self::I8 => (number / 127.0).max(-1.0),
            Self::U8 => number / 255.0,
            Self::I16 => (number / 32767.0).max(-1.0),
            Self::U16 => number / 65535.0,
            Self::U32 | Self::F32 => number,
        }
    }

    /// An unsigned integer; [`is_index`](Self::is_index) tells which kinds are.
    fn index(self, b: &[u8]) -> u32 {
        match self.size() {
            1 => b[0].into(),
            2 => u16::from_le_bytes([b[0], b[1]]).into(),
            _ => u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        }
    }
}
