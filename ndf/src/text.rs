//! Numbers for readers.

/// A number with four significant digits.
pub fn readable(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return x.to_string();
    }
    let digits = 3 - x.abs().log10().floor() as i32;
    match digits {
        -3..=7 => format!("{x:.*}", digits.max(0) as usize),
        _ => format!("{x:.3e}"),
    }
}

/// A count with its digits in groups of three.
pub fn grouped(n: usize) -> String {
    let digits = n.to_string();
    let mut out = String::with_capacity(digits.len() * 4 / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// A text that may come from a file as a terminal can show it: control characters other than line ends are escaped.
pub fn printable(text: &str) -> std::borrow::Cow<'_, str> {
    let is_shown = |c: char| !c.is_control() || c == '\n';
    if text.chars().all(is_shown) {
        return text.into();
    }
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if is_shown(c) { out.push(c) } else { out.extend(c.escape_default()) }
    }
    out.into()
}

/// What a mesh without faces is.
pub(crate) fn without_faces(vertices: usize) -> &'static str {
    if vertices > 0 { "is a point set without faces" } else { "is an empty mesh" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped() {
        assert_eq!(printable("\u{1b}[31mred\u{7}, ä\n\u{9b}2J"), "\\u{1b}[31mred\\u{7}, ä\n\\u{9b}2J");
        assert!(matches!(printable("plain"), std::borrow::Cow::Borrowed(_)));
    }

    #[test]
    fn numbers_are_readable() {
        assert_eq!(
            [0.0, 1.0, 12.345678, 123456.0, 1e-9].map(readable),
            ["0", "1.000", "12.35", "123456", "1.000e-9"]
        );
        assert_eq!([0, 999, 1000, 1234567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
    }
}
