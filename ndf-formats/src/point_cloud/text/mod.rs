//! Lines of numbers: `x y z`, often with a normal, a colour or an intensity after them, as XYZ, PWN, PTS, CSV and COLMAP's
//! `points3D.txt` have it, and Leica's PTX.
//!
//! No standard says which column is what. In this order: what the caller says, the names in a heading or in a comment
//! before the first row, the layout of COLMAP, and the numbers themselves (see [`columns`]).

mod columns;
mod dialect;
mod ptx;
#[cfg(test)]
mod tests;

use std::path::Path;

use ndf_core::DVec3;
use ndf_mesh::io::beginning_to_sniff;

use super::{CloudFormat, FileDefect, Parsed, RawCloud};
use columns::{Columns, Named};
use dialect::{Dialect, SAMPLED};

pub use columns::UnknownColumns;

/// Lines at the beginning that may be something else: a title, what made the file, names of columns.
const HEADINGS: usize = 20;

/// The format of a text of points: lines of three numbers or more, perhaps after headings, a count or comments.
pub(super) fn recognises(bytes: &[u8]) -> Option<CloudFormat> {
    let beginning = beginning_to_sniff(bytes);
    if beginning.contains(&0) {
        return None;
    }
    let text = String::from_utf8_lossy(beginning);
    let text = text.trim_start_matches('\u{feff}');
    if ptx::recognises(text) {
        return Some(CloudFormat::Ptx);
    }
    let dialect = Dialect::of(text);
    let rows: Vec<Option<usize>> = dialect::rows(text)
        .take(HEADINGS + 2)
        .map(|(_, line)| dialect.numbers(line).map(|numbers| numbers.len()))
        .collect();
    // Behind more than a few headings a single line of numbers does not make a table.
    let has_numbers = |row: &Option<usize>| row.is_some_and(|count| count >= 3);
    let is_table = match rows.iter().position(has_numbers) {
        Some(0..4) => true,
        Some(first) => rows.len() > first + 1 && rows[first..].iter().all(has_numbers),
        None => false,
    };
    let is_named = || columns::named_in(text, &dialect).is_ok_and(|columns| columns.is_some());
    match rows.as_slice() {
        [Some(1), Some(4 | 7), ..] => Some(CloudFormat::Pts),
        _ if is_table || is_named() => Some(CloudFormat::Text),
        _ => None,
    }
}

/// The points of one scan: PTS has a count before each.
struct Scan {
    announced: f64,
    /// The line of the count.
    line: usize,
    /// How many rows there are before its own.
    before: usize,
}

/// Reads lines of numbers. A line that holds a single number, first in the file, is the count of points; where it is,
/// further scans may begin with theirs. Counts are checked.
pub(super) fn read(bytes: &[u8], path: &Path, asked: Option<&[String]>) -> Parsed {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}');
    if ptx::recognises(text) {
        return ptx::read(text);
    }
    let dialect = Dialect::of(text);
    let named = match asked {
        Some(names) => Some(Named { columns: Columns::asked(names)?, line: 0 }),
        None => {
            let colmap = || columns::colmap(text).map(|columns| Named { columns, line: 0 });
            columns::named_in(text, &dialect)?.or_else(colmap)
        }
    };
    match named {
        Some(named) => read_columns(text, &dialect, &named),
        None => read_numbers(text, &dialect, path),
    }
}

/// Reads rows of which the columns are known; others may hold anything, and rows may be of any length beyond.
fn read_columns(text: &str, dialect: &Dialect, Named { columns, line: heading }: &Named) -> Parsed {
    let mut cloud = RawCloud::default();
    let mut normals = Vec::new();
    let mut scans: Vec<Scan> = Vec::new();
    for (position, (line, row)) in dialect::rows(text).enumerate() {
        let fields = dialect.fields(row);
        let rows = cloud.positions.len();
        if let (&[count], true) = (fields.as_slice(), rows == 0 || !scans.is_empty())
            && let Some(announced) = dialect.number(count)
        {
            scans.push(Scan { announced, line, before: rows });
            continue;
        }
        let vector = |places: [usize; 3]| -> Result<DVec3, FileDefect> {
            let mut vector = DVec3::ZERO;
            for (axis, &place) in places.iter().enumerate() {
                let found = fields.len();
                let short = || {
                    let wanted = place + 1;
                    let problem = format!("it has {found} columns, but column {wanted} is needed").into();
                    FileDefect::Syntax { line, problem }
                };
                let word = *fields.get(place).ok_or_else(short)?;
                let no_number = || {
                    let problem = format!("column {} holds {word} instead of a number", place + 1).into();
                    FileDefect::Syntax { line, problem }
                };
                let is_empty = word.is_empty() || dialect::is_unmeasured(word);
                vector[axis] =
                    if is_empty { f64::NAN } else { dialect.number(word).ok_or_else(no_number)? };
            }
            Ok(vector)
        };
        // Before the names are titles, after them may be units.
        let is_heading = match *heading {
            0 => position < HEADINGS && dialect.is_heading(&fields),
            named if line <= named => true,
            _ => position < HEADINGS + 1 && fields.iter().all(|field| dialect.says_nothing(field)),
        };
        if rows == 0 && is_heading {
            continue;
        }
        cloud.positions.push(vector(columns.position)?);
        if let Some(places) = columns.normal {
            normals.push(vector(places)?);
        }
    }
    if cloud.positions.is_empty() {
        return Err(FileDefect::missing("it has no row with numbers in the columns of x, y and z"));
    }
    check_counts(&scans, cloud.positions.len())?;
    cloud.normals = columns.normal.map(|_| normals);
    Ok(cloud)
}

/// Reads rows of numbers about which nothing is said.
fn read_numbers(text: &str, dialect: &Dialect, path: &Path) -> Parsed {
    let mut scans: Vec<Scan> = Vec::new();
    let mut columns = 0;
    let mut values: Vec<f64> = Vec::new();
    let is_numbers_of_columns = |row: &str| {
        let others = dialect::rows(text).skip(1).take(SAMPLED);
        columns::numbers_columns(&dialect.fields(row), others.filter_map(|(_, row)| dialect.numbers(row)))
    };
    for (position, (line, row)) in dialect::rows(text).enumerate() {
        if position == 0 && is_numbers_of_columns(row) {
            continue;
        }
        let mut numbers = dialect.numbers(row);
        // What is missing at the end of a row was announced by the separator before it.
        if let Some(found) = &mut numbers
            && found.len() > 1
            && found.len() < columns
            && dialect.fields(row).len() >= columns
        {
            found.resize(columns, f64::NAN);
        }
        let wrong = |problem: String| FileDefect::Syntax { line, problem: problem.into() };
        match numbers {
            Some(numbers) if numbers.len() >= 3 && (columns == 0 || numbers.len() == columns) => {
                columns = numbers.len();
                values.extend(numbers);
            }
            Some(numbers) if numbers.len() == 1 && (columns == 0 || !scans.is_empty()) => {
                let before = values.len() / columns.max(1);
                scans.push(Scan { announced: numbers[0], line, before });
            }
            _ if columns == 0 && position < HEADINGS && dialect.is_heading(&dialect.fields(row)) => {}
            Some(numbers) if columns > 0 => {
                let found = numbers.len();
                return Err(wrong(format!("it has {found} numbers, but the lines before have {columns}")));
            }
            _ => {
                let problem =
                    "it holds something other than numbers; --columns says which columns are x, y and z";
                return Err(wrong(problem.to_owned()));
            }
        }
    }
    if columns == 0 {
        return Err(FileDefect::missing("it has no line of three numbers"));
    }
    let rows = values.len() / columns;
    let numbered = columns::is_numbered(&values, columns);
    if numbered {
        values = values.chunks(columns).flat_map(|row| &row[1..]).copied().collect();
        columns -= 1;
    }
    let vector = |row: usize, first: usize| DVec3::from_slice(&values[row * columns + first..][..3]);
    let vectors = |rows: std::ops::Range<usize>, first: usize| rows.map(|i| vector(i, first)).collect();
    // The original PWN: all places, then all normals.
    if let [Scan { announced, .. }] = scans.as_slice()
        && columns == 3
        && rows as f64 == 2.0 * announced
    {
        let half = rows / 2;
        let (positions, normals) = (vectors(0..half, 0), Some(vectors(half..rows, 0)));
        return Ok(RawCloud { positions, normals, ..RawCloud::default() });
    }
    check_counts(&scans, rows)?;
    let found = columns::normals(columns, rows, &vector, columns::Meaning::of(path));
    let normals = found.first.map(|first| vectors(0..rows, first));
    Ok(RawCloud {
        positions: vectors(0..rows, 0),
        normals,
        unclear_columns: found.is_unclear,
        numbered,
        ..RawCloud::default()
    })
}

/// Whether every scan has as many points as are announced.
fn check_counts(scans: &[Scan], rows: usize) -> Result<(), FileDefect> {
    for (i, scan) in scans.iter().enumerate() {
        let end = scans.get(i + 1).map_or(rows, |next| next.before);
        let (announced, found) = (scan.announced, end - scan.before);
        let which = if scans.len() > 1 { format!("the scan at line {}", scan.line) } else { "it".to_owned() };
        if (found as f64) < announced {
            let text =
                format!("{which} announces {announced} points, but holds {found}; the file is cut off");
            return Err(FileDefect::truncated(text));
        }
        if (found as f64) > announced {
            let line = scan.line;
            return Err(FileDefect::mismatch(format!(
                "{which} announces {announced} points, but holds {found}; correct the count in line {line}, or take that line out"
            )));
        }
    }
    Ok(())
}
