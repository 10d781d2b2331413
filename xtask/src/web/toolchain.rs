//! A compiler for WebAssembly.
//!
//! Where rustup has added the target there is nothing to do. On Debian, where it may not be reached, the package `rustc-web`
//! serves: it is unpacked, not installed; the standard library is compiled once from its own sources, and linked by the
//! linker that rustup's toolchain has.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::TARGET;
use crate::shell::{self, output, target};

/// The packages: the compiler, its libraries and the sources of the standard library, all of one version.
const COMPILER: &str = "rustc-web";
const LIBRARY: &str = "libstd-rust-web-dev";
const SOURCES: &str = "rust-web-src";

/// The compiler to use, where it is not the one of the workspace.
pub(super) fn rustc() -> Result<Option<PathBuf>, String> {
    let usual = PathBuf::from(output(Command::new("rustc").args(["--print", "sysroot"]))?);
    if usual.join("lib/rustlib").join(TARGET).join("lib").is_dir() {
        return Ok(None);
    }
    let folder =
        std::env::var_os("NDF_WASM_TOOLCHAIN").map_or_else(|| target().join("wasm-toolchain"), PathBuf::from);
    let rustc = folder.join("bin/rustc");
    if !folder.join("complete").exists() {
        eprintln!("xtask: the toolchain has no {TARGET}; taking Debian's {COMPILER}");
        make(&folder, &usual)
            .map_err(|error| format!("{error}; `rustup target add {TARGET}` does without"))?;
        write(&folder.join("complete"), "")?;
    }
    Ok(Some(rustc))
}

fn make(folder: &Path, usual: &Path) -> Result<(), String> {
    if folder.exists() {
        fs::remove_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    unpack(folder)?;
    let bin = folder.join("bin");
    create(&bin)?;
    let rustc = bin.join("rustc");
    write(
        &rustc,
        "#!/bin/sh\nroot=$(cd \"$(dirname \"$0\")/../usr\" && pwd)\n\
         export LD_LIBRARY_PATH=\"$root/lib/x86_64-linux-gnu${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}\"\n\
         exec \"$root/bin/rustc\" \"$@\"\n",
    )?;
    shell::run(Command::new("chmod").arg("+x").arg(&rustc))?;
    // Rustc looks for the linker beside its own libraries.
    let linkers = |root: &Path| root.join("lib/rustlib/x86_64-unknown-linux-gnu/bin");
    let ours = linkers(&folder.join("usr"));
    create(&ours)?;
    link(&linkers(usual).join("rust-lld"), &ours.join("rust-lld")).map_err(|e| format!("rust-lld: {e}"))?;
    compile_library(folder, &rustc)
}

#[cfg(unix)]
fn link(from: &Path, to: &Path) -> io::Result<()> {
    std::os::unix::fs::symlink(from, to)
}

#[cfg(not(unix))]
fn link(from: &Path, to: &Path) -> io::Result<()> {
    fs::copy(from, to).map(drop)
}

/// Downloads the packages and takes out of them what is needed.
fn unpack(folder: &Path) -> Result<(), String> {
    let packages = folder.join("packages");
    create(&packages)?;
    shell::run(Command::new("apt-get").args(["-qq", "update"]))?;
    let shared = dependency(LIBRARY, "libstd-rust-web-")?;
    let llvm = dependency(&shared, "libllvm")?;
    let names = [COMPILER, LIBRARY, SOURCES, &*shared, &*llvm];
    let mut download = Command::new("apt-get");
    download.args(["-qq", "-o", "APT::Sandbox::User=root", "download"]).args(names).current_dir(&packages);
    shell::run(&mut download)?;
    let files = fs::read_dir(&packages).map_err(|e| format!("{}: {e}", packages.display()))?;
    for file in files.flatten().map(|entry| entry.path()) {
        shell::run(Command::new("dpkg").arg("-x").arg(&file).arg(folder))?;
    }
    fs::remove_dir_all(&packages).map_err(|e| format!("{}: {e}", packages.display()))
}

/// The package that another depends on whose name begins so.
fn dependency(package: &str, beginning: &str) -> Result<String, String> {
    let listed = output(Command::new("apt-cache").args(["depends", package]))?;
    let mut names = listed.lines().filter_map(|line| line.trim().strip_prefix("Depends: "));
    let found = names.find(|name| name.starts_with(beginning));
    found.map(str::to_owned).ok_or_else(|| format!("{package} depends on no {beginning}…"))
}

/// Compiles the standard library as its own build does: what is unstable is its own, and its crates are told apart from
/// those of others.
fn compile_library(folder: &Path, rustc: &Path) -> Result<(), String> {
    let sources = folder.join("usr/src");
    let versions = fs::read_dir(&sources).map_err(|e| format!("{}: {e}", sources.display()))?;
    let library =
        versions.flatten().map(|entry| entry.path().join("library/sysroot")).find(|path| path.is_dir());
    let library = library.ok_or_else(|| format!("{SOURCES} has no sources of the standard library"))?;
    let build = folder.join("library");
    let mut compile = Command::new("cargo");
    compile
        .args(["build", "--quiet", "--locked", "--release", "--target", TARGET])
        .current_dir(&library)
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .env_remove("CARGO_BUILD_TARGET")
        .env("CARGO_PROFILE_RELEASE_DEBUG", "0")
        .env("CARGO_TARGET_DIR", &build)
        .env("RUSTC", rustc)
        .env("RUSTC_BOOTSTRAP", "1")
        .env("RUSTFLAGS", "-Zforce-unstable-if-unmarked -Cembed-bitcode=yes")
        .env("__CARGO_DEFAULT_LIB_METADATA", "ndf");
    shell::run(&mut compile)?;
    let to = folder.join("usr/lib/rustlib").join(TARGET).join("lib");
    create(&to)?;
    let from = build.join(TARGET).join("release/deps");
    let files = fs::read_dir(&from).map_err(|e| format!("{}: {e}", from.display()))?;
    for file in files.flatten().map(|entry| entry.path()) {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.ends_with(".rlib") && !name.starts_with("libsysroot-") {
            fs::copy(&file, to.join(&name)).map_err(|e| format!("{}: {e}", file.display()))?;
        }
    }
    [build, sources].iter().try_for_each(fs::remove_dir_all).map_err(|e| format!("{}: {e}", folder.display()))
}

fn create(folder: &Path) -> Result<(), String> {
    fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))
}

fn write(file: &Path, text: &str) -> Result<(), String> {
    fs::write(file, text).map_err(|e| format!("{}: {e}", file.display()))
}
