//! Lines of numbers: `x y z`, often with a normal, a colour or an intensity after them, as XYZ, PWN, PTS and CSV
//! files have it. No standard says which column is what; the rules are below.

use ndf_core::DVec3;

use super::{FileDefect, Parsed, RawCloud};

/// How much of a file is looked at to recognise it.
const SNIFFED: usize = 4096;

/// Lines at the beginning that may be something else: a title, names of columns.
const HEADINGS: usize = 2;

/// Whether a file begins with lines of three numbers or more, perhaps after headings, a count or comments.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    let beginning = &bytes[..bytes.len().min(SNIFFED)];
    if beginning.contains(&0) {
        return false;
    }
    let text = String::from_utf8_lossy(beginning);
    let mut lines = lines(&text).take(HEADINGS + 2);
    lines.any(|(_, line)| numbers(line).is_some_and(|row| row.len() >= 3))
}

/// Reads lines of numbers. A line that holds a single number, first in the file, is the count of points and checked
/// where it can be.
pub(super) fn read(bytes: &[u8]) -> Parsed {
    let text = String::from_utf8_lossy(bytes);
    let mut count = None;
    let mut columns = 0;
    let mut values: Vec<f64> = Vec::new();
    for (position, (number, line)) in lines(&text).enumerate() {
        let row = numbers(line);
        match row {
            Some(row) if row.len() >= 3 && (columns == 0 || row.len() == columns) => {
                columns = row.len();
                values.extend(row);
            }
            Some(row) if row.len() == 1 && columns == 0 && count.is_none() => count = Some(row[0]),
            _ if columns == 0 && position < HEADINGS => {}
            Some(row) if columns > 0 => {
                let found = row.len();
                let problem = format!("it has {found} numbers, but the lines before have {columns}").into();
                return Err(FileDefect::Syntax { line: number, problem });
            }
            _ => {
                let problem = "it holds something other than numbers".into();
                return Err(FileDefect::Syntax { line: number, problem });
            }
        }
    }
    if columns == 0 {
        return Err(FileDefect::missing("it has no line of three numbers"));
    }
    let rows = values.len() / columns;
    let vector = |row: usize, first: usize| DVec3::from_slice(&values[row * columns + first..][..3]);
    match count {
        // The original PWN: all places, then all normals.
        Some(count) if columns == 3 && rows as f64 == 2.0 * count => {
            let half = rows / 2;
            let positions = (0..half).map(|i| vector(i, 0)).collect();
            return Ok(RawCloud { positions, normals: Some((half..rows).map(|i| vector(i, 0)).collect()) });
        }
        Some(count) if rows as f64 != count => {
            let text = format!("it announces {count} points, but holds {rows}; the file is cut off");
            return Err(FileDefect::truncated(text));
        }
        _ => {}
    }
    let positions = (0..rows).map(|i| vector(i, 0)).collect();
    let normals = normal_column(columns, rows, vector);
    Ok(RawCloud { positions, normals: normals.map(|first| (0..rows).map(|i| vector(i, first)).collect()) })
}

/// Where normals begin: after the place, or after the place and a colour; a triple that looks like colours is none.
fn normal_column(columns: usize, rows: usize, vector: impl Fn(usize, usize) -> DVec3) -> Option<usize> {
    let candidates: &[usize] = match columns {
        6 => &[3],
        9.. => &[3, 6],
        _ => &[],
    };
    let is_colour = |first: usize| {
        let like_bytes =
            |v: DVec3| v.min_element() >= 0.0 && v.max_element() <= 255.0 && v.fract() == DVec3::ZERO;
        let all = || (0..rows).map(|i| vector(i, first));
        // Normals along the axes are whole numbers as well, but none above 1.
        all().all(like_bytes) && all().any(|v| v.max_element() > 1.0)
    };
    candidates.iter().copied().find(|&first| !is_colour(first))
}

/// Lines that say something, with their numbers from 1.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let end = if text.contains('\n') { '\n' } else { '\r' };
    let numbered = text.split(end).enumerate().map(|(i, line)| (i + 1, line.trim()));
    numbered.filter(|(_, line)| !line.is_empty() && !line.starts_with('#') && !line.starts_with("//"))
}

/// The numbers of a line; `None` if it holds anything else.
fn numbers(line: &str) -> Option<Vec<f64>> {
    let words = line.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty());
    words.map(|word| word.parse().ok()).collect()
}
