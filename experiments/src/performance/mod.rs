//! What geodesics, spectra and training cost, and what rivals take on the same meshes: the tables of docs/performance.md.
//!
//! Every mesh is measured in a process of its own, in which rivals take turns with ours.

mod geodesics;
mod meshes;
pub(crate) mod process;
mod spectra;
mod training;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::Value;

use crate::document::replace_table;
use crate::root;
use meshes::MeshName;
use process::Threads;

/// What the tables are made of.
#[derive(Args, Clone, Debug)]
pub(crate) struct Meshes {
    /// The folder with the meshes
    #[arg(long, default_value = "../shared/data/mesh")]
    data: PathBuf,
    /// Meshes: files of the folder, or rope-ALONGxAROUND; +N splits every face in four N times. If any are given, the
    /// tables are only printed
    meshes: Vec<MeshName>,
}

/// How often to measure, and beside what.
#[derive(Args, Clone, Debug)]
pub(crate) struct Timing {
    /// Runs of which the median counts
    #[arg(long, default_value_t = 3)]
    repeat: usize,
    /// A Python interpreter with the rivals of experiments/peers
    #[arg(long)]
    python: Option<PathBuf>,
}

impl Timing {
    /// The same as arguments of a process.
    fn arguments(&self) -> Vec<String> {
        let mut arguments = vec!["--repeat".to_owned(), self.repeat.to_string()];
        if let Some(python) = &self.python {
            arguments.extend(["--python".to_owned(), python.display().to_string()]);
        }
        arguments
    }
}

/// One mesh, in this process.
#[derive(Subcommand)]
pub(crate) enum OneMesh {
    Geodesics(geodesics::Arguments),
    Spectra(spectra::Arguments),
    Training(training::Arguments),
    Program(crate::scale::Program),
}

/// Measures one mesh and prints what was measured as JSON.
#[expect(clippy::print_stdout, reason = "read by the process that asked")]
pub(crate) fn measure(mesh: OneMesh) -> Result<(), String> {
    let row = match mesh {
        OneMesh::Geodesics(arguments) => geodesics::row(&arguments)?,
        OneMesh::Spectra(arguments) => spectra::row(&arguments)?,
        OneMesh::Training(arguments) => training::row(&arguments)?,
        OneMesh::Program(arguments) => crate::scale::row(&arguments)?,
    };
    println!("{row}");
    Ok(())
}

/// The tables of geodesics.
pub(crate) fn geodesics(meshes: &Meshes, timing: &Timing, vtp: Option<&Path>) -> Result<(), String> {
    let mut arguments = timing.arguments();
    if let Some(program) = vtp {
        arguments.extend(["--vtp".to_owned(), program.display().to_string()]);
    }
    let rows = rows("geodesics", meshes, geodesics::MESHES, &arguments, Threads::One)?;
    publish("cargo xtask geodesics", meshes, &geodesics::tables(&rows))
}

/// The tables of spectra.
pub(crate) fn spectra(meshes: &Meshes, timing: &Timing) -> Result<(), String> {
    let arguments = timing.arguments();
    let mut rows = rows("spectra", meshes, spectra::MESHES, &arguments, Threads::One)?;
    // Ratios to rivals once more with all threads; other figures are those of one thread.
    let beside_rivals = rows.iter_mut().filter(|row| row["seconds_superlu"].is_number());
    for row in beside_rivals {
        let again = row["mesh"].as_str().unwrap_or_default().to_owned();
        spectra::add_all_threads(row, &measured("spectra", meshes, &again, &arguments, Threads::Default)?);
    }
    publish("cargo xtask spectra", meshes, &spectra::tables(&rows))
}

/// The table of spectra of many modes.
pub(crate) fn many_modes(
    meshes: &Meshes,
    timing: &Timing,
    count: usize,
    multigrid: bool,
) -> Result<(), String> {
    let of_one = |mesh: &str, count: usize, multigrid: bool| {
        let mut arguments = [timing.arguments(), vec!["--modes".to_owned(), count.to_string()]].concat();
        arguments.extend(multigrid.then(|| "--multigrid".to_owned()));
        measured("spectra", meshes, mesh, &arguments, Threads::One)
    };
    let rows: Vec<Value> = if meshes.meshes.is_empty() {
        spectra::MANY
            .iter()
            .map(|&(mesh, count, multigrid)| of_one(mesh, count, multigrid))
            .collect::<Result<_, _>>()?
    } else {
        meshes
            .meshes
            .iter()
            .map(|mesh| of_one(&mesh.to_string(), count, multigrid))
            .collect::<Result<_, _>>()?
    };
    publish("cargo xtask many-modes", meshes, &spectra::table_of_many(&rows))
}

/// The table of training.
pub(crate) fn training(meshes: &Meshes) -> Result<(), String> {
    let rows = rows("training", meshes, training::MESHES, &[], Threads::Default)?;
    publish("cargo xtask training", meshes, &training::tables(&rows))
}

/// One object for every mesh.
fn rows(
    kind: &str,
    meshes: &Meshes,
    usual: &[&str],
    more: &[String],
    threads: Threads,
) -> Result<Vec<Value>, String> {
    let names: Vec<String> = if meshes.meshes.is_empty() {
        usual.iter().map(|&name| name.to_owned()).collect()
    } else {
        meshes.meshes.iter().map(ToString::to_string).collect()
    };
    names.iter().map(|name| measured(kind, meshes, name, more, threads)).collect()
}

/// The object of one mesh, from a process of its own.
fn measured(
    kind: &str,
    meshes: &Meshes,
    mesh: &str,
    more: &[String],
    threads: Threads,
) -> Result<Value, String> {
    let data = root().join(&meshes.data).display().to_string();
    let mut arguments = ["measure", kind, mesh, &data].map(str::to_owned).to_vec();
    arguments.extend_from_slice(more);
    let row = process::in_own_process(&arguments, threads)?;
    eprintln!("{row}");
    Ok(row)
}

/// Writes tables to the document, or prints them where they are not of the usual meshes.
#[expect(clippy::print_stdout, reason = "tables that were asked for")]
fn publish(command: &str, meshes: &Meshes, tables: &str) -> Result<(), String> {
    if meshes.meshes.is_empty() {
        replace_table(&root().join("docs/performance.md"), command, tables)
    } else {
        print!("{tables}");
        Ok(())
    }
}

/// What a column shows of a row, if the row has it.
type Cell<'a> = &'a dyn Fn(&Value) -> Option<String>;

/// A table of rows, with the cells of every column made by a function; rows without any figure in the last column are
/// left out.
fn table(rows: &[Value], columns: &[(&str, Cell<'_>)]) -> String {
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let mut table = line(columns.iter().map(|(name, _)| (*name).to_owned()).collect());
    table +=
        &line(columns.iter().enumerate().map(|(i, _)| if i == 0 { "---" } else { "--:" }.into()).collect());
    let dash = || "–".to_owned();
    for row in rows {
        let cells: Vec<Option<String>> = columns.iter().map(|(_, cell)| cell(row)).collect();
        if cells.iter().skip(2).any(Option::is_some) {
            table += &line(cells.into_iter().map(|cell| cell.unwrap_or_else(dash)).collect());
        }
    }
    table
}

/// A text of a row.
fn text(key: &'static str) -> impl Fn(&Value) -> Option<String> {
    move |row| row[key].as_str().map(str::to_owned)
}

/// A number of a row with some decimals, thousands apart.
fn number(key: &'static str, decimals: usize) -> impl Fn(&Value) -> Option<String> {
    move |row| row[key].as_f64().map(|x| grouped(x, decimals))
}

/// A number of a row in few digits.
fn small(key: &'static str) -> impl Fn(&Value) -> Option<String> {
    move |row| row[key].as_f64().map(|x| format!("{x:.1e}"))
}

/// One number of a row divided by another.
fn ratio(above: &'static str, below: &'static str) -> impl Fn(&Value) -> Option<String> {
    move |row| Some(format!("{:.2}", row[above].as_f64()? / row[below].as_f64()?))
}

fn grouped(x: f64, decimals: usize) -> String {
    let text = format!("{x:.decimals$}");
    let (whole, fraction) = text.split_at(text.find('.').unwrap_or(text.len()));
    let mut grouped = String::new();
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i) % 3 == 0 {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped + fraction
}
