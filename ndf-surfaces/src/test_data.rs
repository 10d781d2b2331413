//! Files of the optional data folder: `NDF_DATA`, or `../shared/data` beside the workspace.

use std::path::PathBuf;

/// Contents of a file, or `None` with a note where it is not there.
pub(crate) fn data_file(name: &str) -> Option<Vec<u8>> {
    let beside = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data"));
    let path = std::env::var_os("NDF_DATA").map_or_else(beside, PathBuf::from).join(name);
    let contents = std::fs::read(&path);
    if contents.is_err() {
        eprintln!("skipped: {} is not there (optional data folder, see NDF_DATA)", path.display());
    }
    contents.ok()
}
