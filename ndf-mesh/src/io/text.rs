//! Lines and numbers of text formats.

use std::borrow::Cow;

/// How much of a file is looked at to recognise it, after comments.
const SNIFFED: usize = 4096;

/// The longest comments that are passed over to recognise a file.
const MAX_COMMENTS: usize = 1 << 20;

/// A file without the mark that editors put before UTF-8.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// The beginning of a file by which text formats are recognised: comments and empty lines, and 4096 bytes after them.
pub fn beginning_to_sniff(bytes: &[u8]) -> &[u8] {
    let is_comment = |line: &&[u8]| {
        let line = line.trim_ascii();
        line.is_empty() || [&b"#"[..], b"//", b"%"].iter().any(|mark| line.starts_with(mark))
    };
    let start = &bytes[..bytes.len().min(MAX_COMMENTS)];
    let lines = without_mark(start).split_inclusive(|&byte| byte == b'\n' || byte == b'\r');
    let comments: usize = lines.take_while(is_comment).map(<[u8]>::len).sum();
    &bytes[..bytes.len().min(comments + SNIFFED)]
}

/// The beginning of a file as text.
pub(super) fn beginning(bytes: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(beginning_to_sniff(bytes))
}

/// Whether the beginning of a file holds a byte no text has.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    beginning_to_sniff(bytes).contains(&0)
}

/// Lines with their numbers, from 1. Lines end with `\n`, `\r\n` or `\r`.
pub(super) fn numbered_lines(text: &str) -> impl Iterator<Item = (usize, &str)> + Clone {
    let end_of = |line: &str| line.strip_suffix('\r').map_or(line.len(), str::len);
    let lines = text.split('\n').flat_map(move |line| line[..end_of(line)].split('\r'));
    lines.enumerate().map(|(i, line)| (i + 1, line))
}

/// The first three numbers of a sequence of words.
pub(super) fn three_numbers<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<[f64; 3]> {
    let mut next = || words.next()?.parse().ok();
    Some([next()?, next()?, next()?])
}
