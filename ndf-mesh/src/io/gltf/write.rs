//! A mesh as binary glTF.

use std::io::{self, Write};

use ndf_core::DVec3;
use rayon::slice::ParallelSliceMut;
use serde_json::{Map, Value, json};

use super::super::{Rounding, VertexScalars};
use super::container;
use super::json::Mode;
use super::layout::{
    ELEMENTS, FLOAT, Parts, UNSIGNED_INT, UNSIGNED_SHORT, VERTICES, asset, origin, scene, single,
    write_positions,
};
use super::names::{self, StandIns};
use crate::TriangleMesh;
use crate::colour_map::ColourMap;

/// What a file of glTF is to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GlbOptions {
    /// Which of the scalars colours the surface; there is no colour if there is no such scalar. The first by default.
    pub coloured_by: Option<usize>,
}

impl Default for GlbOptions {
    fn default() -> Self {
        Self { coloured_by: Some(0) }
    }
}

/// Why a mesh cannot be binary glTF.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotGlb {
    /// A vertex is nowhere, or beyond the numbers of single precision.
    #[error("vertex {vertex} is not at a finite place, and glTF has no others; `.ply` keeps it")]
    NotFinite {
        /// The vertex.
        vertex: usize,
    },
    /// The file would be larger than the format allows.
    #[error(
        "binary glTF ends at 4 GiB, and {vertices} vertices with {faces} faces take more; write `.ply`, or longer edges"
    )]
    TooLarge {
        /// How many vertices there are.
        vertices: usize,
        /// How many faces there are.
        faces: usize,
    },
    /// A scalar that does not belong to the mesh.
    #[error("the scalar {name} has {values} values for {vertices} vertices")]
    ScalarLength {
        /// Name of the scalar.
        name: String,
        /// How many values it has.
        values: usize,
        /// How many vertices the mesh has.
        vertices: usize,
    },
}

/// A mesh as the bytes of a file of binary glTF (`.glb`).
///
/// Positions are in single precision, in the units and axes of the mesh: glTF means metres with y up, but nothing here knows
/// what the mesh means. Where single precision would move vertices visibly, far from the origin, positions are relative to
/// the middle of the mesh, and a node leads back. Normals weigh faces by their area. Every scalar is an attribute: an
/// underscore and its name in upper case; what the name loses by that, and which value stands for those that are not
/// finite, is in the `extras` of the primitive. A scalar may colour the surface (`COLOR_0`, linear, the colours of
/// `ndf render`). A closed, oriented mesh has the extension `EXT_mesh_manifold`, so that readers that want solids need not
/// join vertices. A mesh without faces is one of points. O(n log n); memory beyond the bytes is a small multiple of the mesh.
///
/// ```
/// use ndf_mesh::io::gltf::{GlbOptions, to_glb};
/// use ndf_mesh::io::{VertexScalars, parse_mesh};
///
/// let mesh = ndf_mesh::shapes::icosphere(2).map_positions(|p| p.as_vec3().as_dvec3());
/// let height = VertexScalars { name: "height".to_owned(), values: mesh.positions().iter().map(|p| p.z as f32).collect() };
/// let bytes = to_glb(&mesh, &[height.clone()], &GlbOptions::default())?;
/// let file = parse_mesh(&bytes, "sphere.glb".as_ref())?;
/// assert_eq!((file.mesh, file.scalars), (mesh, vec![height]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// If a position is not finite, a scalar does not fit the mesh, or the file would be larger than 4 GiB.
pub fn to_glb(
    mesh: &TriangleMesh,
    scalars: &[VertexScalars],
    options: &GlbOptions,
) -> Result<Vec<u8>, NotGlb> {
    let layout = Layout::new(mesh, scalars, options)?;
    let mut bytes = Vec::with_capacity(layout.length as usize);
    layout.write(&mut bytes).expect("memory takes all bytes");
    Ok(bytes)
}

/// Indices up to this one have 16 bits; one more would end strips.
const MAX_SHORT: usize = u16::MAX as usize - 1;

/// What stands for a normal that is none: of a vertex without faces, or one whose faces cancel.
const NO_NORMAL: DVec3 = DVec3::Z;

/// Reflectance of a surface without colours.
const GREY: f32 = 0.6;

/// A file before it is written.
pub(in super::super) struct Layout<'a> {
    mesh: &'a TriangleMesh,
    scalars: &'a [VertexScalars],
    colours: Option<(ColourMap, &'a [f32])>,
    origin: DVec3,
    has_short_indices: bool,
    json: Vec<u8>,
    buffer: usize,
    length: u32,
}

impl<'a> Layout<'a> {
    pub(in super::super) fn new(
        mesh: &'a TriangleMesh,
        scalars: &'a [VertexScalars],
        options: &GlbOptions,
    ) -> Result<Self, NotGlb> {
        let (vertices, faces) = (mesh.vertex_count(), mesh.face_count());
        if let Some(VertexScalars { name, values }) = scalars.iter().find(|s| s.values.len() != vertices) {
            return Err(NotGlb::ScalarLength { name: name.clone(), values: values.len(), vertices });
        }
        let origin = origin(mesh.positions());
        if let Some(vertex) =
            mesh.positions().iter().position(|&p| !single(p, origin).iter().all(|x| x.is_finite()))
        {
            return Err(NotGlb::NotFinite { vertex });
        }
        let coloured = options.coloured_by.and_then(|i| scalars.get(i)).filter(|_| vertices > 0);
        let colours = coloured.map(|scalar| (ColourMap::of(&scalar.values), scalar.values.as_slice()));
        let has_short_indices = vertices <= MAX_SHORT + 1;
        let mut layout = Self {
            mesh,
            scalars,
            colours,
            origin,
            has_short_indices,
            json: Vec::new(),
            buffer: 0,
            length: 0,
        };
        let too_large = || NotGlb::TooLarge { vertices, faces };
        let mut parts = Parts::default();
        let document = layout.document(&mut parts);
        layout.json = document.to_string().into_bytes();
        layout.buffer = parts.bytes;
        layout.length = container::length(&layout.json, parts.bytes).ok_or_else(too_large)?;
        Ok(layout)
    }

    /// What single precision does to positions.
    pub(in super::super) fn rounding(&self) -> Rounding {
        Rounding::about(self.mesh.positions(), self.origin)
    }

    pub(in super::super) fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        container::write(out, &self.json, self.buffer, |out| self.write_buffer(out))
    }

    fn has_faces(&self) -> bool {
        self.mesh.face_count() > 0
    }

    /// The document; what it says of the buffer is what [`write_buffer`](Self::write_buffer) writes.
    fn document(&self, parts: &mut Parts) -> Value {
        let vertices = self.mesh.vertex_count();
        if vertices == 0 {
            return json!({ "asset": asset(), "scene": 0, "scenes": [{}] });
        }
        let mut mesh = Map::new();
        let mut primitive = Map::new();
        let mut attributes = Map::new();
        let is_closed = self.has_faces() && is_closed_manifold(self.mesh.faces());
        let mode = if self.has_faces() { Mode::TRIANGLES } else { Mode::POINTS };
        if self.has_faces() {
            let (kind, size) = if self.has_short_indices { (UNSIGNED_SHORT, 2) } else { (UNSIGNED_INT, 4) };
            let indices = parts.add("SCALAR", kind, size, 3 * self.mesh.face_count(), ELEMENTS);
            primitive.insert("indices".to_owned(), indices.into());
        }
        let position = parts.add_positions(self.mesh.positions(), self.origin);
        attributes.insert("POSITION".to_owned(), position.into());
        if self.has_faces() {
            attributes.insert("NORMAL".to_owned(), parts.add("VEC3", FLOAT, 12, vertices, VERTICES).into());
        }
        if self.colours.is_some() {
            let colour = parts.add("VEC4", UNSIGNED_SHORT, 8, vertices, VERTICES);
            parts.say(colour, "normalized", true.into());
            attributes.insert("COLOR_0".to_owned(), colour.into());
        }
        let (stored, extras) = names::attributes(self.scalars);
        for name in stored {
            attributes.insert(name, parts.add("SCALAR", FLOAT, 4, vertices, VERTICES).into());
        }
        if is_closed {
            let manifold = json!({
                "attributes": { "POSITION": position },
                "indices": primitive["indices"],
                "mode": mode.0,
            });
            mesh.insert(
                "extensions".to_owned(),
                json!({ "EXT_mesh_manifold": { "manifoldPrimitive": manifold } }),
            );
        }
        primitive.insert("mode".to_owned(), mode.0.into());
        primitive.insert("material".to_owned(), 0.into());
        primitive.insert("attributes".to_owned(), attributes.into());
        primitive.extend(extras.map(|extras| ("extras".to_owned(), extras)));
        mesh.insert("primitives".to_owned(), json!([primitive]));
        let grey = if self.colours.is_some() { 1.0 } else { GREY };
        let material = json!({
            "pbrMetallicRoughness":
                { "baseColorFactor": [grey, grey, grey, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7 },
            "doubleSided": !is_closed,
        });
        let mut document = scene(mesh.into(), parts, self.origin);
        document["materials"] = json!([material]);
        if is_closed {
            document["extensionsUsed"] = json!(["EXT_mesh_manifold"]);
        }
        document
    }

    fn write_buffer(&self, out: &mut dyn Write) -> io::Result<()> {
        let corners = self.mesh.faces().as_flattened();
        if self.has_short_indices {
            corners.iter().try_for_each(|&v| out.write_all(&(v as u16).to_le_bytes()))?;
            out.write_all(&[0; 2][..2 * (corners.len() % 2)])?;
        } else {
            corners.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
        }
        write_positions(out, self.mesh.positions(), self.origin)?;
        if self.has_faces() {
            for normal in self.mesh.vertex_normals() {
                let normal = if normal == DVec3::ZERO { NO_NORMAL } else { normal };
                normal.as_vec3().to_array().iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
            }
        }
        if let Some((map, values)) = &self.colours {
            for &value in *values {
                let [r, g, b] = map.colour(value.into());
                // Eight bits would show steps in dark shades, as the values are linear.
                let colour = [r, g, b, 1.0].map(|x| (65535.0 * x).round() as u16);
                colour.iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
            }
        }
        for VertexScalars { values, .. } in self.scalars {
            let stand_ins = StandIns::of(values);
            values.iter().try_for_each(|&x| out.write_all(&stand_ins.finite(x).to_le_bytes()))?;
        }
        Ok(())
    }
}

/// Whether every half-edge has one opposite: no boundary, one orientation, at most two faces at an edge.
/// O(n log n).
fn is_closed_manifold(faces: &[[u32; 3]]) -> bool {
    let key = |[from, to]: [u32; 2]| u64::from(from) << 32 | u64::from(to);
    let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
    let sorted = |turn: bool| {
        let sides = faces.iter().flat_map(sides);
        let mut keys: Vec<u64> = sides.map(|[a, b]| key(if turn { [b, a] } else { [a, b] })).collect();
        keys.par_sort_unstable();
        keys
    };
    let keys = sorted(false);
    let is_simple =
        faces.iter().flat_map(sides).all(|[a, b]| a != b) && keys.windows(2).all(|pair| pair[0] != pair[1]);
    is_simple && keys == sorted(true)
}
