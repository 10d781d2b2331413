//! Which columns are places and normals.
//!
//! Names decide where there are some. Where there are none, the first three columns are the place (those after it, if the
//! first is the number of the row), and three further ones
//! are a normal only if they look like one: of length 1, or all of one length, or of any length if they point to both sides
//! along two axes at least. Colours and other numbers that are never negative do not.

use std::path::Path;

use ndf_core::DVec3;

use super::dialect::{Dialect, comment, lines};
use super::{FileDefect, HEADINGS};

/// How far the length of a normal that is written with few decimals is from 1.
const UNIT: f64 = 0.02;
/// The share of normals that must be of that length.
const MOST: f64 = 0.9;

/// Where a row has what is read of it, from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Columns {
    pub(super) position: [usize; 3],
    pub(super) normal: Option<[usize; 3]>,
}

/// Names of which x, y or z is none.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the columns {names} do not say which are x, y and z")]
pub struct UnknownColumns {
    /// The names.
    pub names: String,
}

impl From<UnknownColumns> for FileDefect {
    fn from(unknown: UnknownColumns) -> Self {
        Self::missing(format!(
            "{unknown}; say so: --columns x,y,z, with any other word for a column to pass over"
        ))
    }
}

/// Names of places and normals, in small letters and without anything else.
const PLACES: [&[&str]; 3] = [
    &[
        "x",
        "posx",
        "positionx",
        "pointx",
        "points0",
        "xcoord",
        "coordx",
        "px",
        "easting",
        "east",
        "ost",
        "ostwert",
        "rechtswert",
    ],
    &[
        "y",
        "posy",
        "positiony",
        "pointy",
        "points1",
        "ycoord",
        "coordy",
        "py",
        "northing",
        "north",
        "nord",
        "nordwert",
        "hochwert",
    ],
    &[
        "z",
        "posz",
        "positionz",
        "pointz",
        "points2",
        "zcoord",
        "coordz",
        "pz",
        "elevation",
        "height",
        "altitude",
        "elev",
        "höhe",
        "hoehe",
    ],
];
const NORMALS: [&[&str]; 3] = [
    &["nx", "normalx", "xnormal", "normals0", "normal0"],
    &["ny", "normaly", "ynormal", "normals1", "normal1"],
    &["nz", "normalz", "znormal", "normals2", "normal2"],
];
/// Other names, by which a line is one of names and not a title.
const OTHERS: [&str; 23] = [
    "id",
    "index",
    "name",
    "label",
    "class",
    "classification",
    "time",
    "gpstime",
    "timestamp",
    "intensity",
    "i",
    "r",
    "g",
    "b",
    "red",
    "green",
    "blue",
    "lat",
    "latitude",
    "lon",
    "longitude",
    "nx",
    "range",
];

impl Columns {
    /// By their names; `None` if there are no x, y and z among them.
    fn of(names: &[String]) -> Option<Self> {
        let find = |sets: [&[&str]; 3]| -> Option<[usize; 3]> {
            let of =
                |set: &[&str]| set.iter().find_map(|wanted| names.iter().position(|name| name == wanted));
            Some([of(sets[0])?, of(sets[1])?, of(sets[2])?])
        };
        Some(Self { position: find(PLACES)?, normal: find(NORMALS) })
    }

    /// By the names that the caller gives to the columns, in order.
    pub(super) fn asked(names: &[String]) -> Result<Self, UnknownColumns> {
        let plain: Vec<String> = names.iter().map(|name| plain(name)).collect();
        Self::of(&plain).ok_or_else(|| UnknownColumns { names: names.join(", ") })
    }

    /// Behind one more column.
    fn shifted(self) -> Self {
        let by_one = |places: [usize; 3]| places.map(|place| place + 1);
        Self { position: by_one(self.position), normal: self.normal.map(by_one) }
    }

    fn last(&self) -> usize {
        self.position.into_iter().chain(self.normal.into_iter().flatten()).max().unwrap_or(0)
    }
}

/// Columns by the names in a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Named {
    pub(super) columns: Columns,
    /// The line.
    pub(super) line: usize,
}

/// Whether rows have one field more than the heading, and begin with their names or numbers: so R and pandas write them.
fn has_row_names(text: &str, heading: usize, dialect: &Dialect, names: usize) -> bool {
    let rows: Vec<Vec<&str>> = super::dialect::rows(text)
        .filter(|(line, _)| *line > heading)
        .take(COUNTED)
        .map(|(_, row)| dialect.fields(row))
        .collect();
    let firsts: Vec<Option<f64>> =
        rows.iter().map(|row| row.first().and_then(|&word| dialect.number(word))).collect();
    let is_counted = firsts.windows(2).all(|pair| matches!(pair, [Some(a), Some(b)] if b - a == 1.0));
    rows.len() > 1
        && rows.iter().all(|row| row.len() == names + 1)
        && (is_counted || firsts.iter().all(Option::is_none))
}

/// A name in small letters, without its unit and what is neither letter nor digit.
fn plain(name: &str) -> String {
    let name = name.split(['[', '(']).next().unwrap_or_default();
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The columns that are named before the first row of numbers: in a heading, or in a comment.
///
/// # Errors
/// If a heading names columns, and x, y and z are not among them.
pub(super) fn named_in(text: &str, dialect: &Dialect) -> Result<Option<Named>, UnknownColumns> {
    let mut found = None;
    let mut heading: Option<(Vec<String>, &str)> = None;
    let mut headings = 0;
    for (number, line) in lines(text).filter(|(_, line)| !line.trim().is_empty()) {
        let named = comment(line).unwrap_or(line);
        let is_comment = comment(line).is_some();
        // Commas part names even where numbers have them for decimals.
        let parts = if dialect.fields(named).len() > 1 { *dialect } else { Dialect::default() };
        let fields = parts.fields(named);
        if is_comment || (headings < HEADINGS && dialect.is_heading(&fields)) {
            headings += usize::from(!is_comment);
            let names: Vec<String> = fields.iter().map(|name| plain(name)).collect();
            match Columns::of(&names) {
                Some(columns) => {
                    let row_names = !is_comment && has_row_names(text, number, dialect, names.len());
                    let columns = if row_names { columns.shifted() } else { columns };
                    found = Some((Named { columns, line: number }, names));
                }
                None if !is_comment => heading = Some((names, line)),
                None => {}
            }
            continue;
        }
        if fields.len() == 1 {
            continue;
        }
        // The first row.
        let count = fields.len();
        // A sentence may hold the words x, y and z as well.
        let fits = |columns: &Columns, names: &[String]| {
            let is_whole = names.len() == count || columns.position[0] < 2 || names[0] == "point3did";
            is_whole && columns.last() < count
        };
        if let Some((named, _)) = found.as_ref().filter(|(named, names)| fits(&named.columns, names)) {
            return Ok(Some(*named));
        }
        if let Some((names, line)) = heading.filter(|(names, _)| names.len() == count && count >= 3)
            && names.iter().any(|name| OTHERS.contains(&name.as_str()))
        {
            return Err(UnknownColumns { names: format!("of the heading ({line})") });
        }
        return Ok(None);
    }
    Ok(None)
}

/// COLMAP's `points3D.txt` without its heading: number, place, colour, error, then pairs of a view and a point in it, so
/// that rows differ in length.
pub(super) fn colmap(text: &str) -> Option<Columns> {
    let dialect = Dialect::default();
    let mut rows = super::dialect::rows(text).take(100).peekable();
    rows.peek()?;
    let is_colmap = rows.all(|(_, row)| {
        let whole = |word: &str| word.parse::<u64>().ok();
        let words: Vec<&str> = row.split_whitespace().collect();
        words.len() >= 10
            && words.len().is_multiple_of(2)
            && whole(words[0]).is_some()
            && words[1..4].iter().all(|word| whole(word).is_none() && dialect.number(word).is_some())
            && words[4..7].iter().all(|word| whole(word).is_some_and(|byte| byte < 256))
            && words[8..].iter().all(|word| whole(word).is_some())
    });
    is_colmap.then_some(Columns { position: [1, 2, 3], normal: None })
}

/// What the end of a file's name says of columns without names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// Colours follow the place.
    Colours,
    /// Normals follow the place, of any length.
    Normals,
    Unknown,
}

impl Meaning {
    pub(super) fn of(path: &Path) -> Self {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        match extension.as_str() {
            "xyzrgb" | "xyzrgba" | "xyzc" => Self::Colours,
            "pwn" | "xyzn" | "npts" => Self::Normals,
            _ => Self::Unknown,
        }
    }
}

/// Fewest rows whose first column is told to be their number.
const COUNTED: usize = 10;

/// Whether the first of four columns or more is the number of the row: no surface has its points one step after another.
/// Numbers from 0 or 1 leave none out; others are whole, and go one way or are all from one to another, before a place that is not whole.
pub(super) fn is_numbered(values: &[f64], columns: usize) -> bool {
    let first = values.first().copied().unwrap_or(f64::NAN);
    let rows = || values.chunks(columns);
    if columns < 4 || rows().len() < COUNTED {
        return false;
    }
    let counts =
        (first == 0.0 || first == 1.0) && rows().enumerate().all(|(i, row)| row[0] == first + i as f64);
    let goes_one_way = || {
        let is_whole = |row: &[f64]| row[0] >= 0.0 && row[0].fract() == 0.0;
        let pairs = || rows().zip(rows().skip(1));
        let grows = || pairs().all(|(row, next)| row[0] < next[0]);
        rows().all(is_whole) && (grows() || pairs().all(|(row, next)| row[0] > next[0]))
    };
    // All numbers from the first on, in any order.
    let are_shuffled = || {
        let mut numbers: Vec<f64> = rows().map(|row| row[0]).collect();
        numbers.sort_unstable_by(f64::total_cmp);
        numbers[0] >= 0.0
            && numbers[0].fract() == 0.0
            && numbers.windows(2).all(|pair| pair[1] == pair[0] + 1.0)
    };
    let has_fractions = |column: usize| rows().any(|row| row[column].fract() != 0.0);
    counts || ((1..4).all(has_fractions) && (goes_one_way() || are_shuffled()))
}

/// Whether a first row has the numbers of its columns, 0, 1, 2 and so on, perhaps behind an empty field, and those after it
/// are not whole: so pandas writes columns that have no names.
pub(super) fn numbers_columns(first: &[&str], mut others: impl Iterator<Item = Vec<f64>>) -> bool {
    let numbers = first.strip_prefix(&[""]).unwrap_or(first);
    let counts = numbers.iter().enumerate().all(|(i, number)| number.parse() == Ok(i));
    let is_broken = |row: Vec<f64>| row.iter().any(|number| number.fract() != 0.0);
    numbers.len() >= 3 && counts && others.next().is_some_and(is_broken) && others.all(is_broken)
}

/// What was found about normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Normals {
    /// The column of the first component.
    pub(super) first: Option<usize>,
    /// Whether six columns end with vectors that are neither normals nor colours.
    pub(super) is_unclear: bool,
}

/// Where normals begin: after the place, or after the place and a colour or other numbers.
pub(super) fn normals(
    columns: usize,
    rows: usize,
    vector: &impl Fn(usize, usize) -> DVec3,
    meaning: Meaning,
) -> Normals {
    let all = |first: usize| (0..rows).map(move |row| vector(row, first));
    let usual: &[usize] = match columns {
        6 => &[3],
        9.. => &[3, 6],
        _ => &[],
    };
    if meaning == Meaning::Colours {
        return Normals::default();
    }
    let found = |first| Normals { first: Some(first), is_unclear: false };
    if meaning == Meaning::Normals && columns == 6 {
        return found(3);
    }
    let is_normal = |first: usize, looks: Looks| {
        looks == Looks::Unit
            || (matches!(looks, Looks::OneLength | Looks::ToAllSides) && usual.contains(&first))
    };
    let mut looks =
        (3..(columns + 1).saturating_sub(3).max(3)).map(|first| (first, Looks::of(&|| all(first))));
    match looks.find(|&(first, looks)| is_normal(first, looks)) {
        Some((first, _)) => found(first),
        None => Normals { first: None, is_unclear: columns == 6 && Looks::of(&|| all(3)) == Looks::Else },
    }
}

/// What three columns look like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Looks {
    /// Vectors of length 1, of which some are negative.
    Unit,
    /// Vectors of one length, or one vector of length 1.
    OneLength,
    /// Vectors of any length that point to both sides along two axes at least.
    ToAllSides,
    /// Numbers that are never negative: colours, deviations, counts.
    NeverNegative,
    Else,
}

impl Looks {
    fn of<I: Iterator<Item = DVec3>>(all: &dyn Fn() -> I) -> Self {
        let finite = || all().filter(|v| v.is_finite());
        let Some(first) = finite().next() else { return Self::Else };
        let count = finite().count() as f64;
        let share = |holds: &dyn Fn(DVec3) -> bool| finite().filter(|&v| holds(v)).count() as f64 / count;
        let is_unit = share(&|v| (v.length() - 1.0).abs() <= UNIT) >= MOST;
        let is_one_length =
            first.length() > 0.0 && finite().all(|v| (v.length() / first.length() - 1.0).abs() < 1e-3);
        let has_negative = finite().any(|v| v.min_element() < 0.0);
        let has_both = |axis: &usize| finite().any(|v| v[*axis] < 0.0) && finite().any(|v| v[*axis] > 0.0);
        let two_sided = (0..3).filter(has_both).count();
        let is_constant = finite().all(|v| v == first);
        let is_like_bytes = || finite().all(|v| v.max_element() <= 255.0 && v.fract() == DVec3::ZERO);
        let is_at_most_one = || finite().all(|v| v.max_element() <= 1.0);
        match (has_negative, is_unit) {
            (true, true) => Self::Unit,
            (true, false) if is_one_length => Self::OneLength,
            (true, false) if two_sided >= 2 => Self::ToAllSides,
            (true, false) => Self::Else,
            // Normals along one axis, of a plane; a colour of that kind is rare.
            (false, true) if is_constant => Self::OneLength,
            (false, _) if is_one_length && !is_like_bytes() && !is_at_most_one() => Self::OneLength,
            (false, _) => Self::NeverNegative,
        }
    }
}
