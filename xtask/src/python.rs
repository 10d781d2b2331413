//! The Python package: builds the wheel, installs it in an environment of its own, and tests what is installed.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::shell::{self, root, target};

/// A wheel must not be larger, in bytes.
const MAX_WHEEL: u64 = 8_000_000;

/// What the tests need.
const NEEDED: &[&str] =
    &["maturin>=1.9.4,<2", "numpy", "pytest", "mypy", "scipy", "tqdm", "trimesh", "meshio"];

/// What the tests compare with; where one has no wheel for this Python, its tests are skipped.
const COMPARED: &[&str] =
    &["libigl", "potpourri3d", "robust_laplacian", "pygeodesic", "pyvista", "polyscope"];

/// Builds the wheel into `target/wheels`, and runs the tests, mypy and stubtest on it.
pub(crate) fn run() -> Result<(), String> {
    let environment = environment()?;
    let wheel = wheel(&environment)?;
    shell::run(pip(&environment).args(["--force-reinstall", "--no-deps"]).arg(&wheel))?;
    let package = root().join("ndf-py");
    let module = |arguments: &[&str]| {
        let mut command = Command::new(program(&environment, "python"));
        command.arg("-m").args(arguments).current_dir(&package);
        shell::run(&mut command)
    };
    module(&["pytest", "-q"])?;
    module(&["mypy", "tests"])?;
    module(&["mypy.stubtest", "ndf", "--mypy-config-file", "pyproject.toml"])
}

/// Measures the package beside others, and writes the table of `docs/python.md`.
pub(crate) fn compare() -> Result<(), String> {
    let environment = environment()?;
    let script = root().join("ndf-py/benchmarks/compare.py");
    shell::run(Command::new(program(&environment, "python")).arg(script).current_dir(root()))
}

/// Writes the pages of `docs/python` and their pictures.
pub(crate) fn pages() -> Result<(), String> {
    let environment = environment()?;
    let script = root().join("ndf-py/pages/make.py");
    shell::run(
        Command::new(program(&environment, "python")).arg(script).arg("--pictures").current_dir(root()),
    )
}

/// A virtual environment with what the tests need.
fn environment() -> Result<PathBuf, String> {
    let environment = target().join("python");
    if !environment.join("pyvenv.cfg").exists() {
        let python = std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
        let made = shell::run(Command::new(python).args(["-m", "venv"]).arg(&environment));
        made.map_err(|error| format!("{error}; Python 3.10 or newer is needed, PYTHON names it"))?;
    }
    shell::run(pip(&environment).args(NEEDED)).map_err(|error| {
        format!("{error}; pip needs an index or a folder of wheels (PIP_INDEX_URL, PIP_FIND_LINKS)")
    })?;
    for package in COMPARED {
        if shell::run(pip(&environment).args(["--only-binary", ":all:", package])).is_err() {
            eprintln!("xtask: {package} is not to be had; the tests that compare with it are skipped");
        }
    }
    Ok(environment)
}

/// Builds the wheel, the only one in its folder.
fn wheel(environment: &Path) -> Result<PathBuf, String> {
    let wheels = root().join("target/wheels");
    if wheels.exists() {
        std::fs::remove_dir_all(&wheels).map_err(|e| format!("{}: {e}", wheels.display()))?;
    }
    let mut maturin = Command::new(program(environment, "maturin"));
    maturin.args([
        "build",
        "--profile",
        "wheel",
        "--locked",
        "--manifest-path",
        "ndf-py/Cargo.toml",
        "--out",
    ]);
    shell::run(maturin.arg(&wheels).current_dir(root()))?;
    let found = std::fs::read_dir(&wheels).ok().into_iter().flatten().flatten().map(|entry| entry.path());
    let wheel = found.into_iter().next().ok_or("maturin left no wheel")?;
    let bytes = std::fs::metadata(&wheel).map_err(|e| format!("{}: {e}", wheel.display()))?.len();
    eprintln!("xtask: {}: {bytes} bytes", wheel.display());
    if bytes > MAX_WHEEL {
        return Err(format!("the wheel has {bytes} bytes, more than {MAX_WHEEL}"));
    }
    Ok(wheel)
}

/// `pip install` in an environment.
fn pip(environment: &Path) -> Command {
    let mut command = Command::new(program(environment, "python"));
    command.args(["-m", "pip", "install", "--quiet"]);
    command
}

/// A program of an environment.
fn program(environment: &Path, name: &str) -> PathBuf {
    environment.join(if cfg!(windows) { "Scripts" } else { "bin" }).join(name)
}
