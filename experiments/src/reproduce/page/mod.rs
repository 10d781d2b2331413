//! The page of all results: one file that needs nothing else. Every sentence about a plot is made from the data.

mod html;
mod plotly;
mod plots;
mod space;
mod tables;

use std::fs;
use std::path::Path;

use super::fits::FitRow;
use super::joined::{ablation_folder, ablations, files, scalars_folder, stem};
use super::pareto::Costs;
use super::row::Run;
use super::runs::Runs;
use super::{Experiment, Setup};
use crate::rows::Rows;
use crate::scalars;
use html::{details, figure, paragraph, section, table};
use plotly::Plotly;
use plots::Plots;

/// Makes plots and page from the results.
pub(super) fn write(setup: &Setup, plotly: Option<&Path>) -> Result<(), String> {
    let library = Plotly::find(plotly, &setup.cache);
    if let Err(reason) = &library {
        eprintln!("the page has no plots in space: {reason}");
    }
    let html = page(setup, library.ok().as_ref())?;
    let file = setup.out.join("index.html");
    fs::write(&file, html).map_err(|e| format!("{}: {e}", file.display()))?;
    eprintln!("{}", file.display());
    Ok(())
}

/// Sections in order, with the names of their places.
fn page(setup: &Setup, plotly: Option<&Plotly>) -> Result<String, String> {
    let folder = setup.out.join("plots");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let runs = |experiment| Runs::open(setup, experiment).map(|runs| runs.all().to_vec());
    let isosurfacing = runs(Experiment::Isosurfacing)?;
    let winding = runs(Experiment::Winding)?;
    let compression = runs(Experiment::Compression)?;
    let draco = runs(Experiment::Draco)?;
    let fits: Rows<FitRow> = Rows::open(setup.out.join("fits.csv"))?;
    let made: Vec<FitRow> = fits.all().iter().filter(|fit| fit.left_out.is_empty()).cloned().collect();
    let everything: Vec<Run> =
        [&isosurfacing, &winding, &compression, &draco].into_iter().flatten().cloned().collect();

    // Compressed meshes of networks are there for the plot of everything; Draco stands beside models of the same shapes.
    let of_meshes: Vec<Run> = compression.iter().filter(|run| run.kind == "mesh").cloned().collect();
    let has_draco =
        |run: &&Run| draco.iter().any(|other| other.shape == run.shape && other.left_out.is_empty());
    let is_model = |run: &&Run| run.seed.is_some();
    let models = of_meshes.iter().filter(is_model).filter(has_draco);
    let beside_draco: Vec<Run> = models.chain(&draco).cloned().collect();
    let plots = |name, costs, is_best_length, runs: &[Run]| {
        let measured: Vec<Run> = runs.iter().filter(|run| run.left_out.is_empty()).cloned().collect();
        if measured.is_empty() {
            return Ok(paragraph("Nothing was measured yet."));
        }
        Plots { folder: &folder, name, costs, is_best_length }.html(&measured)
    };
    let sections = [
        ("space", "File size, client seconds and error", {
            let text = "Each point is a run: the bytes that are sent, the seconds on the client (queries, extraction, solve, transfer), \
                        and the error. Large points are on the frontier of their shape.";
            paragraph(text) + &space::html(&everything, plotly)
        }),
        ("isosurfacing", "Meshes from networks of distances (Fig. 8)", {
            plots("isosurfacing", Costs::Seconds, false, &isosurfacing)?
        }),
        ("winding", "Meshes from winding numbers of clouds (§2.2.1)", {
            plots("winding", Costs::Seconds, false, &winding)?
        }),
        ("compression", "Compressed meshes (Fig. 10)", plots("compression", Costs::Bytes, true, &of_meshes)?),
        ("draco", "Decimated meshes in Draco (Fig. 19)", {
            let text = "Base meshes in Draco and in the coder of models, and all of it by distances, are in docs/compression.md.";
            paragraph(text) + &plots("draco", Costs::Bytes, true, &beside_draco)?
        }),
        ("scalars", "Scalar fields (Fig. 21)", scalar_fields(setup)?),
        ("ablations", "Ablations (Figs. 1 and 2)", studies(setup)?),
        ("cycle", "Cycle consistency (§3.2)", tables::cycle(&made)),
        ("runtimes", "Run times of training (Table 1)", tables::run_times(&made)),
        ("parameters", "Weights of the losses (Table 2)", tables::parameters()),
        ("teaser", "Computations on what is no mesh", tables::pictures(setup)?),
        ("missing", "What is missing", missing(setup, &everything)?),
    ];
    let contents: String = sections
        .iter()
        .map(|(id, title, _)| format!("<a href=\"#{id}\">{}</a>\n", html::escaped(title)))
        .collect();
    let body: String = sections.iter().map(|(id, title, body)| section(id, title, body)).collect();
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>The experiments of the supplement</title>\n\
         <style>\n{}</style></head>\n<body>\n<h1>The experiments of the supplement</h1>\n{}<nav>\n{contents}</nav>\n{body}</body></html>\n",
        include_str!("page.css"),
        introduction(setup, &everything),
    ))
}

/// What all of it is, and on what it ran.
fn introduction(setup: &Setup, runs: &[Run]) -> String {
    let measured: Vec<&Run> = runs.iter().filter(|run| run.left_out.is_empty()).collect();
    let loads = measured.iter().filter_map(|run| run.load);
    let (least, most) = loads.fold((f64::INFINITY, 0.0_f64), |(l, m), load| (l.min(load), m.max(load)));
    let mut text = paragraph(
        "Neural displacement fields beside methods that extract meshes from fields and methods that compress meshes: errors of \
         geodesic distances and of eigenvalues, seconds on the client, bytes of the file. “ours” are models of levels of so many bytes \
         with the metric that they carry, “ours, network” a network of the default settings, and “preset of the paper” the training \
         of the supplement. Errors of geodesics are the mean difference as a share of the mean distance, from the truth’s sources \
         carried over by the closest point; tables have the supplement’s own rule beside it.",
    );
    if most > 0.0 {
        text += &paragraph(&format!(
            "{} runs were measured on {} cores, at loads from {least:.1} to {most:.1} (the mean number of runnable processes, which \
             each run has in its row): beyond the number of cores, others had a part of them, and seconds are upper bounds.",
            measured.len(),
            std::thread::available_parallelism().map_or(1, usize::from),
        ));
    }
    if let Some(left_out) = setup.scale.left_out() {
        text += &format!("<p class=\"notice\">{}</p>\n", html::escaped(&left_out));
    }
    text
}

/// Plots of scalars, as their own experiment drew them.
fn scalar_fields(setup: &Setup) -> Result<String, String> {
    let rows: Rows<scalars::Run> = Rows::open(scalars_folder(setup).join("runs.csv"))?;
    let mut html = String::from("<div class=\"plots\">\n");
    for file in files(&scalars_folder(setup), "svg") {
        let mesh = stem(&file);
        html += &figure(&read(&file)?, &tables::scalars_sentence(&mesh, rows.all()));
    }
    Ok(html + "</div>\n")
}

/// Plots of ablations, as their own experiment drew them.
fn studies(setup: &Setup) -> Result<String, String> {
    let runs = ablations(setup)?;
    let mut html = String::from("<div class=\"plots\">\n");
    for file in files(&ablation_folder(setup), "svg") {
        html += &figure(&read(&file)?, &tables::study_sentence(&stem(&file), &runs));
    }
    Ok(html + "</div>\n")
}

/// Runs that could not be had, and experiments without any.
fn missing(setup: &Setup, runs: &[Run]) -> Result<String, String> {
    let mut html = String::new();
    for experiment in
        [Experiment::Isosurfacing, Experiment::Winding, Experiment::Compression, Experiment::Draco]
    {
        let runs = Runs::open(setup, experiment)?;
        html += &paragraph(&tables::coverage(experiment, runs.all(), &setup.scale));
    }
    let left_out: Vec<Vec<String>> = runs
        .iter()
        .filter(|run| !run.left_out.is_empty())
        .map(|run| vec![run.shape.clone(), run.method.clone(), run.setting.clone(), run.left_out.clone()])
        .collect();
    if !left_out.is_empty() {
        let table = table(&["shape", "method", "setting", "why"], 4, &left_out);
        html += &details(&format!("{} runs that could not be had", left_out.len()), &table);
    }
    html += &paragraph(
        "Stripe patterns are not drawn: no crate of the workspace computes them. Checkpoints of the DTU data set are not public.",
    );
    Ok(html)
}

fn read(file: &Path) -> Result<String, String> {
    fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::super::scale::Scale;
    use super::*;

    #[test]
    fn the_page_needs_nothing_from_outside_and_stands_without_results() {
        let out = std::env::temp_dir().join(format!("ndf-page-{}", std::process::id()));
        fs::create_dir_all(&out).unwrap();
        let setup = Setup {
            scale: Scale::QUICK,
            out: out.clone(),
            cache: out.clone(),
            data: out.clone(),
            missing: false,
            ndc_weights: None,
            python: None,
            deadline: None,
        };
        let plotly = Plotly { script: "const Plotly = {};".to_owned(), license: "MIT */ notice".to_owned() };
        let run = |method: &str, error| Run {
            shape: "a <b>".into(),
            kind: "neus".into(),
            method: method.into(),
            bytes: Some(1000),
            geodesic_share: Some(error),
            eigenvalues: Some(error),
            seconds_extraction: Some(1.0),
            seconds_geodesics: Some(1.0),
            seconds_eigenvalues: Some(1.0),
            ..Run::default()
        };
        let empty = page(&setup, Some(&plotly)).unwrap();
        let mut runs = Runs::open(&setup, Experiment::Isosurfacing).unwrap();
        runs.put(run("MC", 0.2)).unwrap();
        runs.put(run("ours, 9 kB", 0.1)).unwrap();
        let full = page(&setup, Some(&plotly)).unwrap();
        fs::remove_dir_all(&out).unwrap();
        for html in [&empty, &full] {
            for outside in ["href=\"http", "src=\"http", "url(http", "@import", "<link", "fetch("] {
                assert!(!html.contains(outside), "{outside}");
            }
            assert!(html.contains("MIT * / notice") && html.ends_with("</html>\n"));
        }
        assert!(full.contains("On the frontier of client seconds and error: ours (1 run)."), "{full}");
        assert!(full.contains("a &lt;b&gt;") && !full.contains("a <b>:"));
        assert!(empty.contains("Nothing was measured yet."));
        let without =
            page(&Setup { out: std::env::temp_dir().join("ndf-page-none"), ..setup }, None).unwrap();
        assert!(!without.contains("<script"));
    }
}
