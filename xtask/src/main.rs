//! Development tasks. `cargo xtask ci` is the check before a change lands.

mod arrows;
mod ci;
mod circles;
mod data;
mod golden;
mod paths;
mod python;
mod readmes;
mod shell;
mod source;
mod web;

use std::process::ExitCode;

use shell::cargo;

const HELP: &str = "\
Development tasks of ndf

Usage: cargo xtask TASK

Tasks:
  ci       Everything that must hold before a change lands, cheapest first
  arrows   Print the crates and their dependencies, and check their order and the files of each for circles
  data     List the files that tables and tests use, with their sources, and check them in a folder [default: NDF_DATA]
  info     Write what `ndf info` says of every file under folders [default: ../shared/data ../shared/cases] to
           docs/info.jsonl, and print what changed
  paths    Check that the files and folders that the documentation names exist
  python   Build the wheel of the Python package into target/wheels, install it in an environment of its own, and run its
           tests, mypy and stubtest; then `python compare` measures it beside other libraries, and `python pages` writes
           docs/python from the docstrings, with pictures
  readmes  Write README.md of every crate from the front page of its documentation
  web      Build the npm package into web/lib and the page of `ndf view` into web/dist, which is committed; `web test` tests
           both, `web measure` writes the tables of docs/web.md

Measurements (each takes --help; they are compiled in release mode first):
  ";

/// What `ndf-experiments` measures.
const EXPERIMENTS: &[&str] = &[
    "ablation",
    "compression",
    "geodesics",
    "representations",
    "reproduce",
    "scalars",
    "scale",
    "spectra",
    "many-modes",
    "table",
    "training",
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match arguments[..] {
        ["ci"] => ci::run(),
        ["arrows"] => arrows::run(),
        ["data"] => data::run(None),
        ["data", folder] => data::run(Some(folder)),
        ["info"] => golden::run(&["../shared/data", "../shared/cases"]),
        ["info", ref folders @ ..] => golden::run(folders),
        ["paths"] => paths::check(),
        ["python"] => python::run(),
        ["python", "compare"] => python::compare(),
        ["python", "pages"] => python::pages(),
        ["readmes"] => readmes::run(false),
        ["web"] => web::build(),
        ["web", "test"] => web::test(),
        ["web", "measure", ref arguments @ ..] => web::measure(arguments),
        [] | ["help" | "--help" | "-h"] => {
            eprintln!("{HELP}{}", EXPERIMENTS.join(", "));
            Ok(())
        }
        [name, ..] if EXPERIMENTS.contains(&name) => {
            let run = ["run", "--release", "--package", "ndf-experiments", "--"];
            shell::run(cargo(&run).args(&arguments))
        }
        _ => Err(format!("no task `{}`; `cargo xtask --help` lists them", arguments.join(" "))),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask: {message}");
            ExitCode::FAILURE
        }
    }
}
