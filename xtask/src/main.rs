//! Development tasks. `cargo xtask ci` is the check before a change lands.

mod arrows;
mod ci;
mod representations;
mod shell;
mod table;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;

/// Development tasks of ndf.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
enum Task {
    /// Everything that must hold before a change lands, cheapest first
    Ci,
    /// Check that crates depend on each other only along the arrows of ARCHITECTURE.md
    Arrows,
    /// Fit meshes with the default preset and write the table of the README
    Table {
        /// The folder with the meshes
        #[arg(long, default_value = "../shared/data/mesh")]
        data: PathBuf,
    },
    /// Fit an input of any kind with the default preset and write its row in docs/representations.md
    Representations {
        /// The input
        file: PathBuf,
        /// The mesh it was made from, in its coordinates
        #[arg(long)]
        truth: Option<PathBuf>,
    },
}

fn main() -> ExitCode {
    let done = match Task::parse() {
        Task::Ci => ci::run(),
        Task::Arrows => arrows::check(),
        Task::Table { data } => table::run(&data),
        Task::Representations { file, truth } => representations::run(&file, truth.as_deref()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask: {message}");
            ExitCode::FAILURE
        }
    }
}
