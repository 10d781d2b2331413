//! The triangles of a scene as one mesh.
//!
//! glTF repeats a vertex wherever its normal or its place in a picture changes, so that vertices of a mesh in exactly the same
//! place are one here, as those of STL are. Where the extension `EXT_mesh_manifold` says how faces meet, vertices stay as
//! they are. Meshes of different nodes are not joined.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use ndf_core::DVec3;
use ndf_core::glam::DAffine3;

use super::super::polygons::Triangles;
use super::super::{FileDefect, Parsed, ReadNote, VertexScalars};
use super::document::{PACKINGS, packed};
use super::json::{Mode, Primitive};
use super::names::{self, Stored};
use super::{Document, PlacedMesh, SPLATS};

pub(in super::super) fn read(bytes: &[u8], path: &Path) -> Parsed {
    let document = Document::parse(bytes, path.parent().unwrap_or(Path::new("")))?;
    let mut joined = Joined::new(&document);
    for placed in document.placed_meshes()? {
        joined.add_mesh(&placed)?;
    }
    joined.into_content()
}

/// Attributes that primitives share, as far as they are read: positions and scalars.
type Attributes = BTreeMap<String, u32>;

/// All that was read of a scene so far.
struct Joined<'a> {
    document: &'a Document<'a>,
    positions: Vec<DVec3>,
    triangles: Triangles,
    columns: Vec<Column>,
    /// Places of columns by name.
    names: HashMap<String, usize>,
    /// Numbers that may still be read.
    left: usize,
    repeated: usize,
    not_triangles: usize,
    posed: usize,
}

/// Which vertices of a part are kept.
enum Kept<'a> {
    /// Those in places where none is yet.
    Welded(&'a mut HashMap<[u64; 3], u32>),
    /// Those that a face names.
    Named(&'a [bool]),
}

/// A scalar, whose values end before those of vertices that do not have it.
struct Column {
    name: String,
    values: Vec<f32>,
}

impl<'a> Joined<'a> {
    fn new(document: &'a Document<'a>) -> Self {
        Self {
            document,
            positions: Vec::new(),
            triangles: Triangles::default(),
            columns: Vec::new(),
            names: HashMap::new(),
            left: document.max_numbers(),
            repeated: 0,
            not_triangles: 0,
            posed: 0,
        }
    }

    /// The number of items of an accessor, if so many numbers may still be read.
    fn take(&mut self, accessor: u32, width: usize, name: &str) -> Result<usize, FileDefect> {
        let count = self.document.count(accessor)?;
        self.take_numbers(count.saturating_mul(width), name)?;
        Ok(count)
    }

    /// Counts numbers that are read, at least one, so that empty parts come to an end, too.
    fn take_numbers(&mut self, numbers: usize, name: &str) -> Result<(), FileDefect> {
        self.left =
            self.left.checked_sub(numbers.max(1)).ok_or_else(|| self.document.too_many(numbers, name))?;
        Ok(())
    }

    fn add_mesh(&mut self, placed: &PlacedMesh) -> Result<(), FileDefect> {
        let primitives = self.document.primitives(placed.mesh);
        // Many nodes may place a mesh of many parts, which cost time even if there is nothing in them.
        self.take_numbers(primitives.len(), "the list of its parts")?;
        self.posed +=
            usize::from(placed.has_skin || primitives.iter().any(|primitive| !primitive.targets.is_empty()));
        let manifold = self.document.root.meshes.get(placed.mesh as usize);
        if let Some(manifold) = manifold.and_then(|mesh| mesh.extensions.manifold.as_deref()) {
            return self.add_manifold(&manifold.manifold_primitive, primitives, placed.affine);
        }
        let mut welded = HashMap::new();
        let mut added: HashMap<Attributes, Vec<u32>> = HashMap::new();
        for primitive in primitives {
            if primitive.extensions.contains_key(SPLATS) {
                return Err(FileDefect::unsupported(
                    "it holds Gaussian splats, which are read from .glb, and no mesh",
                ));
            }
            let position = primitive.attributes.get("POSITION").filter(|_| primitive.has_triangles());
            let Some(&position) = position else {
                self.not_triangles += 1;
                continue;
            };
            let packing = PACKINGS.iter().find(|&&name| primitive.extensions.contains_key(name));
            if let Some(name) =
                packing.filter(|_| self.document.accessor(position).is_ok_and(|a| a.buffer_view.is_none()))
            {
                return Err(packed(name));
            }
            let attributes = shared(primitive);
            if !added.contains_key(&attributes) {
                let scalars = names::stored(&primitive.attributes, &primitive.extras);
                let numbers =
                    self.add_vertices(position, &scalars, placed.affine, Kept::Welded(&mut welded))?;
                added.insert(attributes.clone(), numbers);
            }
            let numbers = &added[&attributes];
            let corners = self.corners(primitive, numbers.len())?;
            self.add_faces(primitive.mode, &corners, numbers, placed.affine)?;
        }
        Ok(())
    }

    /// A mesh whose faces meet as `manifold` says; its scalars are those of its primitives.
    fn add_manifold(
        &mut self,
        manifold: &Primitive,
        primitives: &[Primitive],
        affine: DAffine3,
    ) -> Result<(), FileDefect> {
        let position = manifold.attributes.get("POSITION");
        let position = *position.ok_or_else(|| FileDefect::missing("its manifold has no positions"))?;
        let same =
            primitives.iter().filter(|primitive| primitive.attributes.get("POSITION") == Some(&position));
        let mut scalars: Vec<Stored> =
            same.flat_map(|primitive| names::stored(&primitive.attributes, &primitive.extras)).collect();
        scalars.sort_by_key(|stored| stored.accessor);
        scalars.dedup_by_key(|stored| stored.accessor);
        let count = self.document.count(position)?;
        let corners = self.corners(manifold, count)?;
        // Vertices that are joined to others are named by no face any more.
        let has_joined = match manifold.indices {
            Some(indices) => self.document.accessor(indices)?.sparse.is_some(),
            None => false,
        };
        let mut is_named = vec![!has_joined; count.min(self.document.max_numbers())];
        for &corner in &corners {
            is_named.get_mut(corner as usize).into_iter().for_each(|named| *named = true);
        }
        let numbers = self.add_vertices(position, &scalars, affine, Kept::Named(&is_named))?;
        self.add_faces(manifold.mode, &corners, &numbers, affine)
    }

    /// Adds vertices and their scalars; returns the number of each.
    fn add_vertices(
        &mut self,
        position: u32,
        scalars: &[Stored],
        affine: DAffine3,
        mut kept: Kept<'_>,
    ) -> Result<Vec<u32>, FileDefect> {
        let count = self.take(position, 3, "POSITION")?;
        let local = self.document.numbers(position, 3, "POSITION")?;
        let first = self.positions.len();
        if first + count > u32::MAX as usize {
            return Err(FileDefect::too_large("it has more vertices than 32-bit indices can name"));
        }
        let mut numbers = Vec::with_capacity(count);
        for &[x, y, z] in local.as_chunks::<3>().0 {
            let position = affine.transform_point3(DVec3::new(x.into(), y.into(), z.into()));
            if !position.is_finite() {
                return Err(FileDefect::NotFinite("the place of a vertex"));
            }
            let new = self.positions.len() as u32;
            let number = match &mut kept {
                // Adding zero makes −0 and 0 the same bits.
                Kept::Welded(places) => {
                    *places.entry((position + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(new)
                }
                Kept::Named(is_named) if is_named[numbers.len()] => new,
                Kept::Named(_) => u32::MAX,
            };
            if number == new {
                self.positions.push(position);
            }
            numbers.push(number);
        }
        if let Kept::Welded(_) = kept {
            self.repeated += count - (self.positions.len() - first);
        }
        for stored in scalars {
            // Vectors and matrices are no scalars.
            if self.document.accessor(stored.accessor)?.shape.as_deref() != Some("SCALAR") {
                continue;
            }
            if self.take(stored.accessor, 1, &stored.name)? != count {
                let text = format!("the attribute {} has not one value for each vertex", stored.name);
                return Err(FileDefect::mismatch(text));
            }
            let values = self.document.numbers(stored.accessor, 1, &stored.name)?;
            let column = *self.names.entry(stored.name.clone()).or_insert_with(|| {
                self.columns.push(Column { name: stored.name.clone(), values: Vec::new() });
                self.columns.len() - 1
            });
            // What came before has no such value.
            let missing = first.saturating_sub(self.columns[column].values.len());
            self.take_numbers(missing, &stored.name)?;
            let column = &mut self.columns[column].values;
            column.resize(column.len() + missing, f32::NAN);
            for (&number, value) in numbers.iter().zip(values) {
                if number as usize == column.len() {
                    column.push(stored.value(value));
                }
            }
        }
        Ok(numbers)
    }

    /// The corners of a primitive of so many vertices, each of which is there.
    fn corners(&mut self, primitive: &Primitive, vertices: usize) -> Result<Vec<u32>, FileDefect> {
        let Some(indices) = primitive.indices else {
            let count = u32::try_from(vertices).map_err(|_| self.document.too_many(vertices, "POSITION"))?;
            self.take_numbers(vertices, "POSITION")?;
            return Ok((0..count).collect());
        };
        self.take(indices, 1, "indices")?;
        let corners = self.document.indices(indices)?;
        if let Some(corner) = corners.iter().find(|&&corner| corner as usize >= vertices) {
            let text = format!("a face names vertex {corner} of a part with {vertices} vertices");
            return Err(FileDefect::mismatch(text));
        }
        Ok(corners)
    }

    fn add_faces(
        &mut self,
        mode: Mode,
        corners: &[u32],
        numbers: &[u32],
        affine: DAffine3,
    ) -> Result<(), FileDefect> {
        if mode == Mode::TRIANGLES && !corners.len().is_multiple_of(3) {
            return Err(FileDefect::mismatch(format!("{} corners are no triangles", corners.len())));
        }
        // A mirror turns triangles over.
        let is_mirrored = affine.matrix3.determinant() < 0.0;
        let mut add = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|corner| numbers[corner as usize]);
            self.triangles.add(&if is_mirrored { [a, c, b] } else { [a, b, c] });
        };
        match (mode, corners) {
            (Mode::TRIANGLE_STRIP, _) => {
                for (i, window) in corners.windows(3).enumerate() {
                    let [a, b, c] = [window[0], window[1], window[2]];
                    // Triangles that name a corner twice lead from one strip to the next.
                    if a != b && b != c && c != a {
                        add(if i % 2 == 0 { [a, b, c] } else { [a, c, b] });
                    }
                }
            }
            (Mode::TRIANGLE_FAN, [first, rest @ ..]) => {
                rest.windows(2).for_each(|pair| add([*first, pair[0], pair[1]]));
            }
            _ => corners.as_chunks::<3>().0.iter().for_each(|&face| add(face)),
        }
        Ok(())
    }

    fn into_content(self) -> Parsed {
        if self.triangles.is_empty() {
            let text = match self.not_triangles {
                0 => "its scene has no triangles",
                _ => "its scene has points or lines, but no triangles; points are read from PLY, XYZ and E57",
            };
            return Err(FileDefect::missing(text));
        }
        let vertices = self.positions.len();
        if self.columns.len().saturating_mul(vertices) > self.document.max_numbers() {
            return Err(self.document.too_many(vertices, "the values of its vertices"));
        }
        let padded = |Column { name, mut values }| {
            values.resize(vertices, f32::NAN);
            VertexScalars { name, values }
        };
        let scalars = self.columns.into_iter().map(padded).collect();
        let mut content = self.triangles.into_content(self.positions, scalars)?;
        let all = [
            (self.repeated, ReadNote::SeamsJoined { vertices: self.repeated }),
            (self.not_triangles, ReadNote::PartsLeftOut { parts: self.not_triangles }),
            (self.posed, ReadNote::BasePose { meshes: self.posed }),
        ];
        content.notes.extend(all.into_iter().filter(|(count, _)| *count > 0).map(|(_, note)| note));
        Ok(content)
    }
}

/// What two primitives must have alike to have the same vertices.
fn shared(primitive: &Primitive) -> Attributes {
    let is_read = |name: &str| name == "POSITION" || name.starts_with('_');
    primitive
        .attributes
        .iter()
        .filter(|(name, _)| is_read(name))
        .map(|(name, &a)| (name.clone(), a))
        .collect()
}
