//! Whether the page that is committed was built from the sources that are there.

use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::folder;
use crate::shell::root;

/// Crates whose code is no part of the page.
const NO_PART: &[&str] =
    &["experiments", "fuzz", "ndf-baselines", "ndf-cli", "ndf-py", "ndf-testing", "xtask"];

/// The JavaScript's sources, in `web`.
const JAVASCRIPT: &[&str] = &[
    "build.mjs",
    "package-lock.json",
    "tsconfig.json",
    "src",
    "bindgen/src",
    "bindgen/Cargo.lock",
    "unpack",
];

/// Where the hash lies, beside the page.
fn place() -> PathBuf {
    folder().join("dist/sources.sha256")
}

/// Notes what the page was just built from.
pub(super) fn note() -> Result<(), String> {
    fs::write(place(), format!("{}\n", hash()?)).map_err(|e| format!("{}: {e}", place().display()))
}

/// Whether the page was built from these sources.
pub(super) fn check() -> Result<(), String> {
    let noted = fs::read_to_string(place()).map_err(|e| format!("{}: {e}", place().display()))?;
    if noted.trim() == hash()? {
        return Ok(());
    }
    Err("web/dist/view.html was built from other sources; `cargo xtask web` builds it again".into())
}

/// The hash of all sources of the page. Comments and tests do not count: they change nothing in it.
fn hash() -> Result<String, String> {
    let mut files = vec![root().join("Cargo.lock"), root().join("Cargo.toml")];
    let entries = fs::read_dir(root()).map_err(|e| format!("{}: {e}", root().display()))?;
    for folder in entries.flatten().map(|entry| entry.path()).filter(|path| path.join("Cargo.toml").is_file())
    {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.starts_with("ndf") && !NO_PART.contains(&&*name) {
            files.push(folder.join("Cargo.toml"));
            collect(&folder.join("src"), &mut files)?;
        }
    }
    for part in JAVASCRIPT {
        collect(&folder().join(part), &mut files)?;
    }
    let mut named: Vec<(String, PathBuf)> = files.into_iter().map(|file| (name(&file), file)).collect();
    named.sort();
    let mut hash = Sha256::new();
    for (name, file) in named.iter().filter(|(name, _)| !name.starts_with("web/src/wasm/")) {
        let bytes = fs::read(file).map_err(|e| format!("{}: {e}", file.display()))?;
        hash.update(name);
        hash.update([0]);
        for line in
            String::from_utf8_lossy(&bytes).lines().map(str::trim).filter(|line| !line.starts_with("//"))
        {
            hash.update(line);
            hash.update([b'\n']);
        }
        hash.update([0]);
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// The files at a place, tests apart.
fn collect(place: &Path, files: &mut Vec<PathBuf>) -> Result<(), String> {
    if place.file_stem().is_some_and(|stem| stem == "tests" || stem == "samples") {
        return Ok(());
    }
    if place.is_file() {
        files.push(place.to_owned());
        return Ok(());
    }
    let entries = fs::read_dir(place).map_err(|e| format!("{}: {e}", place.display()))?;
    entries.flatten().try_for_each(|entry| collect(&entry.path(), files))
}

/// A path from the root on, alike on all machines.
fn name(file: &Path) -> String {
    file.strip_prefix(root()).unwrap_or(file).to_string_lossy().replace('\\', "/")
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_page_is_built_from_these_sources() {
        super::check().unwrap();
    }
}
