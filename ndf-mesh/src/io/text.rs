//! Lines and numbers of text formats.

use std::borrow::Cow;

/// How much of a file is looked at to recognise it.
const SNIFFED: usize = 4096;

/// A file without the mark that editors put before UTF-8.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// The beginning of a file as text.
pub(super) fn beginning(bytes: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(&bytes[..bytes.len().min(SNIFFED)])
}

/// Whether the beginning of a file holds a byte no text has.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    bytes.iter().take(SNIFFED).any(|&b| b == 0)
}

/// Lines with their numbers, from 1. Lines end with `\n`, `\r\n` or, in files without any `\n`, with `\r`.
pub(super) fn numbered_lines(text: &str) -> impl Iterator<Item = (usize, &str)> + Clone {
    let end = if text.contains('\n') { '\n' } else { '\r' };
    text.split(end).enumerate().map(|(i, line)| (i + 1, line))
}

/// The first three numbers of a sequence of words.
pub(super) fn three_numbers<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<[f64; 3]> {
    let mut next = || words.next()?.parse().ok();
    Some([next()?, next()?, next()?])
}
