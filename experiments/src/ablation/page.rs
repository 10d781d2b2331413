//! The plots of studies, and a page of all of them.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::{Run, Study};
use crate::plot::{Line, loss_by_epoch};
use crate::rows::Rows;

/// Writes a plot of a study's runs. A plot that is there stays as it is where the losses of some runs were not kept: it may
/// show them.
pub(super) fn plot(file: &Path, title: &str, runs: &[Run]) -> Result<(), String> {
    let unknown: Vec<&str> = runs.iter().filter(|r| r.curve.0.is_empty()).map(|r| r.case.as_str()).collect();
    if !unknown.is_empty() && file.exists() {
        let (file, unknown) = (file.display(), unknown.join("; "));
        eprintln!("{file} stays as it was: run again, for their losses were not kept: {unknown}");
        return Ok(());
    }
    let points = |run: &Run| run.curve.0.iter().map(|&(epoch, loss)| (epoch as f64, loss)).collect();
    let lines: Vec<Line> = runs.iter().map(|run| (run.case.clone(), points(run))).collect();
    let svg = loss_by_epoch(title, "projection loss", &lines);
    write_text(file, &svg.map_err(|e| format!("{}: {e}", file.display()))?)
}

/// Writes the page of all studies in the folder.
pub(super) fn write(folder: &Path) -> Result<(), String> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .map_err(|e| format!("{}: {e}", folder.display()))?
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|path| path.extension().is_some_and(|e| e == "csv"))
        .collect();
    files.sort();
    let open = |file: &PathBuf| Rows::<Run>::open(file.clone());
    let tables = files.iter().map(open).collect::<Result<Vec<_>, _>>()?;
    let mut html = String::from(
        "<!doctype html><meta charset=\"utf-8\"><title>Ablations</title>\
         <style>body{font:14px sans-serif;margin:2em}td,th{padding:.1em .8em;text-align:right}</style>\
         <h1>Ablations</h1><p>Distances in the box of side 3. Made by <code>cargo xtask ablation</code>.</p>\n",
    );
    for study in Study::value_variants() {
        let ending = format!("-{}.csv", study.name());
        let of_study = files.iter().zip(&tables).filter(|(f, _)| f.to_string_lossy().ends_with(&ending));
        let tables: Vec<&[Run]> = of_study.map(|(_, table)| table.all()).collect();
        let means = means(&tables);
        if !means.is_empty() {
            let _ = write!(html, "<h2>{}, mean over {} meshes</h2>", study.name(), tables.len());
            html += &table(&means);
        }
    }
    for (file, runs) in files.iter().zip(&tables) {
        let plot = file.with_extension("svg");
        html += &fs::read_to_string(&plot).map_err(|e| format!("{}: {e}", plot.display()))?;
        html += &table(&runs.all().iter().map(|run| (run.case.clone(), figures(run))).collect::<Vec<_>>());
    }
    write_text(&folder.join("index.html"), &html)
}

/// What tables say of a case, in the order of [`HEAD`]; `None` where it has no such thing.
type Figures = [Option<f64>; 7];

const HEAD: [&str; 8] =
    ["case", "rms", "max", "cycle loss", "flipped", "epochs", "seconds", "of these projecting"];

fn figures(run: &Run) -> Figures {
    let Run { rms, max, cycle_loss, flipped, epochs, seconds, seconds_projecting, .. } = run;
    let epochs = *epochs as f64;
    [
        Some(*rms),
        Some(*max),
        *cycle_loss,
        Some(*flipped),
        Some(epochs),
        Some(*seconds),
        Some(*seconds_projecting),
    ]
}

/// Means over tables of several meshes, of the cases that all of them have.
fn means(tables: &[&[Run]]) -> Vec<(String, Figures)> {
    let [first, _, ..] = tables else { return Vec::new() };
    let of_case = |run: &Run| {
        let same = |table: &&[Run]| table.iter().find(|other| other.case == run.case).map(figures);
        let rows = tables.iter().map(same).collect::<Option<Vec<Figures>>>()?;
        let sum = |k: usize| rows.iter().map(|row| row[k]).sum::<Option<f64>>();
        Some((run.case.clone(), std::array::from_fn(|k| sum(k).map(|sum| sum / rows.len() as f64))))
    };
    first.iter().filter_map(of_case).collect()
}

fn table(rows: &[(String, Figures)]) -> String {
    let line = |tag: &str, cells: &[String]| {
        let cells: String = cells.iter().map(|cell| format!("<{tag}>{cell}</{tag}>")).collect();
        format!("<tr>{cells}")
    };
    let mut html = format!("<table>{}", line("th", &HEAD.map(str::to_owned)));
    for (case, figures) in rows {
        let cell = |k: usize, format: &dyn Fn(f64) -> String| figures[k].map_or("–".to_owned(), format);
        let exponents = |x: f64| format!("{x:.3e}");
        let tenths = |x: f64| format!("{x:.1}");
        let cells = [
            case.clone(),
            cell(0, &exponents),
            cell(1, &exponents),
            cell(2, &|x| format!("{x:.2e}")),
            cell(3, &|x| format!("{x:.5}")),
            cell(4, &|x| format!("{x:.0}")),
            cell(5, &tenths),
            cell(6, &tenths),
        ];
        html += &line("td", &cells);
    }
    html + "</table>\n"
}

fn write_text(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_of_cases_of_all_meshes() {
        let run = |case: &str, rms: f64, cycle_loss: Option<f64>| Run {
            case: case.to_owned(),
            rms,
            max: 1.0,
            cycle_loss,
            flipped: 0.0,
            epochs: 10,
            seconds: 1.0,
            seconds_projecting: 0.5,
            curve: super::super::Curve::default(),
        };
        let first = [run("a", 1.0, Some(2.0)), run("b", 1.0, None), run("c", 0.0, None)];
        let second = [run("b", 2.0, None), run("a", 3.0, Some(4.0))];
        assert!(means(&[&first]).is_empty());
        let means = means(&[&first, &second]);
        assert_eq!(means.iter().map(|(case, _)| case.as_str()).collect::<Vec<_>>(), ["a", "b"]);
        assert_eq!(means[0].1[..3], [Some(2.0), Some(1.0), Some(3.0)]);
        assert_eq!(means[1].1[..3], [Some(1.5), Some(1.0), None]);
        let html = table(&means);
        assert!(html.contains("<td>a</td><td>2.000e0</td><td>1.000e0</td><td>3.00e0</td>"), "{html}");
        assert!(html.contains("<td>–</td>"), "{html}");
    }
}
