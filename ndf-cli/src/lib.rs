//! The program `ndf`: a thin composition of the library crates.
//!
//! [`run`] is the whole program: it reads the arguments, calls one of the [commands] and prints what
//! it gives back. Commands print nothing themselves. They return an [`Outcome`], or a
//! [`Failure`] of one sentence; progress and warnings go through their
//! [`Context`] to the error stream.
//!
//! To add a command: a file in `commands/` with its arguments and a function
//! `run(&Arguments, &Context) -> Result<Outcome, Failure>`, and one line each in the enum and the match there. If it takes one
//! input, a recipe in `commands/batch/` lets it have many.

pub mod arguments;
pub mod chart;
pub mod commands;
pub mod context;
pub mod drawn;
pub mod files;
pub mod interrupt;
pub mod itself;
pub mod learning;
pub mod output;
pub mod progress;
pub mod remeshed;
pub mod render;
pub mod report;
pub mod streams;
pub mod triangulation;

use std::ffi::OsString;
use std::io::Write;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};
use ndf_formats::point_cloud::silence_damaged_laz;

use commands::Command;
use context::{Context, Options};
use output::{Failure, Outcome};

/// Neural displacement fields: learn a surface of any representation as a displaced triangle mesh, and
/// compute on it.
#[derive(Debug, Parser)]
#[command(name = "ndf", version, max_term_width = 100, after_help = STREAMS)]
struct Arguments {
    #[command(flatten)]
    options: Options,
    #[command(subcommand)]
    command: Command,
}

/// What the help says last.
const STREAMS: &str =
    "The name - in place of an input is the standard input, and after -o the standard output.";

/// The command line.
pub fn command() -> clap::Command {
    Arguments::command()
}

/// Runs the program with these arguments, the first of which is its name. The exit code is 0 when the work is
/// done, 1 when it failed and 2 when the arguments are wrong.
pub fn run(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> u8 {
    silence_damaged_laz();
    interrupt::listen();
    let parsed = Arguments::try_parse_from(arguments)
        .and_then(|Arguments { options, command }| check(&options, &command).map(|()| (options, command)));
    let (options, command) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => {
            // Help and version are errors to the parser, but not to the caller. A closed stream is nobody's fault.
            let _ = error.print();
            streams::close();
            return if error.use_stderr() { 2 } else { 0 };
        }
    };
    let done = Context::new(options)
        .and_then(|context| command.run(&context).and_then(|done| send(&done, &context)));
    let code = match done {
        Ok(()) => 0,
        Err(failure) => {
            let _ = writeln!(std::io::stderr(), "ndf: {}", streams::named(&failure.to_string()));
            if interrupt::is_tied() && interrupt::is_requested() { interrupt::TIED_CODE } else { 1 }
        }
    };
    streams::close();
    code
}

/// Whether what the parser could not see is right.
fn check(options: &Options, command: &Command) -> Result<(), clap::Error> {
    if options.json && streams::has_output() {
        let message = "--json writes to the standard output, which `-o -` takes; give the output a name\n";
        return Err(clap::Error::raw(ErrorKind::ArgumentConflict, message));
    }
    command.check(options)
}

/// Sends the result to the standard output if it is to go there, and prints what came of it.
fn send(outcome: &Outcome, context: &Context) -> Result<(), Failure> {
    streams::send().map_err(|e| Failure::new(format!("cannot write to the standard output: {e}")))?;
    context.print(outcome)
}
