//! OFF, the Geomview object file format: counts, positions and polygons as lines of text.

use ndf_core::DVec3;

use super::polygons::Triangles;
use super::text::{beginning, is_binary, numbered_lines, three_numbers};
use super::{Content, Parsed};

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
    let (line, first) = lines.next().ok_or("it has no line")?;
    let (variant, rest) = after_keyword(first).ok_or("it does not begin with OFF")?;
    if variant.contains(['4', 'n']) || rest.trim_start().starts_with("BINARY") {
        return Err(format!("the variant {} is not supported", first.trim()));
    }
    let (line, counts) =
        if rest.trim().is_empty() { lines.next().ok_or("it ends before the counts")? } else { (line, rest) };
    let mut counts = counts.split_whitespace().map(str::parse::<u32>);
    let (Some(Ok(vertices)), Some(Ok(faces))) = (counts.next(), counts.next()) else {
        return Err(format!("line {line}: the counts of vertices and faces are expected"));
    };
    // Every vertex takes six bytes at least: a count that lies reserves no more than the file's size.
    let mut positions = Vec::with_capacity((vertices as usize).min(bytes.len() / 6));
    for v in 0..vertices {
        let (line, words) =
            lines.next().ok_or_else(|| format!("it ends after {v} of {vertices} vertices"))?;
        let position = three_numbers(&mut words.split_whitespace());
        positions.push(DVec3::from_array(
            position.ok_or_else(|| format!("line {line}: a vertex needs three numbers"))?,
        ));
    }
    let mut triangles = Triangles::default();
    let mut corners = Vec::new();
    for f in 0..faces {
        let (line, words) = lines.next().ok_or_else(|| format!("it ends after {f} of {faces} faces"))?;
        let mut words = words.split_whitespace().map(str::parse::<u32>);
        let Some(Ok(count)) = words.next() else {
            return Err(format!("line {line}: a face needs the number of its corners"));
        };
        corners.clear();
        for _ in 0..count {
            match words.next() {
                Some(Ok(v)) if v < vertices => corners.push(v),
                Some(Ok(v)) => {
                    return Err(format!(
                        "line {line}: a face names vertex {v}, but there are {vertices} vertices"
                    ));
                }
                _ => return Err(format!("line {line}: a face of {count} corners needs {count} indices")),
            }
        }
        triangles.add(&corners);
    }
    let Content { mesh, scalars, notes } = triangles.into_content(positions, Vec::new())?;
    Ok(Content { mesh, scalars, notes })
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
