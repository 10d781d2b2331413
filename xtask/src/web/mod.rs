//! The page of `ndf view` and the npm package: WebAssembly, JavaScript, tests and measurements.

mod sources;
mod testing;
mod toolchain;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::shell::{self, cargo, root, target};

pub(crate) use testing::{measure, test};

/// The target that browsers run.
const TARGET: &str = "wasm32-unknown-unknown";

/// The folder of the JavaScript.
fn folder() -> PathBuf {
    root().join("web")
}

/// Builds the npm package and the page, and notes what the page was built from.
pub(crate) fn build() -> Result<(), String> {
    webassembly()?;
    packages()?;
    shell::run(node().arg("build.mjs"))?;
    sources::note()
}

/// Builds the npm package only.
fn build_package() -> Result<(), String> {
    webassembly()?;
    packages()?;
    shell::run(node().args(["build.mjs", "lib"]))
}

/// Compiles the crate ndf-web and the one that unpacks the page, and puts them and their JavaScript into `web/src/wasm`.
fn webassembly() -> Result<(), String> {
    // With this crate type alone the crates below need no code of their own before all of it is optimised together.
    let library = ["rustc", "--package", "ndf-web", "--lib", "--crate-type", "cdylib", "--profile", "web"];
    compile(&library, &target().join("web"), "web/ndf_web.wasm")?;
    let unpacking = ["build", "--manifest-path", "web/unpack/Cargo.toml", "--release"];
    compile(&unpacking, &target().join("web-unpack"), "release/ndf_unpack.wasm")
}

/// Compiles one crate into a folder, where the module is then, and writes its JavaScript.
fn compile(command: &[&str], build: &Path, module: &str) -> Result<(), String> {
    let mut compiling = cargo(command);
    compiling
        .args(["--locked", "--target", TARGET])
        .env("CARGO_TARGET_DIR", build)
        .env("RUSTFLAGS", flags()?);
    if let Some(rustc) = toolchain::rustc()? {
        compiling.env("RUSTC", rustc);
    }
    shell::run(&mut compiling)?;
    let module = build.join(TARGET).join(module);
    let mut glue = cargo(&["run", "--quiet", "--locked", "--manifest-path", "web/bindgen/Cargo.toml", "--"]);
    glue.arg(module).arg(folder().join("src/wasm")).env("CARGO_TARGET_DIR", target().join("web-bindgen"));
    shell::run(&mut glue)
}

/// Vectors of 128 bits, which every browser has; and no path of this machine in the messages of panics.
fn flags() -> Result<String, String> {
    let home = std::env::var_os("CARGO_HOME")
        .map(PathBuf::from)
        .or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    let registry = home.ok_or("neither CARGO_HOME nor a home folder is known")?.join("registry/src");
    let folders = fs::read_dir(&registry).into_iter().flatten().flatten().map(|entry| entry.path());
    let remaps = folders.map(|folder| format!(" --remap-path-prefix={}=registry", folder.display()));
    Ok(format!("-Ctarget-feature=+simd128{}", remaps.collect::<String>()))
}

/// Installs the npm packages that are locked, unless they are there.
fn packages() -> Result<(), String> {
    let time = |file: &str| fs::metadata(folder().join(file)).and_then(|meta| meta.modified()).ok();
    if time("node_modules/.package-lock.json") > time("package-lock.json") {
        return Ok(());
    }
    let npm = if cfg!(windows) { "npm.cmd" } else { "npm" };
    // No package needs to run anything to be installed.
    let install = ["ci", "--ignore-scripts", "--no-audit", "--no-fund"];
    shell::run(Command::new(npm).args(install).current_dir(folder()))
        .map_err(|error| format!("{error}; Node 20 or newer with npm is needed"))
}

/// Node, in the folder of the JavaScript.
fn node() -> Command {
    let mut command = Command::new("node");
    command.current_dir(folder());
    command
}
