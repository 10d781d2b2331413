//! What the tests of several crates share: the optional folder of real files.
//!
//! `NDF_DATA` names the folder, `../shared/data` beside the workspace unless set. Tests that use it pass without it, and
//! say on the error stream what they skipped.

use std::path::PathBuf;

/// The path of a file or folder of the data folder, or `None`, with a note, where it is not there.
pub fn data_path(name: &str) -> Option<PathBuf> {
    let beside = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data"));
    let path = std::env::var_os("NDF_DATA").map_or_else(beside, PathBuf::from).join(name);
    if !path.exists() {
        eprintln!("skipped: {} is not there (optional data folder, see NDF_DATA)", path.display());
        return None;
    }
    Some(path)
}

/// The contents of a file of the data folder, or `None`, with a note, where it is not there.
pub fn data_file(name: &str) -> Option<Vec<u8>> {
    std::fs::read(data_path(name)?).ok()
}
