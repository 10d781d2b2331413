//! OFF, the Geomview object file format: counts, positions and polygons, as text or binary numbers.
//!
//! The keyword may be missing, written small, or have letters before it that tell what vertices have besides a place. In
//! text a vertex and a face are usually a line each, with a colour after them perhaps; files in fewer lines are read word
//! by word.

use ndf_core::DVec3;

use super::polygons::Triangles;
use super::text::{beginning, is_binary, numbered_lines, three_numbers};
use super::{FileDefect, Parsed, VertexScalars};

/// Whether the first word of a file is `OFF`, possibly with the letters of Geomview's variants before it.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    let text = beginning(bytes);
    let keyword = lines(&text).next().and_then(|(_, line)| Keyword::of(line));
    keyword.is_some_and(|(keyword, _)| keyword.is_binary || !is_binary(bytes))
}

/// Whether a text is OFF without its keyword: three counts, as many lines of three numbers or more, then a polygon.
pub(super) fn recognises_without_keyword(bytes: &[u8]) -> bool {
    if is_binary(bytes) {
        return false;
    }
    let text = beginning(bytes);
    let Some((_, first)) = lines(&text).next() else { return false };
    let counts: Option<Vec<usize>> = first.split_whitespace().map(|word| word.parse().ok()).collect();
    let Some(&[vertices, faces, _]) = counts.as_deref() else { return false };
    let text = String::from_utf8_lossy(bytes);
    let polygon = lines(&text).nth(vertices.saturating_add(1)).and_then(|(_, line)| {
        let words: Option<Vec<usize>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
        words
    });
    vertices > 0
        && faces > 0
        && polygon.is_some_and(|words| {
            words[0] > 2 && words.len() > words[0] && words[1..=words[0]].iter().all(|&v| v < vertices)
        })
}

/// Whether the header announces faces.
pub(super) fn announces_faces(bytes: &[u8]) -> bool {
    let text = beginning(bytes);
    let mut lines = lines(&text);
    match lines.next().map(|first| (first, Keyword::of(first.1))) {
        // Vertices, faces, edges.
        Some((_, Some((keyword, _)))) if keyword.is_binary => {
            binary_body(bytes).and_then(|body| body.get(4..8)).is_some_and(|faces| faces != [0; 4])
        }
        Some((first, keyword)) => Header::read(first, keyword, &mut lines).is_ok_and(|h| h.faces > 0),
        None => false,
    }
}

/// Reads an OFF file. Colours, of `COFF` and the like, are passed over, and so are normals, but for those of files without
/// faces.
pub(super) fn read(bytes: &[u8]) -> Parsed {
    let start = beginning(bytes);
    let keyword = lines(&start).next().and_then(|(_, first)| Keyword::of(first)).map(|(keyword, _)| keyword);
    if keyword.is_some_and(|keyword| keyword.has_other_space) {
        let variant = start.split_whitespace().next().unwrap_or_default();
        return Err(FileDefect::unsupported(format!("the variant {variant} is not supported")));
    }
    if let Some(keyword) = keyword.filter(|keyword| keyword.is_binary) {
        let body = binary_body(bytes).ok_or_else(|| FileDefect::truncated("it ends before the counts"))?;
        return read_binary(body, keyword);
    }
    let text = String::from_utf8_lossy(bytes);
    let mut rows = lines(&text);
    let first = rows.next().ok_or_else(|| FileDefect::missing("it has no line"))?;
    let header = Header::read(first, Keyword::of(first.1), &mut rows)?;
    // Numbers may be parted by any white space, and lines be of any length.
    let are_rows = rows.clone().next().is_none_or(|(_, first)| first.split_whitespace().nth(2).is_some());
    let count = rows.clone().count() as u64;
    if are_rows && count >= u64::from(header.vertices) + u64::from(header.faces) {
        return read_rows(&header, rows, bytes.len());
    }
    let words = header.rest.iter().copied().chain(rows.clone().flat_map(|(_, line)| line.split_whitespace()));
    let parted = header.parted(words);
    // Rows as they should be, but too few of them.
    if are_rows && parted.len() as u64 <= count {
        return read_rows(&header, rows, bytes.len());
    }
    read_rows(&header, parted.iter().map(|row| (header.line, row.as_str())), bytes.len())
}

/// Reads a line for each vertex and each face.
fn read_rows<'a>(
    header: &Header<'_>,
    mut rows: impl Iterator<Item = (usize, &'a str)>,
    size: usize,
) -> Parsed {
    let Header { vertices, faces, .. } = *header;
    let wrong = |line: usize, problem: &'static str| FileDefect::Syntax { line, problem: problem.into() };
    // Every vertex takes six bytes at least: a count that lies reserves no more than the file's size.
    let mut positions = Vec::with_capacity((vertices as usize).min(size / 6));
    let mut normals = Vec::new();
    for v in 0..vertices {
        let (line, words) = rows.next().ok_or_else(|| ends_early("vertices", v, vertices))?;
        let mut words = words.split_whitespace();
        let position = three_numbers(&mut words);
        let position = position.ok_or_else(|| wrong(line, "a vertex needs three numbers"))?;
        positions.push(DVec3::from_array(position));
        normals.extend(three_numbers(&mut words).filter(|_| faces == 0 && header.keyword.has_normals));
    }
    let mut triangles = Triangles::default();
    let mut corners = Vec::new();
    for f in 0..faces {
        let (line, words) = rows.next().ok_or_else(|| ends_early("faces", f, faces))?;
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
    let has_normals = !normals.is_empty() && normals.len() == positions.len();
    let scalars = if has_normals { VertexScalars::of_normals(&normals) } else { Vec::new() };
    triangles.into_content(positions, scalars)
}

/// What follows the line `OFF BINARY`.
fn binary_body(bytes: &[u8]) -> Option<&[u8]> {
    let end = bytes.iter().position(|&b| b == b'\n')?;
    Some(&bytes[end + 1..])
}

/// Reads big-endian numbers: three counts, floats of the vertices, and for each face the number of corners, the corners,
/// the number of colours, and these.
fn read_binary(body: &[u8], keyword: Keyword) -> Parsed {
    let mut words = body.as_chunks::<4>().0.iter().copied();
    let cut_off = || FileDefect::truncated("it ends within its header");
    let mut counts = [0; 3];
    for count in &mut counts {
        *count = words.next().map(u32::from_be_bytes).ok_or_else(cut_off)?;
    }
    let [vertices, faces, _] = counts;
    let mut positions = Vec::with_capacity((vertices as usize).min(body.len() / 12));
    for v in 0..vertices {
        let mut number = || words.next().map(|b| f64::from(f32::from_be_bytes(b)));
        let three = (|| Some([number()?, number()?, number()?]))();
        positions.push(three.map(DVec3::from_array).ok_or_else(|| ends_early("vertices", v, vertices))?);
        words.by_ref().take(keyword.numbers() - 3).for_each(drop);
    }
    let mut triangles = Triangles::default();
    let mut corners = Vec::new();
    for f in 0..faces {
        let early = || ends_early("faces", f, faces);
        let count = words.next().map(u32::from_be_bytes).ok_or_else(early)?;
        corners.clear();
        corners.extend(words.by_ref().take(count as usize).map(u32::from_be_bytes));
        let colours = words.next().map(u32::from_be_bytes).ok_or_else(early)?;
        if words.by_ref().take(colours as usize).count() < colours as usize {
            return Err(early());
        }
        triangles.add(&corners);
    }
    triangles.into_content(positions, Vec::new())
}

fn ends_early(items: &'static str, found: u32, expected: u32) -> FileDefect {
    FileDefect::EndsEarly { items, expected: expected.into(), found: found.into() }
}

/// What a text file says before its vertices.
struct Header<'a> {
    keyword: Keyword,
    vertices: u32,
    faces: u32,
    /// The words that follow the three counts on their line.
    rest: Vec<&'a str>,
    /// The line of the counts.
    line: usize,
}

impl<'a> Header<'a> {
    /// From the first line, and the next where that has no counts.
    fn read(
        (line, first): (usize, &'a str),
        keyword: Option<(Keyword, &'a str)>,
        lines: &mut impl Iterator<Item = (usize, &'a str)>,
    ) -> Result<Self, FileDefect> {
        let (keyword, rest) = keyword.unwrap_or((Keyword::default(), first));
        let (line, counts) = if rest.trim().is_empty() {
            lines.next().ok_or_else(|| FileDefect::truncated("it ends before the counts"))?
        } else {
            (line, rest)
        };
        let mut words: Vec<&str> = counts.split_whitespace().collect();
        // A count on each line.
        if words.len() == 1 {
            words.extend(lines.take(2).flat_map(|(_, more)| more.split_whitespace()));
        }
        let count = |i: usize| words.get(i).and_then(|word| word.parse::<u32>().ok());
        let (Some(vertices), Some(faces)) = (count(0), count(1)) else {
            let problem = "the counts of vertices and faces are expected".into();
            return Err(FileDefect::Syntax { line, problem });
        };
        let rest = words.split_off(words.len().min(3));
        Ok(Self { keyword, vertices, faces, rest, line })
    }

    /// A row for each vertex and each face, of words in any number of lines.
    fn parted<'w>(&self, mut words: impl Iterator<Item = &'w str>) -> Vec<String> {
        let mut row = |first: Option<&'w str>, count: usize| -> Option<String> {
            let row: Vec<&str> = first.into_iter().chain(words.by_ref().take(count)).collect();
            (!row.is_empty()).then(|| row.join(" "))
        };
        let numbers = self.keyword.numbers();
        let mut rows: Vec<String> = (0..self.vertices).map_while(|_| row(None, numbers)).collect();
        for _ in 0..self.faces {
            let Some(count) = row(None, 1) else { break };
            let corners = row(None, count.parse().unwrap_or(0)).unwrap_or_default();
            rows.push(format!("{count} {corners}"));
        }
        rows
    }
}

/// What the first word of a file says.
#[derive(Clone, Copy, Default)]
struct Keyword {
    is_binary: bool,
    has_normals: bool,
    has_colours: bool,
    has_texture: bool,
    /// Four coordinates, or as many as the file says.
    has_other_space: bool,
}

impl Keyword {
    /// The keyword, in either case, and what follows it on the line; `None` if the line does not begin so. Counts may
    /// follow at once, as in some collections.
    fn of(line: &str) -> Option<(Self, &str)> {
        let line = line.trim_start();
        let at = line.get(..7.min(line.len())).unwrap_or_default().to_ascii_uppercase().find("OFF")?;
        let (variant, word, rest) = (&line[..at], &line[at..at + 3], &line[at + 3..]);
        // All of it small, it does not tell normals (N) from a number of dimensions (n), which are rare.
        let is_small = word == "off";
        let variant = if is_small { variant.to_ascii_uppercase() } else { variant.to_owned() };
        let is_known = variant.chars().all(|c| "STCN4n".contains(c));
        let ends = rest.chars().next().is_none_or(|c| c.is_whitespace() || c.is_ascii_digit());
        let keyword = Self {
            is_binary: rest.trim_start().to_ascii_uppercase().starts_with("BINARY"),
            has_normals: variant.contains('N'),
            has_colours: variant.contains('C'),
            has_texture: variant.contains("ST"),
            has_other_space: variant.contains(['4', 'n']),
        };
        (is_known && ends).then_some((keyword, rest))
    }

    /// Numbers of a vertex.
    fn numbers(self) -> usize {
        3 + 3 * usize::from(self.has_normals)
            + 4 * usize::from(self.has_colours)
            + 2 * usize::from(self.has_texture)
    }
}

/// Lines that say something, without comments.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> + Clone {
    numbered_lines(text)
        .map(|(n, line)| (n, line.split('#').next().unwrap_or_default()))
        .filter(|(_, line)| !line.trim().is_empty())
}
