//! How this very program is started again, for commands that give each input a process of its own.

use std::ffi::OsString;
use std::io;
use std::process::Command;
use std::sync::OnceLock;

static STARTED: OnceLock<Vec<OsString>> = OnceLock::new();

/// Says which command line starts the program, where the executable of the process is another one, such as an interpreter
/// that has the program as a module. What is said first counts.
pub fn starts_with(command: Vec<OsString>) {
    let _ = STARTED.set(command);
}

/// A command that starts the program, still without arguments.
///
/// # Errors
/// If the system does not tell which file the process runs.
pub fn command() -> io::Result<Command> {
    match STARTED.get().map(Vec::as_slice) {
        Some([program, arguments @ ..]) => {
            let mut command = Command::new(program);
            command.args(arguments);
            Ok(command)
        }
        _ => std::env::current_exe().map(Command::new),
    }
}
