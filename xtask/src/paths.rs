//! The files and folders that documents name.

use std::fs;
use std::path::{Path, PathBuf};

use crate::shell::root;

/// Endings of files that lie in the repository, where a document names them with a folder.
const ENDINGS: &[&str] = &["rs", "md", "py", "toml", "html", "svg", "png", "csv", "tsv", "ndf"];

/// Checks that documents name only files and folders that exist.
pub(crate) fn check() -> Result<(), String> {
    let mut missing = Vec::new();
    for document in documents()? {
        let text = fs::read_to_string(&document).map_err(|e| format!("{}: {e}", document.display()))?;
        let folder = document.parent().unwrap_or(&document);
        for (number, line) in text.lines().enumerate() {
            let is_missing = |path: &&str| !exists(folder, path);
            for path in links(line).chain(quoted(line)).filter(is_missing) {
                missing.push(format!("{}:{}: {path}", document.display(), number + 1));
            }
        }
    }
    if missing.is_empty() { Ok(()) } else { Err(format!("no such file or folder:\n{}", missing.join("\n"))) }
}

/// The Markdown files of the root, of docs and of the crates.
fn documents() -> Result<Vec<PathBuf>, String> {
    let root = root();
    let list = |folder: &Path| -> Result<Vec<PathBuf>, String> {
        let say = |e: std::io::Error| format!("{}: {e}", folder.display());
        let entries = fs::read_dir(folder).map_err(say)?;
        entries.map(|entry| entry.map(|entry| entry.path()).map_err(say)).collect()
    };
    let mut documents = list(&root)?;
    let folders: Vec<PathBuf> = documents.iter().filter(|path| path.is_dir()).cloned().collect();
    for folder in
        folders.iter().filter(|folder| **folder == root.join("docs") || folder.join("Cargo.toml").exists())
    {
        documents.extend(list(folder)?);
    }
    documents.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    documents.sort();
    Ok(documents)
}

/// Targets of links into the repository.
fn links(line: &str) -> impl Iterator<Item = &str> {
    let targets = line.split("](").skip(1).filter_map(|rest| rest.split([')', '#', ' ']).next());
    targets.filter(|target| !target.is_empty() && !target.contains("://"))
}

/// What stands between backquotes and is the path of a file or, with a slash at its end, of a folder.
fn quoted(line: &str) -> impl Iterator<Item = &str> {
    line.split('`').skip(1).step_by(2).filter(|text| {
        let is_plain = text.chars().all(|c| c.is_ascii_alphanumeric() || "_-./".contains(c));
        let is_path = text.trim_end_matches('/').contains('/') && !text.starts_with(['/', '.']) && is_plain;
        let ending = text.rsplit_once('.').map_or("", |(_, ending)| ending);
        is_path && (text.ends_with('/') || ENDINGS.contains(&ending))
    })
}

/// Whether a path leads from the root or from the folder of a document to a file.
fn exists(folder: &Path, path: &str) -> bool {
    folder.join(path).exists() || root().join(path).exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_told_from_other_words() {
        let line = "see [the format](docs/format.md#base), `ndf-core/src/`, `a/b.rs`, `b/`, `f32/f64`, `--log x/y.md` and [x](https://a.b/c.md)";
        assert_eq!(links(line).collect::<Vec<_>>(), ["docs/format.md"]);
        assert_eq!(quoted(line).collect::<Vec<_>>(), ["ndf-core/src/", "a/b.rs"]);
    }
}
