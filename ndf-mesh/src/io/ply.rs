//! PLY, the Stanford polygon format (Turk 1994), parsed by the crate `serde-ply`.
//!
//! `serde-ply` streams rows through visitors, so that properties of any type and order go straight into
//! columns. Of the crates tried (`ply-rs` and `ply-rs-bw` besides) it read large files fastest, and it takes `nan` in
//! text files.

use std::io::{self, Write};

use ndf_core::DVec3;
use serde::de::Deserializer;
use serde_ply::{ElementDef, PlyFormat, PlyReader, PropertyType};

use super::polygons::Triangles;
use super::text::without_mark;
use super::{FileDefect, Parsed, ReadNote, Signature, VertexScalars};
use crate::TriangleMesh;

mod long_rows;
mod rows;

use rows::{Columns, Row};

/// An element that the header of a PLY file announces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlyElement {
    /// Its name.
    pub name: String,
    /// The number of rows announced.
    pub count: usize,
    /// Names of its properties, in order.
    pub properties: Vec<String>,
}

/// The elements in the header of a PLY file; `None` if the bytes are no PLY file or its header is malformed. The
/// body is not looked at.
pub fn ply_elements(bytes: &[u8]) -> Option<Vec<PlyElement>> {
    if Signature::of(bytes) != Some(Signature::Ply) {
        return None;
    }
    let (header, _) = split_header(without_mark(bytes)).ok()?;
    let reader = PlyReader::from_reader(header.as_bytes()).ok()?;
    let element = |e: &ElementDef| PlyElement {
        name: e.name.clone(),
        count: e.count,
        properties: e.properties.iter().map(|p| p.name.clone()).collect(),
    };
    Some(reader.header().elem_defs.iter().map(element).collect())
}

/// Reads a PLY file: `x`, `y`, `z` of the element `vertex`, its other scalar properties, the polygons of the
/// element `face` and the strips of the element `tristrips`. Other elements are skipped.
pub(super) fn read(bytes: &[u8]) -> Parsed {
    let (header, body) = split_header(bytes)?;
    let trimmed = long_rows::trimmed(&header, body)?;
    let body = trimmed.as_ref().map_or(body, |trimmed| &trimmed.body);
    // The last number of a text file need not be followed by white space, but `serde-ply` asks for it.
    let stream = io::Read::chain(header.as_bytes(), io::Read::chain(body, &b"\n"[..]));
    let mut reader =
        PlyReader::from_reader(stream).map_err(|e| FileDefect::undecodable(format!("header: {}", e.0)))?;
    let format = reader.header().format;
    let mut vertices = None;
    let mut triangles = Triangles::default();
    while let Some(element) = reader.current_element().cloned() {
        check_length(&element, format, body.len())?;
        match element.name.as_str() {
            "vertex" if vertices.is_none() => vertices = Some(read_vertices(&mut reader, &element)?),
            "face" => {
                let list = list_of(&element, &["vertex_indices", "vertex_index"])?;
                read_lists(&mut reader, &element, list, |corners| triangles.add(corners))?;
            }
            "tristrips" => {
                let list = list_of(&element, &["vertex_indices", "vertex_index"])?;
                // −1 ends a strip.
                let split = |list: &[u32]| {
                    list.split(|&v| v == u32::MAX).for_each(|strip| triangles.add_strip(strip));
                };
                read_lists(&mut reader, &element, list, split)?;
            }
            _ => read_rows(&mut reader, &element, &mut Columns::default())?,
        }
    }
    let none = || FileDefect::missing("it has no element named vertex");
    let (positions, scalars) = vertices.ok_or_else(none)?;
    let mut content = triangles.into_content(positions, scalars)?;
    content.notes.extend(trimmed.map(|trimmed| ReadNote::LongRows { rows: trimmed.rows }));
    Ok(content)
}

/// The ends of the rows of the element `edge`.
pub(super) fn edges(bytes: &[u8]) -> Result<Vec<[u32; 2]>, FileDefect> {
    let (header, body) = split_header(bytes)?;
    let stream = io::Read::chain(header.as_bytes(), io::Read::chain(body, &b"\n"[..]));
    let mut reader =
        PlyReader::from_reader(stream).map_err(|e| FileDefect::undecodable(format!("header: {}", e.0)))?;
    let format = reader.header().format;
    let mut edges = Vec::new();
    while let Some(element) = reader.current_element().cloned() {
        check_length(&element, format, body.len())?;
        if element.name != "edge" {
            read_rows(&mut reader, &element, &mut Columns::default())?;
            continue;
        }
        let named = |name: &str| {
            let found = element.properties.iter().position(|p| p.name == name);
            found.ok_or_else(|| FileDefect::missing(format!("element edge has no property {name}")))
        };
        let ends = [named("vertex1")?, named("vertex2")?];
        let mut keep = |row: &Row| {
            let [a, b] = ends.map(|i| row.scalars[i]);
            let is_index = |x: f64| f64::from(x as u32) == x;
            if !is_index(a) || !is_index(b) {
                return Err(format!("{a} and {b} are not vertex indices"));
            }
            edges.push([a as u32, b as u32]);
            Ok(())
        };
        read_rows(&mut reader, &element, &mut Columns { list: None, each: Some(&mut keep) })?;
    }
    Ok(edges)
}

/// Writes binary little-endian PLY: the points as `vertex`, the segments as `edge`.
pub(super) fn write_lines(
    out: &mut dyn Write,
    points: &[DVec3],
    segments: &[[u32; 2]],
    is_double: bool,
) -> io::Result<()> {
    let number = if is_double { "double" } else { "float" };
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", points.len())?;
    writeln!(out, "property {number} x\nproperty {number} y\nproperty {number} z")?;
    writeln!(out, "element edge {}\nproperty int vertex1\nproperty int vertex2\nend_header", segments.len())?;
    points.iter().try_for_each(|&p| write_position(out, p, is_double))?;
    segments.iter().flatten().try_for_each(|v| out.write_all(&v.to_le_bytes()))
}

fn write_position(out: &mut dyn Write, position: DVec3, is_double: bool) -> io::Result<()> {
    position.to_array().into_iter().try_for_each(|x| {
        if is_double { out.write_all(&x.to_le_bytes()) } else { out.write_all(&(x as f32).to_le_bytes()) }
    })
}

/// Writes binary little-endian PLY: `x y z` as float, one float property a scalar, and the faces as lists
/// `vertex_indices` of int with counts of uchar.
pub(super) fn write(
    out: &mut dyn Write,
    mesh: &TriangleMesh,
    scalars: &[VertexScalars],
    is_double: bool,
) -> io::Result<()> {
    let number = if is_double { "double" } else { "float" };
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", mesh.vertex_count())?;
    writeln!(out, "property {number} x\nproperty {number} y\nproperty {number} z")?;
    for scalar in scalars {
        writeln!(out, "property float {}", scalar.name)?;
    }
    writeln!(out, "element face {}\nproperty list uchar int vertex_indices\nend_header", mesh.face_count())?;
    for (v, p) in mesh.positions().iter().enumerate() {
        write_position(out, *p, is_double)?;
        for scalar in scalars {
            out.write_all(&scalar.values[v].to_le_bytes())?;
        }
    }
    for face in mesh.faces() {
        out.write_all(&[3])?;
        for v in face {
            out.write_all(&v.to_le_bytes())?;
        }
    }
    Ok(())
}

/// The header as text, its lines ended by `\n`, and the bytes after it.
fn split_header(bytes: &[u8]) -> Result<(String, &[u8]), FileDefect> {
    // Lines end as the first one does: a binary body may begin with any byte.
    let end: &[u8] = match bytes.iter().position(|b| matches!(b, b'\r' | b'\n')) {
        Some(i) if bytes[i..].starts_with(b"\r\n") => b"\r\n",
        Some(i) => &bytes[i..=i],
        None => b"\n",
    };
    let mut header = String::new();
    let mut rest = bytes;
    loop {
        let at = rest.windows(end.len()).position(|w| w == end);
        let line = String::from_utf8_lossy(&rest[..at.unwrap_or(rest.len())]);
        header.extend([line.trim(), "\n"]);
        let is_last = line.trim() == "end_header";
        rest = at.map_or(&[][..], |at| &rest[at + end.len()..]);
        if is_last {
            return Ok((header, rest));
        }
        if at.is_none() {
            let text = "the header ends without end_header; the file is cut off";
            return Err(FileDefect::truncated(text));
        }
    }
}

/// Refuses counts the rest of the file cannot hold, and rows without properties, before anything is read.
fn check_length(element: &ElementDef, format: PlyFormat, available: usize) -> Result<(), FileDefect> {
    let size = |property: &PropertyType| match (format, property) {
        (PlyFormat::Ascii, _) => 2,
        (_, PropertyType::Scalar(kind) | PropertyType::List { count_type: kind, .. }) => rows::size_of(*kind),
    };
    let row: usize = element.properties.iter().map(|p| size(&p.property_type)).sum();
    let (name, count) = (&element.name, element.count);
    if count > 0 && element.properties.is_empty() {
        let text = format!("element {name} announces {count} rows without properties");
        return Err(FileDefect::missing(text));
    }
    let needed = (count as u128) * (row as u128);
    if needed > available as u128 + 1 {
        let text = format!(
            "element {name} announces {count} rows of at least {row} bytes, but only {available} bytes follow the header; \
             the file is cut off or its header wrong"
        );
        return Err(FileDefect::truncated(text));
    }
    if count > u32::MAX as usize {
        let text = format!("element {name} has {count} rows, more than 32-bit indices can name");
        return Err(FileDefect::too_large(text));
    }
    Ok(())
}

/// Which property is the list with one of these names.
fn list_of(element: &ElementDef, names: &[&str]) -> Result<usize, FileDefect> {
    let is_list = |p: &serde_ply::PlyProperty| {
        matches!(p.property_type, PropertyType::List { .. }) && names.contains(&p.name.as_str())
    };
    let none = || {
        let text = format!("element {} has no list named {}", element.name, names.join(" or "));
        FileDefect::missing(text)
    };
    element.properties.iter().position(is_list).ok_or_else(none)
}

fn read_vertices<R: io::BufRead>(
    reader: &mut PlyReader<R>,
    element: &ElementDef,
) -> Result<(Vec<DVec3>, Vec<VertexScalars>), FileDefect> {
    let is_scalar = |i: usize| matches!(element.properties[i].property_type, PropertyType::Scalar(_));
    let named = |name: &str| {
        let found =
            (0..element.properties.len()).find(|&i| element.properties[i].name == name && is_scalar(i));
        found.ok_or_else(|| FileDefect::missing(format!("element vertex has no property {name}")))
    };
    let axes = [named("x")?, named("y")?, named("z")?];
    let mut positions = Vec::with_capacity(element.count);
    let others: Vec<usize> =
        (0..element.properties.len()).filter(|&i| is_scalar(i) && !axes.contains(&i)).collect();
    let mut scalars: Vec<VertexScalars> = others
        .iter()
        .map(|&i| VertexScalars {
            name: element.properties[i].name.clone(),
            values: Vec::with_capacity(element.count),
        })
        .collect();
    let mut keep = |row: &Row| {
        positions.push(DVec3::from_array(axes.map(|i| row.scalars[i])));
        for (scalar, &i) in scalars.iter_mut().zip(&others) {
            scalar.values.push(row.scalars[i] as f32);
        }
        Ok(())
    };
    read_rows(reader, element, &mut Columns { list: None, each: Some(&mut keep) })?;
    Ok((positions, scalars))
}

/// Reads the rows of an element for one list of vertex indices.
fn read_lists<R: io::BufRead>(
    reader: &mut PlyReader<R>,
    element: &ElementDef,
    list: usize,
    mut each: impl FnMut(&[u32]),
) -> Result<(), FileDefect> {
    let mut indices = Vec::new();
    let mut keep = |row: &Row| {
        indices.clear();
        for &x in &row.list {
            // −1 separates strips; as an index of a face it is out of range like any other wrong one.
            let index = if x == -1.0 { Some(u32::MAX) } else { (x as u32 as f64 == x).then_some(x as u32) };
            indices.push(index.ok_or_else(|| format!("{x} is not a vertex index"))?);
        }
        each(&indices);
        Ok(())
    };
    read_rows(reader, element, &mut Columns { list: Some(list), each: Some(&mut keep) })
}

fn read_rows<R: io::BufRead>(
    reader: &mut PlyReader<R>,
    element: &ElementDef,
    columns: &mut Columns<'_>,
) -> Result<(), FileDefect> {
    let mut row = 0;
    reader
        .deserialize_map(rows::Element { columns, properties: element.properties.len(), row: &mut row })
        .map_err(|e| {
            let (name, count) = (&element.name, element.count);
            match e.0.kind() {
                io::ErrorKind::UnexpectedEof => FileDefect::truncated(format!(
                    "it ends within row {row} of the {count} of element {name}"
                )),
                _ => FileDefect::value(format!("row {row} of element {name}: {}", e.0)),
            }
        })
}
