//! What large inputs cost: time and memory of the program on inputs of growing size, for docs/scale.md.
//!
//! Inputs are made by `ndf sample`, each once. Every command runs in a process of its own, with as many threads as it takes of its
//! own accord.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use ndf_mesh::io::atomic_write;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::document::replace_table;
use crate::performance::process::{Threads, in_own_process, memory, timed};
use crate::plot::{Line, by_size};
use crate::root;
use crate::rows::{Row, Rows};

/// What to measure.
#[derive(Args)]
pub(crate) struct Options {
    /// Faces of meshes, points of clouds, splats
    #[arg(long, value_delimiter = ',', default_values_t = [10_000, 100_000, 1_000_000, 10_000_000])]
    sizes: Vec<u32>,
    /// Kinds of inputs
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Kind::Mesh, Kind::OrientedCloud, Kind::Cloud, Kind::Splats])]
    kinds: Vec<Kind>,
    /// Commands of the program
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Job::Info, Job::Fit, Job::Measure])]
    commands: Vec<Job>,
    /// The folder in which inputs and models are kept
    #[arg(long, default_value = "target/scale")]
    folder: PathBuf,
    /// Measure only what has no row yet
    #[arg(long)]
    missing: bool,
}

/// Kinds of inputs, by the names that `ndf sample` has for them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    Mesh,
    OrientedCloud,
    Cloud,
    Splats,
}

/// Commands of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Job {
    /// `ndf info` of the input
    Info,
    /// `ndf fit`
    Fit,
    /// `ndf measure` of the model, beside an input that is a mesh
    Measure,
}

/// A line of docs/scale/measured.csv.
#[derive(Debug, Deserialize, Serialize)]
struct Measured {
    kind: String,
    size: u32,
    command: String,
    threads: usize,
    input_megabytes: f64,
    seconds: f64,
    /// The most that was held at a time; nothing where the system does not tell.
    megabytes: Option<f64>,
}

impl Row for Measured {
    fn key(&self) -> String {
        key(&self.kind, self.size, &self.command)
    }
}

impl Measured {
    /// Rows of a table in the order of their sizes, kinds and commands.
    fn order(&self) -> (u32, Option<usize>, Option<usize>) {
        fn place<T: ValueEnum>(of: &str) -> Option<usize> {
            T::value_variants().iter().position(|value| name(value) == of)
        }
        (self.size, place::<Kind>(&self.kind), place::<Job>(&self.command))
    }
}

fn key(kind: &str, size: u32, command: &str) -> String {
    format!("{kind} {size} {command}")
}

/// The name of a value on the command line.
fn name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned())
}

/// Measures what is asked for, and writes rows, plots and the table.
pub(crate) fn run(options: &Options) -> Result<(), String> {
    let docs = root().join("docs");
    let mut rows: Rows<Measured> = Rows::open(docs.join("scale/measured.csv"))?;
    let folder = root().join(&options.folder);
    for folder in [&folder, &docs.join("scale")] {
        fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    for &size in &options.sizes {
        for kind in &options.kinds {
            for job in options.commands.iter().filter(|&&job| job != Job::Measure || *kind == Kind::Mesh) {
                let key = key(&name(kind), size, &name(job));
                if !(options.missing && rows.contains(&key)) {
                    let row = measured(&folder, *kind, size, *job)?;
                    eprintln!("{key}: {:.2} s, {:.0} MB", row.seconds, row.megabytes.unwrap_or(f64::NAN));
                    rows.put(row)?;
                }
            }
        }
    }
    let mut rows: Vec<&Measured> = rows.all().iter().collect();
    rows.sort_by_key(|row| row.order());
    let plot = |file: &str, title: &str, axis: &str, figure: fn(&Measured) -> f64| -> Result<(), String> {
        let file = docs.join("scale").join(file);
        let say = |e: &dyn std::fmt::Display| format!("{}: {e}", file.display());
        let svg = by_size(title, axis, &lines(&rows, figure)).map_err(|e| say(&e))?;
        atomic_write(&file, |out| out.write_all(svg.as_bytes())).map_err(|e| say(&e))
    };
    plot("seconds.svg", "Time by size of the input", "seconds", seconds)?;
    plot("memory.svg", "Memory by size of the input", "megabytes", megabytes)?;
    replace_table(&docs.join("scale.md"), "cargo xtask scale", &table(&rows))
}

/// Runs one command on one input, which is made if it is not there.
fn measured(folder: &Path, kind: Kind, size: u32, job: Job) -> Result<Measured, String> {
    let path = |extension: &str| folder.join(format!("{}-{size}.{extension}", name(&kind)));
    let (input, model) = (path("ply"), path("ndf"));
    if !input.exists() {
        let count = if kind == Kind::Mesh { "--faces" } else { "--points" };
        program(&["sample", &name(&kind), count, &size.to_string(), "-o", &input.display().to_string()])?;
    }
    let [input, model] = [&input, &model].map(|path| path.display().to_string());
    let arguments: &[&str] = match job {
        Job::Info => &["info", &input],
        Job::Fit => &["fit", &input, "-o", &model],
        Job::Measure => &["measure", &input, &model],
    };
    let found = program(arguments)?;
    let bytes = fs::metadata(&input).map_err(|e| format!("{input}: {e}"))?.len();
    Ok(Measured {
        kind: name(&kind),
        size,
        command: name(&job),
        threads: found["threads"].as_u64().unwrap_or(0) as usize,
        input_megabytes: (bytes as f64 / 1e4).round() / 100.0,
        seconds: found["seconds"].as_f64().ok_or("a run without seconds")?,
        megabytes: found["megabytes"].as_f64(),
    })
}

/// Runs the program in a process of its own.
fn program(arguments: &[&str]) -> Result<serde_json::Value, String> {
    let all = ["measure", "program", "--"].iter().chain(arguments).map(ToString::to_string);
    in_own_process(&all.collect::<Vec<_>>(), Threads::Default)
}

/// The program in this process.
#[derive(Args)]
pub(crate) struct Program {
    #[arg(last = true)]
    arguments: Vec<String>,
}

/// Runs the program and tells its time and the most memory that it held.
pub(crate) fn row(program: &Program) -> Result<serde_json::Value, String> {
    let arguments = std::iter::once("ndf").chain(program.arguments.iter().map(String::as_str));
    let (seconds, code) = timed(|| ndf_cli::run(arguments));
    if code != 0 {
        return Err(format!("ndf {}: exit code {code}", program.arguments.join(" ")));
    }
    let round = |x: f64| (x * 1000.0).round() / 1000.0;
    Ok(json!({
        "seconds": round(seconds),
        "megabytes": memory().map(|(_, most)| round(most)),
        "threads": rayon::current_num_threads(),
    }))
}

fn seconds(row: &Measured) -> f64 {
    row.seconds
}

fn megabytes(row: &Measured) -> f64 {
    row.megabytes.unwrap_or(f64::NAN)
}

/// A line for every kind and command.
fn lines(rows: &[&Measured], figure: fn(&Measured) -> f64) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    let mut sorted = rows.to_vec();
    sorted.sort_by(|a, b| (&a.command, &a.kind, a.size).cmp(&(&b.command, &b.kind, b.size)));
    for row in sorted {
        let name = format!("{}, {}", row.command, row.kind);
        let point = (f64::from(row.size), figure(row));
        match lines.last_mut() {
            Some(line) if line.0 == name => line.1.push(point),
            _ => lines.push((name, vec![point])),
        }
    }
    lines
}

/// The table of docs/scale.md.
fn table(rows: &[&Measured]) -> String {
    let mut text = "| input | size | file, MB | command | threads | seconds | memory, MB |\n".to_owned();
    text.push_str("|---|--:|--:|---|--:|--:|--:|\n");
    for row in rows {
        let memory = row.megabytes.map_or(String::new(), |megabytes| format!("{megabytes:.0}"));
        let Measured { kind, size, command, threads, input_megabytes, seconds, .. } = row;
        let _ = writeln!(
            text,
            "| {kind} | {size} | {input_megabytes:.1} | `ndf {command}` | {threads} | {seconds:.2} | {memory} |"
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(kind: &str, size: u32, seconds: f64) -> Measured {
        let (kind, command) = (kind.to_owned(), "fit".to_owned());
        Measured { kind, size, command, threads: 2, input_megabytes: 1.0, seconds, megabytes: None }
    }

    #[test]
    fn every_kind_and_command_has_a_line_by_size() {
        let rows = [row("mesh", 1000, 2.0), row("splats", 10, 1.0), row("mesh", 10, 1.0)];
        let found = lines(&rows.iter().collect::<Vec<_>>(), seconds);
        assert_eq!(found[0], ("fit, mesh".to_owned(), vec![(10.0, 1.0), (1000.0, 2.0)]));
        assert_eq!(found.len(), 2);
        assert!(by_size("A", "seconds", &found).unwrap().contains("fit, splats"));
    }

    #[test]
    fn the_table_has_a_line_for_every_row() {
        let rows = [row("mesh", 1000, 2.0), row("splats", 10, 1.0)];
        let text = table(&rows.iter().collect::<Vec<_>>());
        assert_eq!(text.lines().count(), 4);
        assert!(text.contains("| mesh | 1000 | 1.0 | `ndf fit` | 2 | 2.00 |  |"));
    }
}
