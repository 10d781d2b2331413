//! Why items failed, with messages that differ in names and numbers alone taken together.

use std::collections::HashMap;

use super::super::rows::{Row, Status};

/// Examples of a reason that are kept.
const EXAMPLES: usize = 3;

/// Several items that failed alike.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Reason {
    /// How they ended.
    pub status: Status,
    /// Their message, with `…` for names and `N` for numbers.
    pub message: String,
    /// How many there are.
    pub count: usize,
    /// The ids of the first.
    pub examples: Vec<String>,
}

/// The reasons of rows that are not ok, the most frequent first.
pub(super) fn reasons<'a>(rows: impl Iterator<Item = &'a Row>) -> Vec<Reason> {
    let mut places = HashMap::new();
    let mut reasons: Vec<Reason> = Vec::new();
    for row in rows.filter(|row| row.status != Status::Ok) {
        let message = general(row.message.as_deref().unwrap_or_default(), &row.input);
        let place = *places.entry((row.status, message.clone())).or_insert(reasons.len());
        if place == reasons.len() {
            reasons.push(Reason { status: row.status, message, count: 0, examples: Vec::new() });
        }
        let reason = &mut reasons[place];
        reason.count += 1;
        if reason.examples.len() < EXAMPLES {
            reason.examples.push(row.id.clone());
        }
    }
    // Stable, so that reasons of the same count stay in the order of the items.
    reasons.sort_by_key(|reason| std::cmp::Reverse(reason.count));
    reasons
}

/// A message without what is of its input alone.
fn general(message: &str, input: &str) -> String {
    let message = if input.is_empty() { message.to_owned() } else { message.replace(input, "…") };
    let words = message.split(' ').map(|word| if word.contains('/') { path(word) } else { numbers(word) });
    words.collect::<Vec<_>>().join(" ")
}

/// A path as `…`, with the punctuation after it.
fn path(word: &str) -> String {
    let end = word.trim_end_matches([':', ';', ',', '.', ')']).len();
    format!("…{}", &word[end..])
}

/// Every number as `N`.
fn numbers(word: &str) -> String {
    let mut general = String::new();
    let mut is_number = false;
    for c in word.chars() {
        let goes_on = c.is_ascii_digit() || is_number && ",.".contains(c);
        if goes_on && !is_number {
            general.push('N');
        } else if !goes_on {
            general.push(c);
        }
        is_number = goes_on;
    }
    general
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_numbers_are_no_reasons() {
        for (message, input, expected) in [
            ("d/a b.obj: no faces", "d/a b.obj", "…: no faces"),
            ("vertex 3,001 lies beyond 1.5 m", "", "vertex N lies beyond N m"),
            ("cannot write out/x.ply: it is a folder", "in/a.obj", "cannot write …: it is a folder"),
            ("took longer than 0.5 s (--timeout)", "", "took longer than N s (--timeout)"),
        ] {
            assert_eq!(general(message, input), expected);
        }
    }
}
