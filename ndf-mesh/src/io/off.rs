//! OFF, the Geomview object file format: counts, positions and polygons as lines of text.

use ndf_core::DVec3;

use super::polygons::Triangles;
use super::text::{beginning, is_binary, numbered_lines, three_numbers};
use super::{FileDefect, Parsed};

/// Whether the first word of a file is `OFF`, possibly with the letters of Geomview's variants before it.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    let text = beginning(bytes);
    let first = lines(&text).next();
    !is_binary(bytes) && first.is_some_and(|(_, line)| after_keyword(line).is_some())
}

/// Reads an OFF file. Colours and normals, of `COFF`, `NOFF` and the like, are passed over.
pub(super) fn read(bytes: &[u8]) -> Parsed {
    let text = String::from_utf8_lossy(bytes);
    let mut lines = lines(&text);
    let wrong = |line: usize, problem: &'static str| FileDefect::Syntax { line, problem: problem.into() };
    let (line, first) = lines.next().ok_or_else(|| FileDefect::missing("it has no line"))?;
    let (variant, rest) =
        after_keyword(first).ok_or_else(|| FileDefect::missing("it does not begin with OFF"))?;
    if variant.contains(['4', 'n']) || rest.trim_start().starts_with("BINARY") {
        return Err(FileDefect::unsupported(format!("the variant {} is not supported", first.trim())));
    }
    let (line, counts) = if rest.trim().is_empty() {
        lines.next().ok_or_else(|| FileDefect::truncated("it ends before the counts"))?
    } else {
        (line, rest)
    };
    let mut counts = counts.split_whitespace().map(str::parse::<u32>);
    let (Some(Ok(vertices)), Some(Ok(faces))) = (counts.next(), counts.next()) else {
        return Err(wrong(line, "the counts of vertices and faces are expected"));
    };
    // Every vertex takes six bytes at least: a count that lies reserves no more than the file's size.
    let mut positions = Vec::with_capacity((vertices as usize).min(bytes.len() / 6));
    let ends_early = |items: &'static str, found: u32, expected: u32| FileDefect::EndsEarly {
        items,
        expected: expected.into(),
        found: found.into(),
    };
    for v in 0..vertices {
        let (line, words) = lines.next().ok_or_else(|| ends_early("vertices", v, vertices))?;
        let position = three_numbers(&mut words.split_whitespace());
        let position = position.ok_or_else(|| wrong(line, "a vertex needs three numbers"))?;
        positions.push(DVec3::from_array(position));
    }
    let mut triangles = Triangles::default();
    let mut corners = Vec::new();
    for f in 0..faces {
        let (line, words) = lines.next().ok_or_else(|| ends_early("faces", f, faces))?;
        let mut words = words.split_whitespace().map(str::parse::<u32>);
        let Some(Ok(count)) = words.next() else {
            return Err(wrong(line, "a face needs the number of its corners"));
        };
        corners.clear();
        for _ in 0..count {
            match words.next() {
                Some(Ok(v)) if v < vertices => corners.push(v),
                Some(Ok(v)) => {
                    let (index, vertices) = (v.into(), vertices as usize);
                    return Err(FileDefect::LineIndex { line, index, vertices });
                }
                _ => {
                    let problem = format!("a face of {count} corners needs {count} indices").into();
                    return Err(FileDefect::Syntax { line, problem });
                }
            }
        }
        triangles.add(&corners);
    }
    triangles.into_content(positions, Vec::new())
}

/// Lines that say something, without comments.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let without_comment = |(n, line): (usize, &'_ str)| (n, line.find('#').map_or(line.len(), |i| i));
    numbered_lines(text)
        .map(move |(n, line)| (n, &line[..without_comment((n, line)).1]))
        .filter(|(_, line)| !line.trim().is_empty())
}

/// The letters before `OFF` and what follows it on the line; `None` if the line does not begin so. Counts may
/// follow at once, as in some collections.
fn after_keyword(line: &str) -> Option<(&str, &str)> {
    let (variant, rest) = line.trim_start().trim_start_matches('\u{feff}').split_once("OFF")?;
    let known = variant.chars().all(|c| "STCN4n".contains(c));
    let ends = rest.chars().next().is_none_or(|c| c.is_whitespace() || c.is_ascii_digit());
    (known && ends).then_some((variant, rest))
}
