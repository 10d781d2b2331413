//! Wavefront OBJ, parsed by the crate `tobj`.
//!
//! `tobj` is made for drawing: it numbers vertices by first use, object by object, drops those no face uses and
//! splits at texture seams. A mesh is wanted here as it stands in the file. So `tobj` is given a stream with
//! only positions and the position indices of faces, headed by one polygon that names all vertices in order.

use std::borrow::Cow;
use std::io::{self, BufRead, Read, Write};

use ndf_core::DVec3;

use super::polygons::{Triangles, too_small};
use super::text::{beginning, is_binary, numbered_lines};
use super::{Content, Parsed};
use crate::TriangleMesh;

/// First words of the lines of OBJ files.
const KEYWORDS: [&str; 10] = ["v", "vn", "vt", "f", "l", "o", "g", "s", "mtllib", "usemtl"];

/// Whether a file looks like OBJ: text in which a line begins as OBJ lines do.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    let begins = |line: &str| line.split_whitespace().next().is_some_and(|word| KEYWORDS.contains(&word));
    !is_binary(bytes) && numbered_lines(&beginning(bytes)).any(|(_, line)| begins(line))
}

/// Reads an OBJ file: positions in the order of the file and faces, of all objects and groups.
pub(super) fn read(bytes: &[u8]) -> Parsed {
    let text = String::from_utf8_lossy(bytes);
    let vertices = statements(&text).filter(|s| s.keyword() == "v").count();
    if vertices == 0 {
        refuse_prose(&text)?;
    }
    let mut stream = PositionsAndFaces::new(&text, vertices);
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    let loaded = tobj::load_obj_buf(&mut stream, &tobj::LoadOptions::default(), no_materials);
    let (models, _) = loaded.map_err(|error| defect(&error, &text, stream.line, vertices))?;
    let mut positions = Vec::with_capacity(vertices);
    let mut triangles = Triangles::default();
    for tobj::Model { mesh, .. } in models {
        positions.extend(mesh.positions.chunks_exact(3).map(DVec3::from_slice));
        // Without arities everything is a triangle; the heading polygon is one only over three vertices.
        let all_triangles = vec![3; mesh.indices.len() / 3];
        let arities = if mesh.face_arities.is_empty() { &all_triangles } else { &mesh.face_arities };
        let mut rest = &mesh.indices[..];
        for (face, &arity) in arities.iter().enumerate() {
            let (corners, others) = rest.split_at(arity as usize);
            rest = others;
            if face > 0 {
                triangles.add(corners);
            }
        }
    }
    let Content { mesh, scalars, mut notes } = triangles.into_content(positions, Vec::new())?;
    if stream.too_small > 0 {
        notes.push(too_small(stream.too_small));
    }
    Ok(Content { mesh, scalars, notes })
}

/// A file without vertices is an empty mesh only if it says nothing else.
fn refuse_prose(text: &str) -> Result<(), String> {
    let is_foreign = |s: &Statement<'_>| {
        let keyword = s.keyword();
        !keyword.is_empty() && !keyword.starts_with('#') && !KEYWORDS.contains(&keyword)
    };
    match statements(text).find(is_foreign) {
        Some(s) => Err(format!("it has no vertex, and line {} is no OBJ statement", s.line)),
        None => Ok(()),
    }
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

/// What went wrong, with the line: that of the stream, or for indices out of range, found when all is read, the
/// first line with such an index.
fn defect(error: &tobj::LoadError, text: &str, line: usize, vertices: usize) -> String {
    match error {
        tobj::LoadError::PositionParseError => format!("line {line}: a vertex needs three numbers"),
        tobj::LoadError::ScalingByZeroError => format!("line {line}: the weight of the vertex is zero"),
        tobj::LoadError::FaceParseError => format!("line {line}: the indices of a face must be integers"),
        tobj::LoadError::FaceVertexOutOfBounds => {
            let mut before = 0;
            for statement in statements(text) {
                before += i64::from(statement.keyword() == "v");
                let indices = statement.indices().filter_map(|i| i.parse::<i64>().ok());
                let mut wrong = indices.filter(|&i| i == 0 || i > vertices as i64 || i < -before);
                if let (Some(index), "f") = (wrong.next(), statement.keyword()) {
                    return format!(
                        "line {}: a face names vertex {index}, but there are {vertices} vertices",
                        statement.line
                    );
                }
            }
            "a face names a vertex that does not exist".to_owned()
        }
        other => format!("line {line}: {other}"),
    }
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

/// The stream given to `tobj`, one statement at a time, so that [`line`](Self::line) is where it stopped.
struct PositionsAndFaces<'a> {
    statements: Box<dyn Iterator<Item = Statement<'a>> + 'a>,
    buffer: String,
    taken: usize,
    line: usize,
    too_small: usize,
}

impl<'a> PositionsAndFaces<'a> {
    fn new(text: &'a str, vertices: usize) -> Self {
        let all: Vec<String> = (1..=vertices).map(|v| v.to_string()).collect();
        let buffer = if vertices > 0 { format!("f {}\n", all.join(" ")) } else { String::new() };
        Self { statements: Box::new(statements(text)), buffer, taken: 0, line: 0, too_small: 0 }
    }

    /// Puts the next statement `tobj` needs to see into the buffer; leaves it empty at the end.
    fn refill(&mut self) {
        self.buffer.clear();
        self.taken = 0;
        for statement in self.statements.by_ref() {
            self.line = statement.line;
            let mut say = |words: &mut dyn Iterator<Item = &str>| {
                self.buffer.push_str(statement.keyword());
                words.for_each(|word| self.buffer.extend([" ", word]));
                self.buffer.push('\n');
            };
            match statement.keyword() {
                // A fourth number is a weight; more are a colour, of no interest here.
                "v" if statement.words().count() == 4 => say(&mut statement.words()),
                "v" => say(&mut statement.words().take(3)),
                "f" if statement.words().count() < 3 => {
                    self.too_small += 1;
                    continue;
                }
                // An index that is missing must not vanish from the line.
                "f" => say(&mut statement.indices().map(|i| if i.is_empty() { "?" } else { i })),
                _ => continue,
            }
            return;
        }
    }
}

impl Read for PositionsAndFaces<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let n = self.fill_buf()?.read(out)?;
        self.consume(n);
        Ok(n)
    }
}

impl BufRead for PositionsAndFaces<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.taken == self.buffer.len() {
            self.refill();
        }
        Ok(&self.buffer.as_bytes()[self.taken..])
    }

    fn consume(&mut self, n: usize) {
        self.taken += n;
    }
}
