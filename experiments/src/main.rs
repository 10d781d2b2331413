//! The measurements behind the tables and plots of the documentation. `cargo xtask NAME` runs one.

mod ablation;
mod compression;
mod document;
mod performance;
mod plot;
mod representations;
mod reproduce;
mod rows;
mod scalars;
mod scale;
mod table;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;

/// Measurements of ndf: tables and plots of the documentation.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
enum Experiment {
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
    /// Run the experiments of the paper's supplement and write docs/experiments
    Reproduce(reproduce::Options),
    /// Learn eigenfunctions with encodings of several sizes and write the table and plots of docs/scalars.md
    Scalars(scalars::Options),
    /// Time the program on inputs of growing size and write the table and plots of docs/scale.md
    Scale(scale::Options),
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
    /// Time many eigenmodes, beside SciPy with CHOLMOD if an interpreter is given, and write the table of docs/performance.md
    ManyModes {
        #[command(flatten)]
        meshes: performance::Meshes,
        #[command(flatten)]
        timing: performance::Timing,
        /// How many, of meshes that are given
        #[arg(long, default_value_t = 100)]
        modes: usize,
        /// Without a factorisation, of meshes that are given
        #[arg(long)]
        multigrid: bool,
    },
    /// Measure the memory of training and write the table of docs/performance.md
    Training {
        #[command(flatten)]
        meshes: performance::Meshes,
    },
    /// What the four above run in a process of its own for every mesh
    #[command(subcommand, hide = true)]
    Measure(performance::OneMesh),
}

/// The root of the workspace.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the crate lies in the workspace").to_path_buf()
}

fn main() -> ExitCode {
    let done = match Experiment::parse() {
        Experiment::Ablation(options) => ablation::run(&options),
        Experiment::Compression(options) => compression::run(&options),
        Experiment::Table { data } => table::run(&data),
        Experiment::Representations(options) => representations::run(&options),
        Experiment::Reproduce(options) => reproduce::run(&options),
        Experiment::Scalars(options) => scalars::run(&options),
        Experiment::Scale(options) => scale::run(&options),
        Experiment::Geodesics { meshes, timing, vtp } => {
            performance::geodesics(&meshes, &timing, vtp.as_deref())
        }
        Experiment::Spectra { meshes, timing } => performance::spectra(&meshes, &timing),
        Experiment::ManyModes { meshes, timing, modes, multigrid } => {
            performance::many_modes(&meshes, &timing, modes, multigrid)
        }
        Experiment::Training { meshes } => performance::training(&meshes),
        Experiment::Measure(mesh) => performance::measure(mesh),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}
