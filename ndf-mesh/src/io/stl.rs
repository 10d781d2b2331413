//! STL, text and binary. Every triangle brings its own corners; those in exactly the same place are one vertex.

use std::collections::HashMap;
use std::io::{self, Write};

use ndf_core::glam::{DVec3, Vec3};

use super::polygons::Triangles;
use super::text::{beginning, is_binary, numbered_lines, three_numbers};
use super::{FileDefect, Parsed, ReadNote};
use crate::TriangleMesh;

/// Bytes before the first triangle of a binary file: a title of 80 and the count.
const HEADER: usize = 84;
/// Bytes of a triangle in a binary file: normal, corners, attribute.
const TRIANGLE: usize = 50;

/// Whether a file is STL: its length fits a binary file, or it begins as a text file does, or it is binary
/// and the count says no more than twice what is there (cut off, or its count wrong).
pub(super) fn recognises(bytes: &[u8]) -> bool {
    let announced = announced(bytes);
    let is_exact = announced.is_some_and(|n| HEADER + n * TRIANGLE == bytes.len());
    let begins =
        beginning(bytes).trim_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case("solid"));
    let is_near = || {
        let present = bytes.len().saturating_sub(HEADER) / TRIANGLE;
        is_binary(bytes) && announced.is_some_and(|n| n <= 2 * present + 2 && present <= 2 * n + 2)
    };
    is_exact || begins || is_near()
}

/// Reads an STL file. A binary file may call itself `solid`; its length tells.
pub(super) fn read(bytes: &[u8]) -> Parsed {
    let is_exact = announced(bytes).is_some_and(|n| HEADER + n * TRIANGLE == bytes.len());
    if is_exact || is_binary(bytes) { read_binary(bytes) } else { read_text(&String::from_utf8_lossy(bytes)) }
}

/// Writes binary STL, with unit normals.
pub(super) fn write(out: &mut dyn Write, mesh: &TriangleMesh) -> io::Result<()> {
    let mut title = [b' '; 80];
    title[..3].copy_from_slice(b"ndf");
    out.write_all(&title)?;
    let count = u32::try_from(mesh.face_count()).map_err(io::Error::other)?;
    out.write_all(&count.to_le_bytes())?;
    for f in mesh.face_indices() {
        let [a, b, c] = mesh.corner_positions(f);
        for x in [mesh.face_normal(f), a, b, c].map(|p| p.to_array()).concat() {
            out.write_all(&(x as f32).to_le_bytes())?;
        }
        out.write_all(&[0; 2])?;
    }
    Ok(())
}

/// The number of triangles a binary file announces.
fn announced(bytes: &[u8]) -> Option<usize> {
    bytes.get(80..HEADER)?.try_into().ok().map(|b| u32::from_le_bytes(b) as usize)
}

fn read_binary(bytes: &[u8]) -> Parsed {
    let announced = announced(bytes).ok_or_else(|| FileDefect::truncated("it ends within its header"))?;
    let (triangles, rest) = bytes[HEADER..].as_chunks::<TRIANGLE>();
    if announced > triangles.len() {
        let found = triangles.len();
        return Err(FileDefect::truncated(format!(
            "it announces {announced} triangles but ends after {found}"
        )));
    }
    let mut soup = Soup::default();
    for triangle in &triangles[..announced] {
        let (words, _) = triangle[12..48].as_chunks::<4>();
        let x = |i: usize| f32::from_le_bytes(words[i]);
        soup.add([0, 3, 6].map(|i| Vec3::new(x(i), x(i + 1), x(i + 2)).as_dvec3()));
    }
    let mut content = soup.into_content()?;
    let left = (triangles.len() - announced) * TRIANGLE + rest.len();
    if left > 0 {
        content.notes.push(ReadNote::TrailingBytes { bytes: left });
    }
    Ok(content)
}

/// Reads the `vertex` lines between `outer loop` and `endloop`; several solids become one mesh.
fn read_text(text: &str) -> Parsed {
    let mut soup = Soup::default();
    let mut corners: Option<Vec<DVec3>> = None;
    let mut is_closed = false;
    let wrong = |line: usize, problem: String| FileDefect::Syntax { line, problem: problem.into() };
    for (line, content) in numbered_lines(text) {
        let mut words = content.split_whitespace();
        let Some(word) = words.next() else { continue };
        match (word.to_ascii_lowercase().as_str(), &mut corners) {
            ("solid", None) => is_closed = false,
            ("endsolid", None) => is_closed = true,
            ("facet" | "endfacet", None) => {}
            ("outer", None) => corners = Some(Vec::with_capacity(3)),
            ("vertex", Some(corners)) => {
                let corner = three_numbers(&mut words);
                let corner = corner.ok_or_else(|| wrong(line, "a vertex needs three numbers".to_owned()))?;
                corners.push(DVec3::from_array(corner));
            }
            ("endloop", Some(found)) => {
                let three: [DVec3; 3] = found.as_slice().try_into().map_err(|_| {
                    wrong(line, format!("a facet has {} vertices instead of three", found.len()))
                })?;
                soup.add(three);
                corners = None;
            }
            _ => return Err(wrong(line, format!("{word} is not expected here"))),
        }
    }
    if corners.is_some() || !is_closed {
        return Err(FileDefect::truncated("it ends before endsolid; the file is cut off"));
    }
    soup.into_content()
}

/// Triangles whose corners are joined where they are exactly equal, in order of first occurrence.
#[derive(Default)]
struct Soup {
    positions: Vec<DVec3>,
    index: HashMap<[u64; 3], u32>,
    triangles: Triangles,
}

impl Soup {
    fn add(&mut self, corners: [DVec3; 3]) {
        let corners = corners.map(|p| {
            // Adding zero makes −0 and 0 the same bits.
            *self.index.entry((p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert_with(|| {
                self.positions.push(p);
                self.positions.len() as u32 - 1
            })
        });
        self.triangles.add(&corners);
    }

    fn into_content(self) -> Parsed {
        self.triangles.into_content(self.positions, Vec::new())
    }
}
