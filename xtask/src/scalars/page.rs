//! The table of docs/scalars.md, and a plot for every mesh.

use std::fmt::Write as _;
use std::path::Path;

use plotters::prelude::*;

use super::Run;
use crate::document::replace_table;
use crate::shell::root;

/// Writes the table and the plots.
pub(super) fn write(folder: &Path, runs: &[Run]) -> Result<(), String> {
    let mut meshes: Vec<&str> = runs.iter().map(|run| run.mesh.as_str()).collect();
    meshes.sort_unstable();
    meshes.dedup();
    for mesh in &meshes {
        let of_mesh: Vec<&Run> = runs.iter().filter(|run| run.mesh == *mesh).collect();
        super::write(&folder.join(mesh).with_extension("svg"), &plot(mesh, &of_mesh)?)?;
    }
    replace_table(&root().join("docs/scalars.md"), "cargo xtask scalars", &table(&meshes, runs))
}

fn table(meshes: &[&str], runs: &[Run]) -> String {
    let mut table = String::from(
        "| mesh | training | encoding | bytes (f32) | rms error | largest error | epochs | seconds |\n\
         |---|---|---|--:|--:|--:|--:|--:|\n",
    );
    for mesh in meshes {
        for run in runs.iter().filter(|run| run.mesh == *mesh) {
            let Run { mesh, preset, label, bytes, rms, max, epochs, seconds } = run;
            let (rms, max) = (100.0 * rms, 100.0 * max);
            let _ = writeln!(
                table,
                "| {mesh} | {preset} | {label} | {bytes} | {rms:.3} % | {max:.2} % | {epochs} | {seconds:.1} |"
            );
        }
    }
    table
}

/// Error against bytes, both logarithmically. Runs whose names begin alike are a line.
fn plot(title: &str, runs: &[&Run]) -> Result<String, String> {
    let points = || runs.iter().map(|run| (run.bytes as f64, 100.0 * run.rms));
    let (x0, x1) = points().fold((f64::MAX, 0.0_f64), |(l, m), p| (l.min(p.0), m.max(p.0)));
    let (y0, y1) = points().fold((f64::MAX, 0.0_f64), |(l, m), p| (l.min(p.1), m.max(p.1)));
    let mut svg = String::new();
    let draw = |svg: &mut String| -> Result<(), Box<dyn std::error::Error>> {
        let area = SVGBackend::with_string(svg, (720, 420)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(format!("{title}: ten eigenfunctions"), ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(64)
            .build_cartesian_2d((0.8 * x0..1.25 * x1).log_scale(), (0.7 * y0..1.4 * y1).log_scale())?;
        chart
            .configure_mesh()
            .x_desc("bytes in single precision")
            .y_desc("rms error, % of the range")
            .x_label_formatter(&|x| format!("{:.0} kB", x / 1000.0))
            // Ticks are sums of floats: 0.6000000000000001.
            .y_label_formatter(&|y| format!("{}", (y * 1e6).round() / 1e6))
            .max_light_lines(0)
            .draw()?;
        let mut kinds: Vec<(String, Vec<&Run>)> = Vec::new();
        for run in runs {
            let kind = kind(run);
            match kinds.iter_mut().find(|(name, _)| *name == kind) {
                Some((_, of_kind)) => of_kind.push(run),
                None => kinds.push((kind, vec![run])),
            }
        }
        for (k, (name, mut of_kind)) in kinds.into_iter().enumerate() {
            of_kind.sort_by_key(|run| run.bytes);
            let colour = Palette99::pick(k).to_rgba();
            let points: Vec<(f64, f64)> =
                of_kind.iter().map(|run| (run.bytes as f64, 100.0 * run.rms)).collect();
            chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?;
            chart
                .draw_series(points.iter().map(|&p| Circle::new(p, 4, colour.filled())))?
                .label(name)
                .legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled()));
        }
        chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK).draw()?;
        area.present()?;
        Ok(())
    };
    draw(&mut svg).map_err(|e| e.to_string())?;
    Ok(svg)
}

/// What a run has in common with others of its line.
fn kind(run: &Run) -> String {
    let mut parts = run.label.split(", ");
    let mut kind = parts.next().unwrap_or_default().to_owned();
    // The second part is the size.
    for part in parts.skip(1) {
        kind += ", ";
        kind += part;
    }
    if run.preset != "default" {
        kind += &format!(" ({} preset)", run.preset);
    }
    kind
}
