//! The experiments of the paper's supplement.

mod check;

use std::path::PathBuf;

use clap::Args;

/// What to run.
#[derive(Args)]
pub(crate) struct Options {
    /// Compare the error protocol with its independent implementation in Python (needs --python), and do nothing else
    #[arg(long, requires = "python")]
    check_protocol: bool,
    /// A Python interpreter with what experiments/peers name
    #[arg(long)]
    python: Option<PathBuf>,
}

/// Runs what is asked for.
pub(crate) fn run(options: &Options) -> Result<(), String> {
    match &options.python {
        Some(python) if options.check_protocol => check::run(python),
        _ => Err("nothing to do".to_owned()),
    }
}
