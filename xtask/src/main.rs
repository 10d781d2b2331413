//! Development tasks. `cargo xtask ci` is the check before a change lands.

mod ablation;
mod arrows;
mod ci;
mod compression;
mod document;
mod performance;
mod plot;
mod representations;
mod rows;
mod scalars;
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
    /// Vary the settings of training and write CSV files and plots
    Ablation(ablation::Options),
    /// Measure what models weigh and what that costs, beside Draco, and write the tables of docs/compression.md
    Compression(compression::Options),
    /// Fit meshes with the default preset and write the table of the README
    Table {
        /// The folder with the meshes
        #[arg(long, default_value = "../shared/data/mesh")]
        data: PathBuf,
    },
    /// Fit an input of any kind with the default preset and write its row in docs/representations.md
    Representations(representations::Options),
    /// Learn eigenfunctions with encodings of several sizes and write the table and plots of docs/scalars.md
    Scalars(scalars::Options),
    /// Time geodesic distances, beside rivals if their programs are given, and write the tables of docs/performance.md
    Geodesics {
        #[command(flatten)]
        meshes: performance::Meshes,
        #[command(flatten)]
        timing: performance::Timing,
        /// VTP's program (YipengQin/VTP_source_code)
        #[arg(long)]
        vtp: Option<PathBuf>,
    },
    /// Time eigenmodes, beside SciPy if an interpreter is given, and write the tables of docs/performance.md
    Spectra {
        #[command(flatten)]
        meshes: performance::Meshes,
        #[command(flatten)]
        timing: performance::Timing,
    },
    /// Measure the memory of training and write the table of docs/performance.md
    Training {
        #[command(flatten)]
        meshes: performance::Meshes,
    },
    /// What the three above run in a process of its own for every mesh
    #[command(subcommand, hide = true)]
    Measure(performance::OneMesh),
}

fn main() -> ExitCode {
    let done = match Task::parse() {
        Task::Ablation(options) => ablation::run(&options),
        Task::Ci => ci::run(),
        Task::Compression(options) => compression::run(&options),
        Task::Arrows => arrows::check(),
        Task::Table { data } => table::run(&data),
        Task::Representations(options) => representations::run(&options),
        Task::Scalars(options) => scalars::run(&options),
        Task::Geodesics { meshes, timing, vtp } => performance::geodesics(&meshes, &timing, vtp.as_deref()),
        Task::Spectra { meshes, timing } => performance::spectra(&meshes, &timing),
        Task::Training { meshes } => performance::training(&meshes),
        Task::Measure(mesh) => performance::measure(mesh),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask: {message}");
            ExitCode::FAILURE
        }
    }
}
