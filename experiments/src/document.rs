//! Tables inside documents, between two lines that mark their place.

use std::fs;
use std::path::Path;

/// The line before a table, which names the command that makes it.
pub(crate) fn begin(command: &str) -> String {
    format!("<!-- table: {command} -->\n")
}

/// The line after a table.
const END: &str = "<!-- end of table -->";

/// Replaces the table of a command in a document by another.
pub(crate) fn replace_table(document: &Path, command: &str, table: &str) -> Result<(), String> {
    let say = |message: &dyn std::fmt::Display| format!("{}: {message}", document.display());
    let text = fs::read_to_string(document).map_err(|e| say(&e))?;
    let begin = begin(command);
    let (before, rest) =
        text.split_once(&begin).ok_or_else(|| say(&format!("no line {:?}", begin.trim_end())))?;
    let (_, after) = rest.split_once(END).ok_or_else(|| say(&"the table has no end"))?;
    fs::write(document, format!("{before}{begin}{table}{END}{after}")).map_err(|e| say(&e))
}
