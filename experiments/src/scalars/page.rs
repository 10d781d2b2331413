//! The table of docs/scalars.md, and a plot for every mesh.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use super::Run;
use crate::document::replace_table;
use crate::plot::{Line, error_by_bytes};
use crate::root;

/// Writes the plots.
pub(super) fn write(folder: &Path, runs: &[Run]) -> Result<(), String> {
    for mesh in meshes(runs) {
        let of_mesh: Vec<&Run> = runs.iter().filter(|run| run.mesh == mesh).collect();
        let file = folder.join(mesh).with_extension("svg");
        fs::write(&file, plot(mesh, &of_mesh)?).map_err(|e| format!("{}: {e}", file.display()))?;
    }
    Ok(())
}

/// Writes the table of docs/scalars.md.
pub(super) fn write_table(runs: &[Run]) -> Result<(), String> {
    replace_table(&root().join("docs/scalars.md"), "cargo xtask scalars", &table(&meshes(runs), runs))
}

fn meshes(runs: &[Run]) -> Vec<&str> {
    let mut meshes: Vec<&str> = runs.iter().map(|run| run.mesh.as_str()).collect();
    meshes.sort_unstable();
    meshes.dedup();
    meshes
}

fn table(meshes: &[&str], runs: &[Run]) -> String {
    let mut table = String::from(
        "| mesh | training | encoding | numbers | bytes | rms error | largest error | epochs |\n\
         |---|---|---|---|--:|--:|--:|--:|\n",
    );
    for mesh in meshes {
        for run in runs.iter().filter(|run| run.mesh == *mesh) {
            let Run { mesh, training, encoding, numbers, bytes, rms, max, epochs, .. } = run;
            let (rms, max) = (100.0 * rms, 100.0 * max);
            let _ = writeln!(
                table,
                "| {mesh} | {training} | {encoding} | {numbers} | {bytes} | {rms:.3} % | {max:.2} % | {epochs} |"
            );
        }
    }
    table
}

/// Error against bytes. Runs whose names begin alike are a line.
fn plot(title: &str, runs: &[&Run]) -> Result<String, String> {
    let mut lines: Vec<Line> = Vec::new();
    for run in runs {
        let (kind, point) = (kind(run), (run.bytes as f64, 100.0 * run.rms));
        match lines.iter_mut().find(|(name, _)| *name == kind) {
            Some((_, points)) => points.push(point),
            None => lines.push((kind, vec![point])),
        }
    }
    lines.iter_mut().for_each(|(_, points)| points.sort_by(|a, b| a.0.total_cmp(&b.0)));
    let title = format!("{title}: ten eigenfunctions");
    error_by_bytes(&title, "rms error, % of the range", &lines).map_err(|e| e.to_string())
}

/// What a run has in common with others of its line.
fn kind(run: &Run) -> String {
    let mut parts = run.encoding.split(", ");
    let mut kind = parts.next().unwrap_or_default().to_owned();
    // The second part is the size.
    for part in parts.skip(1) {
        kind += ", ";
        kind += part;
    }
    if run.training == "default" && run.numbers == "single" {
        kind += ", single precision";
    }
    if run.training != "default" {
        kind += &format!(" ({} preset)", run.training);
    }
    kind
}
