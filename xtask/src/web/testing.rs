//! Tests of the npm package and the page, and their measurements.

use std::path::PathBuf;
use std::process::Command;

use super::{build_package, node, packages, sources, toolchain};
use crate::shell::{self, cargo, target};

/// Where Debian puts it.
const CHROMIUM: &str = "/usr/bin/chromium";

/// Tests the npm package in Node and the committed page in Chromium. Where there is no compiler for WebAssembly or no browser to be
/// had, what needs it is skipped, and it is said why; what fails fails.
pub(crate) fn test() -> Result<(), String> {
    sources::check()?;
    packages()?;
    let program = program()?;
    let run = |file: &str| shell::run(node().args(["--test", file]).env("NDF_PROGRAM", &program));
    match toolchain::rustc() {
        Ok(_) => {
            build_package()?;
            run("test/package.test.mjs")?;
        }
        Err(error) => eprintln!("xtask: the npm package is not tested: {error}"),
    }
    match chromium() {
        Ok(browser) => {
            let test = ["--test", "test/page.test.mjs"];
            shell::run(node().args(test).env("NDF_PROGRAM", &program).env("CHROMIUM", browser))
        }
        Err(error) => {
            eprintln!("xtask: the page is not tested: {error}");
            Ok(())
        }
    }
}

/// Measures sizes and seconds, and writes the table of `docs/web.md`.
pub(crate) fn measure(arguments: &[&str]) -> Result<(), String> {
    build_package()?;
    let mut measuring = node();
    measuring.arg("measure.mjs").args(arguments).env("NDF_PROGRAM", program()?);
    if let Ok(browser) = chromium() {
        measuring.env("CHROMIUM", browser);
    }
    shell::run(&mut measuring)
}

/// The program, whose numbers are compared with.
fn program() -> Result<PathBuf, String> {
    shell::run(&mut cargo(&["build", "--release", "--locked", "--package", "ndf-cli"]))?;
    Ok(target().join("release").join(format!("ndf{}", std::env::consts::EXE_SUFFIX)))
}

/// A browser: what `CHROMIUM` names, or Debian's, which is installed where it is missing.
fn chromium() -> Result<PathBuf, String> {
    if let Some(named) = std::env::var_os("CHROMIUM") {
        return Ok(named.into());
    }
    let usual = PathBuf::from(CHROMIUM);
    if !usual.exists() {
        let install = ["-qq", "install", "--yes", "--no-install-recommends", "chromium"];
        shell::run(Command::new("apt-get").args(install))
            .map_err(|error| format!("{error}; CHROMIUM names a browser that is elsewhere"))?;
    }
    Ok(usual)
}
