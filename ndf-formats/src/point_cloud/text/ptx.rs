//! Leica's PTX: for every scan the sizes of its grid, the place and the axes of the scanner, a transformation, then a line
//! for each ray, `x y z intensity` with a colour perhaps. A ray that met nothing has zeros.

use ndf_core::DVec3;

use super::dialect::{Dialect, rows};
use super::{FileDefect, Parsed, RawCloud};

/// Numbers in the lines before the points.
const HEADER: [usize; 10] = [1, 1, 3, 3, 3, 3, 4, 4, 4, 4];

/// Whether a text begins with such a header.
pub(super) fn recognises(text: &str) -> bool {
    let counts =
        rows(text).take(HEADER.len()).map(|(_, row)| Dialect::default().numbers(row).map(|n| n.len()));
    counts.eq(HEADER.map(Some))
}

/// Reads the points of all scans, in the coordinates that they share.
pub(super) fn read(text: &str) -> Parsed {
    let dialect = Dialect::default();
    let mut rows = rows(text).peekable();
    let mut cloud = RawCloud::default();
    while rows.peek().is_some() {
        let mut header = Vec::new();
        for count in HEADER {
            let (line, row) =
                rows.next().ok_or_else(|| FileDefect::truncated("it ends within the header of a scan"))?;
            let numbers = dialect.numbers(row).filter(|numbers| numbers.len() == count);
            let wrong = || {
                let problem = format!("{count} numbers of the header of a scan are expected").into();
                FileDefect::Syntax { line, problem }
            };
            header.push(numbers.ok_or_else(wrong)?);
        }
        let count = header[0][0] * header[1][0];
        // A point is a row that the matrix is multiplied to; its last row is the way.
        let matrix = |i: usize| DVec3::from_slice(&header[6 + i]);
        let mut found = 0.0;
        while found < count {
            let early = || {
                let text = format!("a scan ends after {found} of {count} points; the file is cut off");
                FileDefect::truncated(text)
            };
            let (line, row) = rows.next().ok_or_else(early)?;
            let numbers = dialect.numbers(row).filter(|numbers| numbers.len() >= 3);
            let wrong = || FileDefect::Syntax { line, problem: "a point needs three numbers".into() };
            let numbers = numbers.ok_or_else(wrong)?;
            let p = DVec3::from_slice(&numbers);
            if p != DVec3::ZERO {
                cloud.positions.push(p.x * matrix(0) + p.y * matrix(1) + p.z * matrix(2) + matrix(3));
            }
            found += 1.0;
        }
    }
    Ok(cloud)
}
