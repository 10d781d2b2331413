//! The check before a change lands.

use crate::arrows;
use crate::shell::{self, cargo};

pub(crate) fn run() -> Result<(), String> {
    shell::run(&mut cargo(&["fmt", "--all", "--check"]))?;
    arrows::check()?;
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
    shell::run(
        cargo(&["doc", "--workspace", "--no-deps", "--all-features", "--locked"])
            .env("RUSTDOCFLAGS", "-D warnings"),
    )
}
