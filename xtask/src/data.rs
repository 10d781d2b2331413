//! The meshes, clouds, networks and splats that tables and some tests use: where each comes from, and whether a folder
//! has it.

use std::fs;
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::shell::root;

/// File, bytes, SHA-256, source and licence.
const LIST: &str = include_str!("../data.tsv");

/// The folder that tables and tests use unless another is named.
const FOLDER: &str = "../shared/data";

struct Entry<'a> {
    file: &'a str,
    bytes: u64,
    sha256: &'a str,
    source: &'a str,
    licence: &'a str,
}

/// Lists the files, each with its state in a folder, source and licence.
#[expect(clippy::print_stdout, reason = "the list that was asked for")]
pub(crate) fn run(folder: Option<&str>) -> Result<(), String> {
    let named = std::env::var("NDF_DATA").ok();
    let folder = root().join(folder.or(named.as_deref()).unwrap_or(FOLDER));
    let entries = entries(LIST)?;
    let mut wrong = 0;
    for entry in &entries {
        let state = state(&folder, entry);
        wrong += usize::from(state != "ok");
        println!("{state:8} {}\t{}\t{}", entry.file, entry.source, entry.licence);
    }
    if wrong == 0 {
        Ok(())
    } else {
        Err(format!("{wrong} of {} files are missing or differ in {}", entries.len(), folder.display()))
    }
}

fn entries(list: &str) -> Result<Vec<Entry<'_>>, String> {
    let entry = |line| {
        let [file, bytes, sha256, source, licence] = str::split(line, '\t').collect::<Vec<_>>()[..] else {
            return Err(format!("five columns expected in {line:?}"));
        };
        let bytes = bytes.parse().map_err(|e| format!("{file}: {e}"))?;
        Ok(Entry { file, bytes, sha256, source, licence })
    };
    list.lines().skip(1).map(entry).collect()
}

fn state(folder: &Path, entry: &Entry<'_>) -> &'static str {
    let Ok(content) = fs::read(folder.join(entry.file)) else { return "missing" };
    let digest: String = Sha256::digest(&content).iter().map(|byte| format!("{byte:02x}")).collect();
    if content.len() as u64 == entry.bytes && digest == entry.sha256 { "ok" } else { "differs" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_is_well_formed() {
        let entries = entries(LIST).unwrap();
        assert!(entries.iter().all(|entry| entry.sha256.len() == 64 && !entry.licence.is_empty()));
        let files: Vec<&str> = entries.iter().map(|entry| entry.file).collect();
        assert!(files.iter().enumerate().all(|(i, file)| !files[..i].contains(file)));
    }
}
