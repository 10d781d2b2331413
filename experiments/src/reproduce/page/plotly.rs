//! The library that draws in three dimensions: `plotly.js-gl3d-dist-min` of npm, MIT licence.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The package, with the version that the page was made for.
const PACKAGE: &str = "plotly.js-gl3d-dist-min@4.1.1";
const SCRIPT: &str = "plotly-gl3d.min.js";
const LICENSE: &str = "LICENSE";

/// The script, and the notice that must stay with it.
pub(super) struct Plotly {
    pub(super) script: String,
    pub(super) license: String,
}

impl Plotly {
    /// Takes both from a folder, or from the cache, into which npm puts them where they are not there.
    pub(super) fn find(folder: Option<&Path>, cache: &Path) -> Result<Self, String> {
        let kept = cache.join("plotly");
        let folder = folder.unwrap_or(&kept);
        if folder == kept && !kept.join(SCRIPT).exists() {
            fetch(&kept)?;
        }
        let read = |name: &str| {
            let file = folder.join(name);
            fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))
        };
        let script = read(SCRIPT)?;
        if script.contains("</script") {
            return Err(format!("{}: it would end the script of the page", folder.join(SCRIPT).display()));
        }
        Ok(Self { script, license: read(LICENSE)? })
    }
}

/// Has npm download the package, and unpacks it.
fn fetch(folder: &PathBuf) -> Result<(), String> {
    fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let packed = run(Command::new("npm").args(["pack", "--silent", PACKAGE]).current_dir(folder))?;
    let archive = packed.lines().last().unwrap_or_default().trim().to_owned();
    run(Command::new("tar").args(["xzf", &archive, "--strip-components=1"]).current_dir(folder))?;
    Ok(())
}

fn run(command: &mut Command) -> Result<String, String> {
    let hint = "name a folder with plotly-gl3d.min.js and LICENSE by --plotly";
    let output = command.output().map_err(|e| format!("{:?}: {e}; {hint}", command.get_program()))?;
    if !output.status.success() {
        return Err(format!("{:?}: {}; {hint}", command.get_program(), output.status));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
