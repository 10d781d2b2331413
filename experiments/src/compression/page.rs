//! The tables of docs/compression.md, and a plot for every mesh.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use super::{MESHES, ModelRow, Numbers, RivalRow};
use crate::document::replace_table;
use crate::plot::error_by_bytes;
use crate::root;

/// Writes the tables and the plots.
pub(super) fn write(folder: &Path, models: &[ModelRow], rivals: &[RivalRow]) -> Result<(), String> {
    let mut models = models.to_vec();
    models.sort_by_key(|row| (place(&row.mesh), row.base_faces, row.numbers as usize));
    let mut rivals = rivals.to_vec();
    rivals.sort_by_key(|row| (place(&row.mesh), row.faces));
    let document = root().join("docs/compression.md");
    replace_table(&document, "cargo xtask compression, models", &models_table(&models))?;
    replace_table(&document, "cargo xtask compression, rivals", &rivals_table(&models, &rivals))?;
    for mesh in MESHES {
        let models: Vec<&ModelRow> = models.iter().filter(|row| row.mesh == *mesh).collect();
        let rivals: Vec<&RivalRow> = rivals.iter().filter(|row| row.mesh == *mesh).collect();
        if !models.is_empty() && !rivals.is_empty() {
            let stem = mesh.split('.').next().unwrap_or(mesh);
            let file = folder.join(stem).with_extension("svg");
            let svg = plot(stem, &models, &rivals).map_err(|e| format!("{}: {e}", file.display()))?;
            fs::write(&file, svg).map_err(|e| format!("{}: {e}", file.display()))?;
        }
    }
    Ok(())
}

/// Where a mesh stands in the tables.
fn place(mesh: &str) -> usize {
    MESHES.iter().position(|m| *m == mesh).unwrap_or(MESHES.len())
}

fn models_table(models: &[ModelRow]) -> String {
    let mut table = String::from(
        "| mesh | base faces | numbers | base | features | network | file | mean | largest | geodesics | eigenvalues |\n\
         |---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for row in models {
        let ModelRow { mesh, base_faces, numbers, base, features, network, bytes, .. } = row;
        let numbers = match numbers {
            Numbers::Single => "single",
            Numbers::Rounded => "rounded",
        };
        let _ = writeln!(
            table,
            "| {mesh} | {base_faces} | {numbers} | {base} | {features} | {network} | {bytes} | {:.5} % | {:.3} % | {:.4} % | {:.4} % |",
            100.0 * row.mean,
            100.0 * row.max,
            100.0 * row.geodesic,
            100.0 * row.eigenvalues,
        );
    }
    table
}

fn rivals_table(models: &[ModelRow], rivals: &[RivalRow]) -> String {
    let mut table = String::from(
        "| mesh | base faces | model | geodesics | edgebreaker | sequential | plain mesh | mean distance | edgebreaker |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for row in models.iter().filter(|row| row.numbers == Numbers::Rounded) {
        let rivals: Vec<&RivalRow> = rivals.iter().filter(|rival| rival.mesh == row.mesh).collect();
        let equal = |error: fn(&RivalRow) -> f64, wanted: f64, bytes: fn(&RivalRow) -> usize| {
            let known: Vec<(f64, f64)> = rivals.iter().map(|r| (error(r), bytes(r) as f64)).collect();
            at_equal_error(&known, wanted)
        };
        let geodesic = |bytes| equal(|r| r.geodesic, row.geodesic, bytes);
        let _ = writeln!(
            table,
            "| {} | {} | {} | {:.4} % | {} | {} | {} | {:.5} % | {} |",
            row.mesh,
            row.base_faces,
            row.bytes,
            100.0 * row.geodesic,
            geodesic(|r| r.edgebreaker),
            geodesic(|r| r.sequential),
            geodesic(|r| r.plain),
            100.0 * row.mean,
            equal(|r| r.mean, row.mean, |r| r.edgebreaker),
        );
    }
    table
}

/// The bytes of a decimated mesh with this error, from (error, bytes) of some, the smallest first: between the first two
/// neighbours that enclose it, on a straight line of logarithms.
fn at_equal_error(known: &[(f64, f64)], error: f64) -> String {
    let Some((&(_, smallest), &(_, largest))) = known.first().zip(known.last()) else { return String::new() };
    if known[0].0 <= error {
        return format!("< {smallest:.0}");
    }
    for pair in known.windows(2) {
        let ((coarse, few), (fine, many)) = (pair[0], pair[1]);
        if coarse > error && error >= fine {
            let t = (coarse / error).ln() / (coarse / fine).ln();
            return format!("{:.0}", few * (many / few).powf(t));
        }
    }
    format!("> {largest:.0}")
}

/// Error of geodesic distances against bytes.
fn plot(
    title: &str,
    models: &[&ModelRow],
    rivals: &[&RivalRow],
) -> Result<String, Box<dyn std::error::Error>> {
    let of_models = |numbers: Numbers| {
        let rows = models.iter().filter(|row| row.numbers == numbers);
        rows.map(|row| (row.bytes as f64, 100.0 * row.geodesic)).collect::<Vec<_>>()
    };
    let of_rivals = |bytes: fn(&RivalRow) -> usize| {
        rivals.iter().map(|row| (bytes(row) as f64, 100.0 * row.geodesic)).collect::<Vec<_>>()
    };
    let lines = [
        ("ndf, rounded", of_models(Numbers::Rounded)),
        ("ndf, single precision", of_models(Numbers::Single)),
        ("Draco, edgebreaker", of_rivals(|r| r.edgebreaker)),
        ("Draco, sequential", of_rivals(|r| r.sequential)),
        ("plain mesh", of_rivals(|r| r.plain)),
    ];
    let lines = lines.map(|(name, points)| (name.to_owned(), points));
    error_by_bytes(title, "error of geodesic distances, %", &lines)
}
