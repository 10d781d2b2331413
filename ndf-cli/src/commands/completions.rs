//! `ndf completions`: what shells need to complete the command line.

use clap::Args;
use clap_complete::Shell;

use crate::command;
use crate::context::Context;
use crate::output::{Failure, Outcome};
use serde_json::json;

/// Arguments of `ndf completions`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The shell. `ndf completions bash > ~/.local/share/bash-completion/completions/ndf` installs them for bash.
    #[arg(value_enum)]
    shell: Shell,
}

/// The script for a shell.
///
/// # Errors
/// If it is not text.
pub fn run(arguments: &Arguments, _: &Context) -> Result<Outcome, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command(), "ndf", &mut script);
    let script = String::from_utf8(script)?;
    Ok(Outcome::new(json!({"shell": arguments.shell.to_string(), "script": script}), script))
}
