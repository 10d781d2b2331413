//! `ndf man`: pages for `man`.

use std::fs;
use std::path::PathBuf;

use clap::Args;
use ndf_mesh::io::atomic_write;
use serde_json::json;

use crate::command;
use crate::context::Context;
use crate::output::{Failure, Outcome};

/// Arguments of `ndf man`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The folder to write to, which is made if it is not there, such as ~/.local/share/man/man1.
    folder: PathBuf,
}

/// Writes a page for the program and one for every command.
///
/// # Errors
/// If a file cannot be written.
pub fn run(arguments: &Arguments, _: &Context) -> Result<Outcome, Failure> {
    let folder = &arguments.folder;
    let cannot =
        |e: &dyn std::fmt::Display| Failure::new(format!("cannot write to {}: {e}", folder.display()));
    fs::create_dir_all(folder).map_err(|e| cannot(&e))?;
    let mut program = command().disable_help_subcommand(true);
    program.build();
    let mut pages = Vec::new();
    let mut open = vec![program];
    while let Some(command) = open.pop() {
        open.extend(command.get_subcommands().filter(|command| !command.is_hide_set()).cloned());
        let page = clap_mangen::Man::new(command);
        let name = page.get_filename();
        atomic_write(folder.join(&name), |out| page.render(&mut &mut *out)).map_err(|e| cannot(&e))?;
        pages.push(name);
    }
    pages.sort();
    let text = format!("{}: {} pages\n", folder.display(), pages.len());
    Ok(Outcome::new(json!({"folder": folder.display().to_string(), "pages": pages}), text))
}
