//! The check before a change lands.

use crate::shell::{self, cargo};
use crate::{arrows, paths, python, readmes, web};

pub(crate) fn run() -> Result<(), String> {
    shell::run(&mut cargo(&["fmt", "--all", "--check"]))?;
    arrows::run()?;
    paths::check()?;
    readmes::run(true)?;
    shell::run(&mut cargo(&[
        "clippy",
        "--workspace",
        "--all-targets",
        "--all-features",
        "--locked",
        "--",
        "-D",
        "warnings",
    ]))?;
    // The README's command; doc tests are among these.
    shell::run(&mut cargo(&["test", "--workspace", "--release", "--locked"]))?;
    python::run()?;
    web::test()?;
    shell::run(
        cargo(&["doc", "--workspace", "--no-deps", "--all-features", "--locked"])
            .env("RUSTDOCFLAGS", "-D warnings"),
    )?;
    // That every crate can be published; building them from their packages is left to the release.
    shell::run(&mut cargo(&[
        "publish",
        "--workspace",
        "--dry-run",
        "--no-verify",
        "--allow-dirty",
        "--locked",
        "--quiet",
    ]))
}
