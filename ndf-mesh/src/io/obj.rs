//! Wavefront OBJ: positions and faces, as they stand in the file.
//!
//! Readers made for drawing number vertices by first use, drop those no face uses and split them at texture seams. Here
//! vertices keep the numbers of the file; texture coordinates, objects and groups are passed over, and so are normals,
//! but for those of files without faces, where they belong to the points one by one.

use std::borrow::Cow;
use std::io::{self, Write};

use ndf_core::DVec3;

use super::polygons::Triangles;
use super::text::{beginning, is_binary, numbered_lines, three_numbers};
use super::{FileDefect, Parsed, VertexScalars};
use crate::TriangleMesh;

/// First words of the lines of OBJ files.
const KEYWORDS: [&str; 10] = ["v", "vn", "vt", "f", "l", "o", "g", "s", "mtllib", "usemtl"];

/// Whether a file looks like OBJ: text in which a line begins as OBJ lines do.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    let begins = |line: &str| line.split_whitespace().next().is_some_and(|word| KEYWORDS.contains(&word));
    !is_binary(bytes) && numbered_lines(&beginning(bytes)).any(|(_, line)| begins(line))
}

/// Whether a file has a face.
pub(super) fn has_faces(bytes: &[u8]) -> bool {
    statements(&String::from_utf8_lossy(bytes)).any(|s| s.keyword() == "f")
}

/// Reads an OBJ file: positions in the order of the file and faces, of all objects and groups.
pub(super) fn read(bytes: &[u8]) -> Parsed {
    let text = String::from_utf8_lossy(bytes);
    let vertices = statements(&text).filter(|s| s.keyword() == "v").count();
    if vertices == 0 {
        refuse_prose(&text)?;
    }
    // Every vertex takes eight bytes at least, so that this reserves no more than a small multiple of the file's size.
    let mut positions = Vec::with_capacity(vertices);
    let mut triangles = Triangles::default();
    let mut corners = Vec::new();
    for statement in statements(&text) {
        match statement.keyword() {
            "v" => positions.push(position(&statement)?),
            "f" => {
                corners.clear();
                for index in statement.indices() {
                    corners.push(corner(index, statement.line, positions.len(), vertices)?);
                }
                triangles.add(&corners);
            }
            _ => {}
        }
    }
    let normals = if triangles.is_empty() { normals_of_points(&text, vertices) } else { Vec::new() };
    triangles.into_content(positions, normals)
}

/// The normals of a file without faces, if there is one for each vertex, as scalars.
fn normals_of_points(text: &str, vertices: usize) -> Vec<VertexScalars> {
    let all: Option<Vec<[f64; 3]>> =
        statements(text).filter(|s| s.keyword() == "vn").map(|s| three_numbers(&mut s.words())).collect();
    match all {
        Some(all) if all.len() == vertices => VertexScalars::of_normals(&all),
        _ => Vec::new(),
    }
}

/// The position of a vertex: three numbers. A fourth is a weight; more are a colour, of no interest here.
fn position(statement: &Statement<'_>) -> Result<DVec3, FileDefect> {
    let line = statement.line;
    let wrong = |problem: &'static str| FileDefect::Syntax { line, problem: problem.into() };
    let needs = || wrong("a vertex needs three numbers");
    let mut words = statement.words();
    let position = DVec3::from_array(three_numbers(&mut words).ok_or_else(needs)?);
    match (words.next(), words.next()) {
        (Some(weight), None) => match weight.parse::<f64>() {
            Ok(0.0) => Err(wrong("the weight of the vertex is zero")),
            Ok(weight) => Ok(position / weight),
            Err(_) => Err(needs()),
        },
        _ => Ok(position),
    }
}

/// The vertex that an index of a face names: counted from 1, or backwards from the vertices before the face.
fn corner(index: &str, line: usize, before: usize, vertices: usize) -> Result<u32, FileDefect> {
    let wrong = |problem: &'static str| FileDefect::Syntax { line, problem: problem.into() };
    let index: i64 = index.parse().map_err(|_| wrong("the indices of a face must be integers"))?;
    let vertex = if index < 0 { before as i64 + index } else { index - 1 };
    if !(0..vertices as i64).contains(&vertex) {
        return Err(FileDefect::LineIndex { line, index, vertices });
    }
    u32::try_from(vertex).map_err(|_| wrong("a mesh has fewer than 2^32 vertices"))
}

/// A file without vertices is an empty mesh only if it says nothing else.
fn refuse_prose(text: &str) -> Result<(), FileDefect> {
    let is_foreign = |s: &Statement<'_>| {
        let keyword = s.keyword();
        !keyword.is_empty() && !keyword.starts_with('#') && !KEYWORDS.contains(&keyword)
    };
    match statements(text).find(is_foreign) {
        Some(s) => {
            let text = format!("it has no vertex, and line {} is no OBJ statement", s.line);
            Err(FileDefect::missing(text))
        }
        None => Ok(()),
    }
}

/// The segments of the polylines: those of statements `l`.
pub(super) fn lines(bytes: &[u8]) -> Result<Vec<[u32; 2]>, FileDefect> {
    let text = String::from_utf8_lossy(bytes);
    let vertices = statements(&text).filter(|s| s.keyword() == "v").count();
    let (mut before, mut segments) = (0, Vec::new());
    for statement in statements(&text) {
        match statement.keyword() {
            "v" => before += 1,
            "l" => {
                let ends = statement.indices().map(|index| corner(index, statement.line, before, vertices));
                let ends = ends.collect::<Result<Vec<u32>, _>>()?;
                segments.extend(ends.windows(2).map(|ends| [ends[0], ends[1]]));
            }
            _ => {}
        }
    }
    Ok(segments)
}

/// Writes points and one statement `l` a segment.
pub(super) fn write_lines(out: &mut dyn Write, points: &[DVec3], segments: &[[u32; 2]]) -> io::Result<()> {
    points.iter().try_for_each(|p| writeln!(out, "v {} {} {}", p.x, p.y, p.z))?;
    segments.iter().try_for_each(|[a, b]| writeln!(out, "l {} {}", a + 1, b + 1))
}

/// Writes positions (shortest decimals that read back the same) and faces.
pub(super) fn write(out: &mut dyn Write, mesh: &TriangleMesh) -> io::Result<()> {
    for p in mesh.positions() {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for [a, b, c] in mesh.faces().iter().map(|f| f.map(|v| v + 1)) {
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}

/// A line, or several joined by `\` at their ends.
struct Statement<'a> {
    text: Cow<'a, str>,
    line: usize,
}

impl Statement<'_> {
    fn keyword(&self) -> &str {
        self.text.split_whitespace().next().unwrap_or_default()
    }

    /// The words after the keyword, comments cut off.
    fn words(&self) -> impl Iterator<Item = &str> {
        self.text.split('#').next().unwrap_or_default().split_whitespace().skip(1)
    }

    /// The position indices of the corners of a face: what stands before the first slash.
    fn indices(&self) -> impl Iterator<Item = &str> {
        self.words().map(|word| word.split('/').next().unwrap_or_default())
    }
}

/// The statements of an OBJ text, in order.
fn statements(text: &str) -> impl Iterator<Item = Statement<'_>> {
    let mut lines = numbered_lines(text);
    std::iter::from_fn(move || {
        let (line, first) = lines.next()?;
        let mut text = Cow::Borrowed(first);
        while let Some(continued) = text.trim_end().strip_suffix('\\') {
            let Some((_, more)) = lines.next() else { break };
            text = format!("{continued} {more}").into();
        }
        Some(Statement { text, line })
    })
}
