//! How a text parts its numbers, and writes them.

/// Rows that are looked at to tell.
const SAMPLED: usize = 100;

/// How numbers are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Dialect {
    /// A comma stands before decimals; otherwise it parts numbers.
    decimal_comma: bool,
}

impl Dialect {
    /// A comma is one of decimals where every row has three fields or more, parted by blanks, tabs or semicolons, that are
    /// whole numbers or hold one comma between digits.
    pub(super) fn of(text: &str) -> Self {
        let without = Self { decimal_comma: true };
        let mut has_comma = false;
        let mut sampled = 0;
        for (_, row) in rows(text) {
            // Titles and names.
            if sampled == 0 && !row.starts_with(|c: char| c.is_ascii_digit() || "+-.,".contains(c)) {
                continue;
            }
            let fields: Vec<&str> = row.split(is_separator).filter(|field| !field.is_empty()).collect();
            // A count.
            if fields.len() == 1 && fields[0].parse::<u64>().is_ok() {
                continue;
            }
            let fits = |field: &&str| {
                let is_whole = field.parse::<i64>().is_ok();
                is_whole || (field.contains(',') && without.number(field).is_some())
            };
            if fields.len() < 3 || !fields.iter().all(fits) {
                return Self::default();
            }
            has_comma |= fields.iter().any(|field| field.contains(','));
            sampled += 1;
            if sampled == SAMPLED {
                break;
            }
        }
        Self { decimal_comma: has_comma }
    }

    /// A number, in quotes perhaps; `None` if it is none.
    pub(super) fn number(self, word: &str) -> Option<f64> {
        let word = word.trim_matches(['"', '\'']);
        if !self.decimal_comma {
            return word.parse().ok();
        }
        match word.split_once(',') {
            Some((_, decimals)) if !decimals.starts_with(|c: char| c.is_ascii_digit()) => None,
            Some(_) if word.contains('.') => None,
            _ => word.replacen(',', ".", 1).parse().ok(),
        }
    }

    /// The numbers of a row; `None` if it holds anything else.
    pub(super) fn numbers(self, row: &str) -> Option<Vec<f64>> {
        let parts = |c: char| is_separator(c) || (c == ',' && !self.decimal_comma);
        let words = row.split(parts).filter(|word| !word.is_empty());
        words.map(|word| self.number(word)).collect()
    }

    /// The fields of a row by their places: empty ones count where something other than blanks parts them.
    pub(super) fn fields(self, row: &str) -> Vec<&str> {
        let firm = [';', ',', '\t'].into_iter().filter(|&c| c != ',' || !self.decimal_comma);
        match firm.into_iter().find(|&c| row.contains(c)) {
            Some(separator) => {
                row.split(separator).map(|field| field.trim().trim_matches(['"', '\''])).collect()
            }
            None => row.split_whitespace().collect(),
        }
    }
}

fn is_separator(c: char) -> bool {
    c.is_whitespace() || c == ';'
}

/// Lines that say something, with their numbers from 1.
pub(super) fn rows(text: &str) -> impl Iterator<Item = (usize, &str)> {
    lines(text).filter(|(_, line)| !line.is_empty() && comment(line).is_none())
}

/// All lines, with their numbers from 1.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let end = if text.contains('\n') { '\n' } else { '\r' };
    text.split(end).enumerate().map(|(i, line)| (i + 1, line.trim()))
}

/// What a comment says; `None` if a line is none.
pub(super) fn comment(line: &str) -> Option<&str> {
    ["#", "//", "%"].iter().find_map(|mark| line.strip_prefix(mark))
}
