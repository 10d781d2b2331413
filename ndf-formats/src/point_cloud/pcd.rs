//! PCD, the format of the Point Cloud Library: a header of words, then text, binary records, or LZF of the same sorted
//! by field.
//!
//! The crate `pcd-rs` reads these files too, but allocates what a header announces, up to eight gigabytes, before it
//! looks at the data.

use ndf_core::DVec3;

use super::{FileDefect, Parsed, RawCloud, lzf};

/// Whether a file begins as PCD files do.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    let beginning = String::from_utf8_lossy(&bytes[..bytes.len().min(512)]).into_owned();
    let mut lines = beginning.lines().map(str::trim);
    match lines.find(|line| !line.is_empty() && !line.starts_with('#')) {
        Some(line) => matches!(line.split_whitespace().next(), Some("VERSION" | "FIELDS" | "COLUMNS")),
        None => beginning.starts_with("# .PCD"),
    }
}

/// What the header says.
struct Header {
    fields: Vec<Field>,
    points: usize,
    data: Data,
    /// Where the data begins.
    body: usize,
}

#[derive(Clone, Copy, PartialEq)]
enum Data {
    Ascii,
    Binary,
    Compressed,
}

/// A field of a point, of `count` numbers.
struct Field {
    name: String,
    size: usize,
    kind: u8,
    count: usize,
}

/// Reads a PCD file: the fields `x`, `y`, `z` and `normal_x`, `normal_y`, `normal_z`.
pub(super) fn read(bytes: &[u8]) -> Parsed {
    let header = Header::read(bytes)?;
    let body = &bytes[header.body..];
    let find = |name: &str| header.fields.iter().position(|f| f.name == name && f.count > 0);
    let all = |names: [&str; 3]| -> Option<[usize; 3]> {
        Some([find(names[0])?, find(names[1])?, find(names[2])?])
    };
    let axes = all(["x", "y", "z"]).ok_or_else(|| {
        let names: Vec<&str> = header.fields.iter().map(|f| f.name.as_str()).collect();
        FileDefect::missing(format!("it needs the fields x, y and z, but has {}", names.join(", ")))
    })?;
    let normals = all(["normal_x", "normal_y", "normal_z"]);
    let columns: Vec<usize> = axes.into_iter().chain(normals.into_iter().flatten()).collect();
    let rows = match header.data {
        Data::Ascii => header.text_rows(body, &columns)?,
        Data::Binary => {
            let record = header.record_size();
            header.fits(body.len(), record)?;
            let at = |point: usize, field: usize| point * record + header.offset(field);
            header.binary_rows(body, &columns, at)
        }
        Data::Compressed => {
            let expanded = header.expanded(body)?;
            // All of the first field, then all of the second, …
            let at = |point: usize, field: usize| {
                header.offset(field) * header.points
                    + point * header.fields[field].size * header.fields[field].count
            };
            header.binary_rows(&expanded, &columns, at)
        }
    };
    let vectors = |first: usize| {
        rows.chunks_exact(columns.len()).map(|row| DVec3::from_slice(&row[first..first + 3])).collect()
    };
    Ok(RawCloud { positions: vectors(0), normals: normals.map(|_| vectors(3)), ..RawCloud::default() })
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Self, FileDefect> {
        let mut start = 0;
        let (mut names, mut sizes, mut kinds, mut counts) = (vec![], vec![], vec![], vec![]);
        let (mut width, mut height, mut points) = (None, None, None);
        let cut_off = || FileDefect::truncated("the header ends without DATA; the file is cut off");
        loop {
            let rest = &bytes[start..];
            let end = rest.iter().position(|&b| b == b'\n').ok_or_else(cut_off)?;
            start += end + 1;
            let line = std::str::from_utf8(&rest[..end]);
            let line = line.map_err(|_| FileDefect::value("the header is not text"))?;
            let mut words = line.split_whitespace();
            let keyword = words.next().unwrap_or("#");
            let words: Vec<&str> = words.collect();
            let number = || {
                let word = words.first().and_then(|w| w.parse::<usize>().ok());
                word.ok_or_else(|| FileDefect::value(format!("{keyword} needs a number")))
            };
            match keyword {
                "FIELDS" | "COLUMNS" => names = words,
                "SIZE" => sizes = words,
                "TYPE" => kinds = words,
                "COUNT" => counts = words,
                "WIDTH" => width = Some(number()?),
                "HEIGHT" => height = Some(number()?),
                "POINTS" => points = Some(number()?),
                "DATA" => {
                    let data = match words.first().copied() {
                        Some("ascii") => Data::Ascii,
                        Some("binary") => Data::Binary,
                        Some("binary_compressed") => Data::Compressed,
                        other => {
                            let text = format!("DATA {} is not known", other.unwrap_or("without a word"));
                            return Err(FileDefect::unsupported(text));
                        }
                    };
                    let fields = Field::all(&names, &sizes, &kinds, &counts)?;
                    let area = || width?.checked_mul(height.unwrap_or(1));
                    let neither = || FileDefect::missing("it says neither POINTS nor WIDTH");
                    let points = points.or_else(area).ok_or_else(neither)?;
                    return Ok(Self { fields, points, data, body: start });
                }
                "VERSION" | "VIEWPOINT" => {}
                _ if keyword.starts_with('#') => {}
                _ => return Err(FileDefect::value(format!("{keyword} is not a keyword of a PCD header"))),
            }
        }
    }

    fn record_size(&self) -> usize {
        self.offset(self.fields.len())
    }

    /// Bytes of a record before a field.
    fn offset(&self, field: usize) -> usize {
        self.fields[..field].iter().map(|f| f.size * f.count).sum()
    }

    /// Whether as many points as announced fit the bytes there are.
    fn fits(&self, available: usize, record: usize) -> Result<(), FileDefect> {
        let points = self.points;
        match points.checked_mul(record.max(1)) {
            Some(needed) if needed <= available => Ok(()),
            _ => {
                let text = format!(
                    "it announces {points} points of at least {record} bytes, but {available} bytes follow the header; the \
                     file is cut off or its header wrong"
                );
                Err(FileDefect::truncated(text))
            }
        }
    }

    fn expanded(&self, body: &[u8]) -> Result<Vec<u8>, FileDefect> {
        let number = |at: usize| {
            let four = body.get(at..at + 4).and_then(|b| b.try_into().ok());
            let four = four.map(|b| u32::from_le_bytes(b) as usize);
            four.ok_or_else(|| FileDefect::truncated("it ends before the compressed data"))
        };
        let (compressed, size) = (number(0)?, number(4)?);
        self.fits(size, self.record_size())?;
        let data = body.get(8..).and_then(|rest| rest.get(..compressed)).ok_or_else(|| {
            let left = body.len() - 8;
            FileDefect::truncated(format!(
                "it announces {compressed} compressed bytes, but {left} are left; the file is cut off"
            ))
        })?;
        lzf::expand(data, size)
    }

    fn binary_rows(&self, data: &[u8], columns: &[usize], at: impl Fn(usize, usize) -> usize) -> Vec<f64> {
        let value = |point: usize, column: usize| self.fields[column].number(&data[at(point, column)..]);
        (0..self.points)
            .flat_map(|point| columns.iter().map(move |&c| (point, c)))
            .map(|(p, c)| value(p, c))
            .collect()
    }

    fn text_rows(&self, body: &[u8], columns: &[usize]) -> Result<Vec<f64>, FileDefect> {
        self.fits(body.len() + 1, 2 * self.fields.len())?;
        let text = String::from_utf8_lossy(body);
        let width: usize = self.fields.iter().map(|f| f.count).sum();
        let word_of = |column: usize| self.fields[..column].iter().map(|f| f.count).sum::<usize>();
        let mut rows = Vec::with_capacity(self.points * columns.len());
        let lines = text.lines().filter(|line| !line.trim().is_empty());
        let mut read = 0;
        for (point, line) in lines.take(self.points).enumerate() {
            let words: Vec<&str> = line.split_whitespace().collect();
            if words.len() != width {
                let text = format!("point {point} has {} numbers instead of {width}", words.len());
                return Err(FileDefect::mismatch(text));
            }
            for &column in columns {
                let word = words[word_of(column)];
                let wrong = |_| FileDefect::value(format!("point {point}: {word} is not a number"));
                rows.push(word.parse().map_err(wrong)?);
            }
            read += 1;
        }
        if read < self.points {
            let expected = self.points as u64;
            return Err(FileDefect::EndsEarly { items: "points", expected, found: read as u64 });
        }
        Ok(rows)
    }
}

impl Field {
    fn all(names: &[&str], sizes: &[&str], kinds: &[&str], counts: &[&str]) -> Result<Vec<Self>, FileDefect> {
        let n = names.len();
        if n == 0 || sizes.len() != n || kinds.len() != n || !(counts.is_empty() || counts.len() == n) {
            let text = "FIELDS, SIZE, TYPE and COUNT do not agree in number";
            return Err(FileDefect::mismatch(text));
        }
        let field = |i: usize| {
            let count = counts.get(i).map_or(Some(1), |c| c.parse().ok()).filter(|&c: &usize| c <= 1 << 20);
            let (size, kind) = (sizes[i].parse::<usize>().ok(), kinds[i].as_bytes());
            match (size, kind, count) {
                (Some(size @ (1 | 2 | 4 | 8)), &[kind @ (b'I' | b'U')], Some(count))
                | (Some(size @ (4 | 8)), &[kind @ b'F'], Some(count)) => {
                    Ok(Self { name: names[i].to_owned(), size, kind, count })
                }
                _ => {
                    let text = format!("the field {} has a SIZE, TYPE or COUNT that is not known", names[i]);
                    Err(FileDefect::unsupported(text))
                }
            }
        };
        (0..n).map(field).collect()
    }

    /// The number at the beginning of some bytes, of which there are enough.
    fn number(&self, bytes: &[u8]) -> f64 {
        fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
            bytes[..N].try_into().expect("N bytes make an array of N")
        }
        match (self.kind, self.size) {
            (b'F', 4) => f32::from_le_bytes(first(bytes)).into(),
            (b'F', _) => f64::from_le_bytes(first(bytes)),
            (b'I', 1) => i8::from_le_bytes(first(bytes)).into(),
            (b'I', 2) => i16::from_le_bytes(first(bytes)).into(),
            (b'I', 4) => i32::from_le_bytes(first(bytes)).into(),
            (b'I', _) => i64::from_le_bytes(first(bytes)) as f64,
            (_, 1) => u8::from_le_bytes(first(bytes)).into(),
            (_, 2) => u16::from_le_bytes(first(bytes)).into(),
            (_, 4) => u32::from_le_bytes(first(bytes)).into(),
            (_, _) => u64::from_le_bytes(first(bytes)) as f64,
        }
    }
}
