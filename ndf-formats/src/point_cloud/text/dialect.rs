//! How a text parts its numbers, and writes them.

/// Rows that are looked at to tell.
pub(super) const SAMPLED: usize = 100;
/// Fewest rows by which groups of digits are told from three decimals.
const ENOUGH: usize = 10;

/// How numbers are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Dialect {
    /// `1234.5`; commas part numbers.
    #[default]
    Plain,
    /// `1234,5` or `1.234,5`: a comma stands before decimals, points may group digits by three.
    DecimalComma,
    /// `1,234.5`: commas group digits by three, and blanks, tabs or semicolons part numbers.
    GroupedByCommas,
}

impl Dialect {
    /// Commas part numbers, unless every row has three fields or more, parted by blanks, tabs or semicolons, that are
    /// numbers with decimal commas, or numbers with commas between groups of three digits before a decimal point. Numbers
    /// that may be both (`1,234`) have groups if their column has numbers below 1,000 too, without a comma: decimals of which
    /// none ends in 0 are rarely three for all that have some.
    pub(super) fn of(text: &str) -> Self {
        let mut is_possible = [true; 2];
        let mut is_seen = [false; 2];
        let mut sampled = 0;
        // Of every column, whether it has numbers with commas, and without.
        let mut columns: Vec<[bool; 2]> = Vec::new();
        for (_, row) in rows(text) {
            // Titles and names: with few fields that may be numbers.
            let fields = parted(row);
            let may_be_number =
                |field: &&&str| field.starts_with(|c: char| c.is_ascii_digit() || "+-.,".contains(c));
            if sampled == 0 && fields.iter().filter(may_be_number).count() < 3.min(fields.len()) {
                continue;
            }
            // A count.
            if fields.len() == 1 && fields[0].parse::<u64>().is_ok() {
                continue;
            }
            for (i, dialect) in [Self::DecimalComma, Self::GroupedByCommas].into_iter().enumerate() {
                // Names of points and classes are words.
                let fits = |field: &&str| {
                    let is_word = field.starts_with(char::is_alphabetic);
                    field.is_empty() || is_word || is_unmeasured(field) || dialect.number(field).is_some()
                };
                is_possible[i] &= fields.len() >= 3 && fields.iter().all(fits);
            }
            // A comma, or two points.
            is_seen[0] |= fields.iter().any(|field| field.contains(',') || field.matches('.').count() > 1);
            // A comma and a point, or two commas.
            let marks = |field: &&str| field.contains(',') && field.matches([',', '.']).count() > 1;
            is_seen[1] |= fields.iter().any(marks);
            columns.resize(columns.len().max(fields.len()), [false; 2]);
            for (column, field) in columns.iter_mut().zip(&fields) {
                column[0] |= field.contains(',');
                column[1] |= Self::Plain.number(field).is_some_and(|number| number != 0.0);
            }
            sampled += 1;
            if sampled == SAMPLED || is_possible == [false; 2] {
                break;
            }
        }
        let is_mixed = sampled >= ENOUGH && columns.contains(&[true; 2]);
        match [is_possible[0] && is_seen[0], is_possible[1] && (is_seen[1] || is_mixed)] {
            [true, false] => Self::DecimalComma,
            [_, true] => Self::GroupedByCommas,
            [false, false] => Self::Plain,
        }
    }

    /// A number, in quotes perhaps; `None` if it is none.
    pub(super) fn number(self, word: &str) -> Option<f64> {
        let word = unquoted(word);
        let (groups, decimal): (&[char], char) = match self {
            Self::Plain => (GROUPS, '.'),
            Self::DecimalComma => (&['.', '\'', '’', '_', ' ', '\u{a0}', '\u{202f}'], ','),
            Self::GroupedByCommas => (&[','], '.'),
        };
        let plain = || if self == Self::Plain { word.parse().ok() } else { None };
        let grouped = |group: &char| ungrouped(word, *group, decimal)?.parse().ok();
        let fortran = || {
            let is_exponent = word.ends_with(|c: char| c.is_ascii_digit()) && word.contains(['D', 'd']);
            if is_exponent { word.replace(['D', 'd'], "e").parse().ok() } else { None }
        };
        plain().or_else(|| groups.iter().find_map(grouped)).or_else(fortran)
    }

    /// Whether a line is a title or names columns: no point has so few numbers, and a number that is missing is written
    /// in another way.
    pub(super) fn is_heading(self, fields: &[&str]) -> bool {
        let numbers =
            fields.iter().filter(|field| is_unmeasured(field) || self.number(field).is_some()).count();
        numbers < 3 && 2 * numbers <= fields.len()
    }

    /// Whether a field is a word that is no number, nor stands for one.
    pub(super) fn says_nothing(self, field: &str) -> bool {
        !field.is_empty() && !is_unmeasured(field) && self.number(field).is_none()
    }

    /// The numbers of a row; `None` if it holds anything else.
    pub(super) fn numbers(self, row: &str) -> Option<Vec<f64>> {
        // An empty field between others is a number that is missing; a separator at the end parts nothing.
        let lacks = |separator: char| {
            let mut fields = row.trim_end_matches(|c: char| is_separator(c) || c == ',').split(separator);
            row.contains(separator) && fields.any(|field| field.trim().is_empty())
        };
        let has_gaps = lacks(';') || (self == Self::Plain && lacks(','));
        if has_gaps || self != Self::Plain || row.contains([';', '"', '|']) {
            let mut fields = self.fields(row);
            while fields.last().is_some_and(|field| field.is_empty()) {
                fields.pop();
            }
            let number = |word: &str| {
                if word.is_empty() || is_unmeasured(word) { Some(f64::NAN) } else { self.number(word) }
            };
            return fields.into_iter().map(number).collect();
        }
        let words = row.split(|c: char| is_separator(c) || c == ',').filter(|word| !word.is_empty());
        words.map(|word| if is_unmeasured(word) { Some(f64::NAN) } else { self.number(word) }).collect()
    }

    /// The fields of a row by their places: empty ones count where something other than blanks parts them.
    pub(super) fn fields(self, row: &str) -> Vec<&str> {
        if self == Self::Plain && !row.trim().contains([';', '|']) && row.contains(',') {
            return split(row, ',').map(|field| unquoted(field.trim())).collect();
        }
        parted(row)
    }
}

/// What groups digits by three before a decimal point, but for commas.
const GROUPS: &[char] = &['\'', '’', '_', ' ', '\u{a0}', '\u{202f}'];

fn is_separator(c: char) -> bool {
    c.is_whitespace() || c == ';' || "()[]{}".contains(c)
}

/// The fields of a row in which commas are in numbers: parted by semicolons, bars or tabs, by commas outside of quotes where
/// there are quotes, or by blanks, where numbers may have a comma behind them.
fn parted(row: &str) -> Vec<&str> {
    // A tab at an end parts an empty field only where tabs part the others.
    let firm = [';', '|', '\t'].into_iter().find(|&c| row.trim().contains(c));
    let has_quotes = || row.contains("\",").then_some(',');
    match firm.or_else(has_quotes) {
        Some(separator) => split(row, separator).map(|field| unquoted(field.trim())).collect(),
        None => {
            let mut words: Vec<&str> = row.split_whitespace().collect();
            let last = words.pop();
            // `1,5, 2,5, 3,5`
            let all_behind = words.iter().all(|word| word.ends_with(','));
            let bare = |word: &&'_ str| if all_behind { word.len() - 1 } else { word.len() };
            words.iter_mut().for_each(|word| *word = &word[..bare(word)]);
            words.into_iter().chain(last).map(unquoted).collect()
        }
    }
}

/// The parts of a row between separators that are not within quotes.
fn split(row: &str, separator: char) -> impl Iterator<Item = &str> {
    let mut is_quoted = false;
    row.split(move |c: char| {
        is_quoted ^= c == '"';
        c == separator && !is_quoted
    })
}

/// A word without the quotes around it.
fn unquoted(word: &str) -> &str {
    let inside = |quote: char| word.strip_prefix(quote).and_then(|rest| rest.strip_suffix(quote));
    inside('"').or_else(|| inside('\'')).unwrap_or(word)
}

/// A number without the marks that group its digits by three, with a point before its decimals; `None` if the marks
/// stand anywhere else.
fn ungrouped(word: &str, group: char, decimal: char) -> Option<String> {
    let (whole, decimals) = word.split_once(decimal).map_or((word, None), |(w, d)| (w, Some(d)));
    let mut groups = whole.split(group);
    let first = groups.next().unwrap_or_default();
    let mut number = first.to_owned();
    let is_digits = |text: &str| text.chars().all(|c| c.is_ascii_digit());
    for (i, digits) in groups.enumerate() {
        let leads = first.trim_start_matches(['+', '-']);
        let is_group = digits.len() == 3 && is_digits(digits);
        let may_lead = (1..=3).contains(&leads.len()) && is_digits(leads) && !leads.starts_with('0');
        if !is_group || (i == 0 && !may_lead) {
            return None;
        }
        number.push_str(digits);
    }
    if let Some(decimals) = decimals {
        // Not a comma at the end of a word, which parts numbers.
        if decimals.is_empty() && decimal == ',' || decimals.contains([group, decimal]) {
            return None;
        }
        number.push('.');
        number.push_str(decimals);
    }
    Some(number)
}

/// Whether a field says that nothing was measured.
pub(super) fn is_unmeasured(field: &str) -> bool {
    const WORDS: [&str; 15] = [
        "na",
        "n/a",
        "#n/a",
        "nan",
        "-nan",
        "+nan",
        "null",
        "none",
        "-",
        "--",
        "*",
        "?",
        "-nan(ind)",
        "1.#qnan",
        "-1.#ind",
    ];
    WORDS.iter().any(|word| field.eq_ignore_ascii_case(word))
}

/// Lines that say something, with their numbers from 1.
pub(super) fn rows(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let said = lines(text).filter(|(_, line)| !line.trim().is_empty() && comment(line).is_none());
    said.map(|(number, line)| (number, line.split(" #").next().unwrap_or(line)))
}

/// All lines, with their numbers from 1, ended by LF, CR LF or CR. Tabs at their ends stay: they part empty fields.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let whole = |line: &'_ str| line.strip_suffix('\r').map_or(line.len(), str::len);
    text.split('\n')
        .flat_map(move |line| line[..whole(line)].split('\r'))
        .enumerate()
        .map(|(i, line)| (i + 1, line.trim_matches(' ')))
}

/// What a comment says; `None` if a line is none.
pub(super) fn comment(line: &str) -> Option<&str> {
    ["#", "//", "%"].iter().find_map(|mark| line.trim_start().strip_prefix(mark))
}
