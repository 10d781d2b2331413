//! What a command gives back: figures and text, or the sentence that says why not.

use std::fmt;
use std::io::{self, Write};
use std::path::Path;

pub use ndf::text::{grouped, printable, readable};
use ndf_mesh::SelfIntersections;
use ndf_mesh::io::{check_folder, format_to_write};
use serde_json::{Map, Value};

/// How often a mesh passes through itself: counting ends where there are enough.
pub fn passes(pairs: u64) -> String {
    let at_least = if pairs < SelfIntersections::ENOUGH { "" } else { "at least " };
    format!("{at_least}{}", grouped(pairs as usize))
}

/// The result of a command, as an object and as a summary for readers.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// The figures, printed with `--json`.
    pub json: Map<String, Value>,
    /// A short summary, printed without; lines end with `\n`.
    pub text: String,
}

impl Outcome {
    /// An outcome of these figures; `json` must be an object: commands write it as one in their source.
    ///
    /// # Panics
    /// If `json` is not an object.
    pub fn new(json: Value, text: impl Into<String>) -> Self {
        let Value::Object(json) = json else { panic!("an outcome is a JSON object, not {json}") };
        Self { json, text: text.into() }
    }

    /// Writes the object on one line, or the text. A reader that has gone away is no error.
    ///
    /// # Errors
    /// If the stream cannot be written for another reason.
    pub fn write(&self, as_json: bool, out: &mut dyn Write) -> io::Result<()> {
        let written = if as_json {
            serde_json::to_writer(&mut *out, &self.json).map_err(io::Error::from).and_then(|()| writeln!(out))
        } else {
            out.write_all(printable(&self.text).as_bytes())
        };
        match written.and_then(|()| out.flush()) {
            Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            other => other,
        }
    }
}

/// Why a command failed: one sentence that says which file, what is wrong and what to try.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure(String);

impl Failure {
    /// A failure with this message.
    pub fn new(message: impl Into<String>) -> Self {
        Self(message.into())
    }

    /// The same failure with advice after it.
    #[must_use]
    pub fn try_instead(self, advice: &str) -> Self {
        Self(format!("{}; {advice}", self.0))
    }
}

impl fmt::Display for Failure {
    /// On one line and without control characters, whatever the message was made of.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words: Vec<&str> = self.0.split_whitespace().collect();
        f.write_str(&printable(&words.join(" ")))
    }
}

impl<E: std::error::Error> From<E> for Failure {
    fn from(error: E) -> Self {
        Self(error.to_string())
    }
}

/// Whether a file can be expected to appear at `path`; asked before work that takes long.
///
/// # Errors
/// If `path` is a folder, or the folder it names is not there or takes no files.
pub fn check_place(path: &Path) -> Result<(), Failure> {
    let name = path.display();
    if path.is_dir() {
        return Err(Failure::new(format!("cannot write {name}: it is a folder")));
    }
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
            Err(Failure::new(format!("cannot write {name}: there is no folder {}", folder.display())))
        }
        // A pipe or a device is written in its place.
        _ if path.exists() && !path.is_file() => Ok(()),
        _ => check_folder(path).map_err(|e| Failure::new(format!("cannot write {name}: {e}"))),
    }
}

/// As [`check_place`], and whether the file that is there is none of these inputs.
///
/// # Errors
/// As [`check_place`], or if it is an input.
pub fn check_output(path: &Path, inputs: &[&Path]) -> Result<(), Failure> {
    check_place(path)?;
    if inputs.iter().any(|input| is_same(path, input)) {
        return Err(Failure::new(format!("{} is an input and would be overwritten", path.display()))
            .try_instead("give the output another name"));
    }
    Ok(())
}

/// Whether a model may have this name: not one that says mesh.
///
/// # Errors
/// If it ends as those of meshes do.
pub fn check_model_name(path: &Path) -> Result<(), Failure> {
    if format_to_write(path).is_err() {
        return Ok(());
    }
    let failure = Failure::new(format!("{} is the name of a mesh, and a model is written", path.display()));
    Err(failure.try_instead("end it in .ndf; `ndf extract` makes a mesh of it"))
}

/// Whether two names are those of one file that is there. One that is not a file, as a device, may have several uses.
pub fn is_same(a: &Path, b: &Path) -> bool {
    let file = |path: &Path| path.canonicalize().ok().filter(|path| path.is_file());
    a == b && !a.exists() || file(a).is_some_and(|a| file(b) == Some(a))
}

/// A table of labels and values with the values aligned, each line indented by two.
pub fn table(rows: &[(&str, String)]) -> String {
    let width = rows.iter().map(|(label, _)| label.chars().count()).max().unwrap_or(0);
    rows.iter().map(|(label, value)| format!("  {label:<width$}  {value}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Closed;

    impl Write for Closed {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(io::ErrorKind::BrokenPipe.into())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_closed_reader_is_no_error() {
        let outcome = Outcome::new(serde_json::json!({"a": 1}), "a is 1\n");
        assert!(outcome.write(true, &mut Closed).is_ok());
        assert!(outcome.write(false, &mut Closed).is_ok());
        let mut out = Vec::new();
        outcome.write(true, &mut out).unwrap();
        assert_eq!(out, b"{\"a\":1}\n");
    }

    #[test]
    fn failures_are_one_line() {
        assert_eq!(Failure::new("\u{1b}[2J").to_string(), "\\u{1b}[2J");
        assert_eq!(Failure::new("two\n lines").try_instead("try one").to_string(), "two lines; try one");
    }
}
