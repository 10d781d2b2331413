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

/// Whether a text file begins as STL does.
pub(super) fn recognises_text(bytes: &[u8]) -> bool {
    let begins = beginning(bytes).trim_start().get(..5).is_some_and(|w| w.eq_ignore_ascii_case("solid"));
    begins && !is_binary(bytes)
}

/// Whether a file is binary STL. There is nothing to know it by but its size, which fits the count of triangles; where it
/// does not, because the file is cut off or its count wrong, what stands there must look like triangles.
pub(super) fn recognises_binary(bytes: &[u8]) -> bool {
    is_exact(bytes) || (is_binary(bytes) && looks_like_triangles(bytes))
}

/// Whether the size is that of as many triangles as are announced.
fn is_exact(bytes: &[u8]) -> bool {
    announced(bytes).is_some_and(|n| HEADER + n * TRIANGLE == bytes.len())
}

/// Whether nine triangles of ten have a normal that is of length 1 or 0 and corners of sizes that things have,
/// not all of them at the origin.
fn looks_like_triangles(bytes: &[u8]) -> bool {
    let (triangles, _) = bytes.get(HEADER..).unwrap_or_default().as_chunks::<TRIANGLE>();
    let sized = |x: &f32| *x == 0.0 || (1e-12..1e12).contains(&x.abs());
    let is_sound = |triangle: &[u8; TRIANGLE]| {
        let x: Vec<f32> = triangle[..48].as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b)).collect();
        let length = x[..3].iter().map(|x| x * x).sum::<f32>().sqrt();
        let is_nothing = x[3..].iter().all(|&x| x == 0.0);
        (length == 0.0 || (0.9..1.1).contains(&length)) && x[3..].iter().all(sized) && !is_nothing
    };
    let step = triangles.len().div_ceil(1000).max(1);
    let (sound, all) = triangles
        .iter()
        .step_by(step)
        .fold((0, 0), |(sound, all), t| (sound + usize::from(is_sound(t)), all + 1));
    all > 0 && 10 * sound >= 9 * all
}

/// Reads an STL file. A binary file may call itself `solid`; zero bytes and its length tell.
pub(super) fn read(bytes: &[u8]) -> Parsed {
    if is_exact(bytes) || is_binary(bytes) {
        read_binary(bytes)
    } else {
        read_text(&String::from_utf8_lossy(bytes))
    }
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
    // What programs write that cannot go back to the header.
    let is_unknown = matches!(announced as u32, 0 | u32::MAX) && rest.is_empty() && !is_exact(bytes);
    let mut notes = Vec::new();
    let announced = if is_unknown {
        notes.push(ReadNote::CountBySize { announced: announced as u32, triangles: triangles.len() });
        triangles.len()
    } else {
        announced
    };
    if announced > triangles.len() {
        let found = triangles.len();
        return Err(FileDefect::truncated(format!(
            "it announces {announced} triangles but ends after {found}; it is cut off, or its count is wrong"
        )));
    }
    let mut soup = Soup::default();
    for triangle in &triangles[..announced] {
        let (words, _) = triangle[12..48].as_chunks::<4>();
        let x = |i: usize| f32::from_le_bytes(words[i]);
        soup.add([0, 3, 6].map(|i| Vec3::new(x(i), x(i + 1), x(i + 2)).as_dvec3()));
    }
    let mut content = soup.into_content()?;
    content.notes.extend(notes);
    let left = (triangles.len() - announced) * TRIANGLE + rest.len();
    if left > 0 {
        content.notes.push(ReadNote::TrailingBytes { bytes: left });
    }
    Ok(content)
}

/// Reads the vertices between `outer loop` and `endloop`; several solids become one mesh. Words are parted by any white
/// space; only names, after `solid` and `endsolid`, go to the end of their line or, where everything is in one line, to
/// the next facet.
fn read_text(text: &str) -> Parsed {
    let mut soup = Soup::default();
    let mut corners: Option<Vec<DVec3>> = None;
    let mut is_closed = false;
    let wrong = |line: usize, problem: String| FileDefect::Syntax { line, problem: problem.into() };
    let mut words = numbered_lines(text)
        .flat_map(|(line, content)| words_without_title(content).map(move |word| (line, word)))
        .peekable();
    while let Some((line, word)) = words.next() {
        match (word.to_ascii_lowercase().as_str(), &mut corners) {
            (solid @ ("solid" | "endsolid" | "end"), None) => {
                is_closed = solid != "solid";
                let of_name = |at: usize, word: &str| {
                    at == line && !["facet", "endsolid", "end"].iter().any(|w| word.eq_ignore_ascii_case(w))
                };
                while words.next_if(|&(at, word)| of_name(at, word)).is_some() {}
            }
            ("facet", None) => {
                is_closed = false;
                // The normal, which the corners tell as well.
                let of_normal =
                    |word: &str| word.eq_ignore_ascii_case("normal") || word.parse::<f64>().is_ok();
                while words.next_if(|&(_, word)| of_normal(word)).is_some() {}
            }
            ("endfacet", None) => {}
            ("outer", None) => {
                words.next_if(|(_, word)| word.eq_ignore_ascii_case("loop"));
                corners = Some(Vec::with_capacity(3));
            }
            ("vertex", Some(corners)) => {
                let corner = three_numbers(&mut words.by_ref().map(|(_, word)| word));
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

/// The words of a line, without the name in lines that only begin or end a solid.
fn words_without_title(line: &str) -> impl Iterator<Item = &str> {
    let is = |word: Option<&str>, wanted: &str| word.is_some_and(|word| word.eq_ignore_ascii_case(wanted));
    let mut words = line.split_whitespace();
    let (first, second) = (words.next(), words.next());
    let begins_or_ends =
        is(first, "solid") || is(first, "endsolid") || (is(first, "end") && is(second, "solid"));
    let is_title = begins_or_ends && !line.split_whitespace().any(|word| is(Some(word), "endloop"));
    line.split_whitespace().take(if is_title { 1 } else { usize::MAX })
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
