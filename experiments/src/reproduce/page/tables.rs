//! Tables of the page, and sentences about what other experiments measured.

use std::fs;

use base64::Engine;
use ndf::{Kind, Preset};

use super::html::{escaped, paragraph, table};
use crate::reproduce::fits::{FitRow, PAPER};
use crate::reproduce::joined::Ablated;
use crate::reproduce::pareto::percent;
use crate::reproduce::row::Run;
use crate::reproduce::scale::Scale;
use crate::reproduce::teaser::pictures as drawn;
use crate::reproduce::{Experiment, Setup};
use crate::scalars;

/// What the supplement's Table 1 has for a kind, on the GPU of a desktop computer.
fn of_the_paper(kind: &str) -> &'static str {
    match kind {
        "mesh" => "18 min",
        "neus" => "32 min",
        "oriented-cloud" => "7 h 12 min",
        _ => "",
    }
}

/// The mean L_C of the supplement's last epochs (§3.2).
const PAPER_CYCLE: f64 = 4.8e-7;

/// Table 1.
pub(super) fn run_times(fits: &[FitRow]) -> String {
    if fits.is_empty() {
        return paragraph("Nothing was measured yet.");
    }
    let row = |fit: &FitRow| {
        vec![
            fit.shape.clone(),
            fit.kind.clone(),
            fit.model.clone(),
            format!("{:.1} kB", fit.bytes as f64 / 1000.0),
            duration(fit.seconds),
            of_the_paper(&fit.kind).to_owned(),
            fit.epochs.map_or_else(String::new, |n| n.to_string()),
            format!("{:.2e}", fit.projection_rms),
            fit.load.map_or_else(String::new, |load| format!("{load:.1}")),
        ]
    };
    let header = [
        "shape",
        "kind",
        "model",
        "file",
        "all of making it",
        "Table 1",
        "epochs",
        "rms distance, box",
        "load",
    ];
    let mut text = String::new();
    for kind in ["mesh", "neus", "oriented-cloud"] {
        let of_kind = || fits.iter().filter(|fit| fit.kind == kind);
        let longest = |a: &&FitRow, b: &&FitRow| a.seconds.total_cmp(&b.seconds);
        let Some(ours) = of_kind().filter(|fit| fit.epochs.is_none()).max_by(longest) else { continue };
        let paper = of_kind().filter(|fit| fit.model.starts_with(PAPER)).max_by(longest);
        let paper = paper.map_or_else(String::new, |fit| {
            let epochs = fit.epochs.unwrap_or_default();
            format!(
                ", {epochs} epochs of the preset of the paper {} on the same processor",
                duration(fit.seconds)
            )
        });
        text += &paragraph(&format!(
            "{kind}: models of levels took at most {}{paper}; the supplement has {} on a GPU.",
            duration(ours.seconds),
            of_the_paper(kind)
        ));
    }
    text + &table(&header, 3, &fits.iter().map(row).collect::<Vec<_>>())
}

/// Cycle consistency.
pub(super) fn cycle(fits: &[FitRow]) -> String {
    let networks: Vec<(&FitRow, f64)> = fits.iter().filter_map(|fit| Some((fit, fit.cycle_loss?))).collect();
    if networks.is_empty() {
        return paragraph("Nothing was measured yet.");
    }
    let mut models: Vec<&str> = networks.iter().map(|(fit, _)| fit.model.as_str()).collect();
    models.sort_unstable();
    models.dedup();
    let mut text = String::new();
    for model in models {
        let losses: Vec<f64> =
            networks.iter().filter(|(fit, _)| fit.model == model).map(|(_, loss)| *loss).collect();
        let mean = losses.iter().sum::<f64>() / losses.len() as f64;
        let below = losses.iter().filter(|loss| **loss <= PAPER_CYCLE).count();
        text += &paragraph(&format!(
            "{model}: the mean of L_C at the end is {mean:.1e} over {} surfaces, at or below the supplement’s {PAPER_CYCLE:.1e} on \
             {below} of them.",
            losses.len()
        ));
    }
    let row = |(fit, loss): &(&FitRow, f64)| {
        vec![
            fit.shape.clone(),
            fit.kind.clone(),
            fit.model.clone(),
            format!("{loss:.2e}"),
            percent(fit.flipped),
        ]
    };
    let rows: Vec<Vec<String>> = networks.iter().map(row).collect();
    text + &table(&["shape", "kind", "model", "L_C", "flipped"], 3, &rows)
}

/// Table 2.
pub(super) fn parameters() -> String {
    let of = |kind: Kind, preset: Preset| {
        let settings = preset.settings(kind);
        [format!("{:.0e}", settings.lambda_c), format!("{:.0e}", settings.lambda_p)]
    };
    let row = |kind: &Kind| {
        let ([paper_c, paper_p], [c, p]) = (of(*kind, Preset::Paper), of(*kind, Preset::Default));
        vec![kind.to_string(), paper_c, paper_p, c, p]
    };
    let header = ["kind", "λ_C, paper", "λ_P, paper", "λ_C, default", "λ_P, default"];
    paragraph(
        "The rate of the preset of the paper is 1e-3 for all kinds. Models of levels have no such weights.",
    ) + &table(&header, 1, &Kind::ALL.iter().map(row).collect::<Vec<_>>())
}

/// Pictures, inside of the page.
pub(super) fn pictures(setup: &Setup) -> Result<String, String> {
    let rows = drawn(setup)?;
    let mut html = String::new();
    let mut shapes: Vec<(&str, &str)> = Vec::new();
    for picture in rows.all() {
        if !shapes.contains(&(&picture.shape, &picture.kind)) {
            shapes.push((&picture.shape, &picture.kind));
        }
    }
    if shapes.is_empty() {
        return Ok(paragraph("Nothing was drawn yet."));
    }
    for (shape, kind) in shapes {
        html += &format!("<h3>{} ({})</h3>\n<div class=\"pictures\">\n", escaped(shape), escaped(kind));
        let of_shape =
            rows.all().iter().filter(|p| p.shape == shape && p.kind == kind && p.left_out.is_empty());
        for picture in of_shape {
            let file = setup.out.join(&picture.file);
            let bytes = fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))?;
            let data = base64::engine::general_purpose::STANDARD.encode(bytes);
            let caption = escaped(&picture.scalar);
            html += &format!(
                "<figure><img alt=\"{caption} on {}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}</figcaption></figure>\n",
                escaped(shape)
            );
        }
        html += "</div>\n";
    }
    Ok(html)
}

/// What the intrinsic encodings reach beside the baseline of coordinates.
pub(super) fn scalars_sentence(mesh: &str, runs: &[scalars::Run]) -> String {
    let of_mesh: Vec<&scalars::Run> = runs.iter().filter(|run| run.mesh == mesh).collect();
    let (baseline, ours): (Vec<&scalars::Run>, Vec<&scalars::Run>) =
        of_mesh.iter().partition(|run| run.encoding.starts_with("coordinates"));
    let mut ahead = 0;
    for coordinates in &baseline {
        let is_better = |run: &&scalars::Run| run.bytes <= coordinates.bytes && run.rms <= coordinates.rms;
        ahead += usize::from(ours.iter().any(is_better));
    }
    let least = of_mesh.iter().min_by(|a, b| a.rms.total_cmp(&b.rms));
    let Some(least) = least else { return format!("{mesh}: nothing was measured yet.") };
    format!(
        "{mesh}: of {} runs with coordinates, {ahead} have a run with intrinsic features or levels that is at or below both their \
         bytes and their error. The least error, {} of the range, is that of “{}” in {:.1} kB.",
        baseline.len(),
        percent(least.rms),
        least.encoding,
        least.bytes as f64 / 1000.0
    )
}

/// Which case of a study came closest.
pub(super) fn study_sentence(study: &str, runs: &[Ablated]) -> String {
    let of_study = || runs.iter().filter(|run| run.study == study);
    let by_rms = |a: &&Ablated, b: &&Ablated| a.rms.total_cmp(&b.rms);
    match (of_study().min_by(by_rms), of_study().max_by(by_rms)) {
        (Some(best), Some(worst)) if best.case != worst.case => format!(
            "{study}: closest is “{}” (rms distance {:.2e} in the box after {} epochs), farthest “{}” ({:.2e}).",
            best.case, best.rms, best.epochs, worst.case, worst.rms
        ),
        (Some(only), _) => {
            format!(
                "{study}: “{}” has an rms distance of {:.2e} in the box after {} epochs.",
                only.case, only.rms, only.epochs
            )
        }
        _ => format!("{study}: no runs."),
    }
}

/// How much of an experiment is there.
pub(super) fn coverage(experiment: Experiment, runs: &[Run], scale: &Scale) -> String {
    let name = experiment.name();
    let measured: Vec<&Run> = runs.iter().filter(|run| run.left_out.is_empty()).collect();
    if measured.is_empty() {
        return format!("{name}: nothing was measured yet.");
    }
    let mut shapes: Vec<&str> = measured.iter().map(|run| run.shape.as_str()).collect();
    shapes.sort_unstable();
    shapes.dedup();
    let with = |method: &str| measured.iter().filter(|run| run.method.starts_with(method)).count();
    let expected: Vec<(&str, usize)> = match experiment {
        Experiment::Isosurfacing | Experiment::Winding => {
            let cells = scale.cells.len();
            let names = ["MC + iDR", "MC + isotropic", "ODC", "NDCx"];
            names
                .into_iter()
                .map(|name| (name, cells * shapes.len()))
                .chain([models(scale, &shapes)])
                .collect()
        }
        Experiment::Compression => {
            let of = |sizes: usize| sizes * shapes.len();
            vec![
                ("SMS", of(scale.sms_faces.len())),
                ("NGF", of(scale.ngf_quads.len())),
                ("micromesh", of(scale.micromeshes.len())),
            ]
        }
        _ => ["Draco EB", "Draco MS"]
            .map(|name| (name, scale.draco_faces.len() * scale.draco_bits.len() * shapes.len()))
            .into(),
    };
    let listed: Vec<String> =
        expected.iter().map(|(method, all)| format!("{method} {} of {all}", with(method))).collect();
    format!(
        "{name}: {} runs on {} ({}); {}.",
        measured.len(),
        if shapes.len() == 1 { "1 shape".to_owned() } else { format!("{} shapes", shapes.len()) },
        shapes.join(", "),
        listed.join(", ")
    )
}

fn models(scale: &Scale, shapes: &[&str]) -> (&'static str, usize) {
    // Levels of each size, and a network.
    ("ours", (scale.sizes.len() + 1) * scale.edge_lengths.len() * shapes.len())
}

/// Seconds as one reads them.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.1} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
