//! The tables of docs/compression.md, and plots for every mesh.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use super::MESHES;
use super::hull::Hull;
use super::models::{Kind, ModelRow};
use super::rivals::{Coder, RivalRow, Source};
use crate::document::replace_table;
use crate::plot::error_by_bytes;
use crate::root;

/// An error that models and rivals are compared by, as shares of 1. Some have no place for lengths to be corrected.
struct Compared {
    /// The name of its table and its plots.
    name: &'static str,
    /// Whether there are plots of it: errors of lengths as they are have tables alone.
    is_plotted: bool,
    /// What is plotted.
    axis: &'static str,
    digits: usize,
    model: fn(&ModelRow) -> Option<f64>,
    rival: fn(&RivalRow) -> f64,
}

const COMPARED: [Compared; 5] = [
    Compared {
        name: "distance",
        is_plotted: true,
        axis: "mean distance, % of the diagonal",
        digits: 5,
        model: |row| Some(row.mean),
        rival: |row| row.mean,
    },
    Compared {
        name: "geodesics",
        is_plotted: false,
        axis: "error of geodesic distances, %",
        digits: 4,
        model: |row| Some(row.geodesic),
        rival: |row| row.geodesic,
    },
    Compared {
        name: "geodesics corrected",
        is_plotted: true,
        axis: "error of geodesic distances, lengths corrected, %",
        digits: 4,
        model: |row| row.geodesic_corrected,
        rival: |row| row.geodesic.min(row.geodesic_corrected),
    },
    Compared {
        name: "eigenvalues",
        is_plotted: false,
        axis: "error of eigenvalues, %",
        digits: 4,
        model: |row| Some(row.eigenvalues),
        rival: |row| row.eigenvalues,
    },
    Compared {
        name: "eigenvalues corrected",
        is_plotted: true,
        axis: "error of eigenvalues, lengths corrected, %",
        digits: 4,
        model: |row| row.eigenvalues_corrected,
        rival: |row| row.eigenvalues.min(row.eigenvalues_corrected),
    },
];

/// Coarse meshes that are one method.
struct Rival {
    name: &'static str,
    is_member: fn(&RivalRow) -> bool,
}

const RIVALS: [Rival; 3] = [
    Rival { name: "Draco, decimated meshes", is_member: |row| row.source != Source::Base },
    Rival {
        name: "Draco, base meshes",
        is_member: |row| row.source == Source::Base && row.coder == Coder::Draco,
    },
    Rival { name: "ndf, base meshes alone", is_member: |row| row.coder == Coder::Ndf },
];

/// Writes the tables and the plots.
pub(super) fn write(folder: &Path, models: &[ModelRow], rivals: &[RivalRow]) -> Result<(), String> {
    let mut models = models.to_vec();
    models
        .sort_by_key(|row| (place(&row.mesh), row.model == Kind::Levels, row.base_faces, row.model as usize));
    let document = root().join("docs/compression.md");
    let replace = |name: &str, table: &str| {
        replace_table(&document, &format!("cargo xtask compression, {name}"), table)
    };
    replace("networks", &networks_table(&models))?;
    replace("levels", &levels_table(&models))?;
    for compared in &COMPARED {
        replace(compared.name, &compared_table(compared, &models, rivals))?;
    }
    for mesh in MESHES {
        let models: Vec<&ModelRow> = models.iter().filter(|row| row.mesh == *mesh).collect();
        let rivals: Vec<&RivalRow> = rivals.iter().filter(|row| row.mesh == *mesh).collect();
        if models.is_empty() || rivals.is_empty() {
            continue;
        }
        for compared in COMPARED.iter().filter(|compared| compared.is_plotted) {
            let stem = format!("{}_{}", stem(mesh), compared.name.replace(' ', "_"));
            let file = folder.join(stem).with_extension("svg");
            let svg =
                plot(compared, mesh, &models, &rivals).map_err(|e| format!("{}: {e}", file.display()))?;
            fs::write(&file, svg).map_err(|e| format!("{}: {e}", file.display()))?;
        }
    }
    Ok(())
}

/// Where a mesh stands in the tables.
fn place(mesh: &str) -> usize {
    MESHES.iter().position(|m| *m == mesh).unwrap_or(MESHES.len())
}

fn stem(mesh: &str) -> &str {
    mesh.split('.').next().unwrap_or(mesh)
}

fn percent(share: f64, digits: usize) -> String {
    format!("{:.digits$} %", 100.0 * share)
}

fn networks_table(models: &[ModelRow]) -> String {
    let mut table = String::from(
        "| mesh | base faces | numbers | base | features | network | file | mean | largest | geodesics | eigenvalues |\n\
         |---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for row in models {
        let ModelRow { mesh, base_faces, base, features, network, bytes, .. } = row;
        let numbers = match row.model {
            Kind::Single => "single",
            Kind::Rounded => "rounded",
            Kind::Levels => continue,
        };
        let _ = writeln!(
            table,
            "| {mesh} | {base_faces} | {numbers} | {base} | {features} | {network} | {bytes} | {} | {} | {} | {} |",
            percent(row.mean, 5),
            percent(row.max, 3),
            percent(row.geodesic, 4),
            percent(row.eigenvalues, 4),
        );
    }
    table
}

fn levels_table(models: &[ModelRow]) -> String {
    let mut table = String::from(
        "| mesh | size | base faces | base | levels | file | mean | largest | normals | area | flipped | geodesics | corrected | eigenvalues | corrected | fit |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for row in models {
        let ModelRow { mesh, base_faces, base, levels, bytes, .. } = row;
        let Some(size) = row.size else { continue };
        let some = |share: Option<f64>, digits| share.map(|share| percent(share, digits)).unwrap_or_default();
        let _ = writeln!(
            table,
            "| {mesh} | {size} | {base_faces} | {base} | {levels} | {bytes} | {} | {} | {:.2}° | {} | {} | {} | {} | {} | {} | {:.1} s |",
            percent(row.mean, 5),
            percent(row.max, 3),
            row.normal_degrees.unwrap_or(f64::NAN),
            some(row.area, 3),
            some(row.flipped, 3),
            percent(row.geodesic, 4),
            some(row.geodesic_corrected, 4),
            percent(row.eigenvalues, 4),
            some(row.eigenvalues_corrected, 4),
            row.seconds.unwrap_or(f64::NAN),
        );
    }
    table
}

/// The bytes of every method at the errors of models.
fn compared_table(compared: &Compared, models: &[ModelRow], rivals: &[RivalRow]) -> String {
    let mut table = String::from("| mesh | model | file | error |");
    RIVALS.iter().for_each(|rival| table += &format!(" {} |", rival.name));
    table += "\n|---|---|--:|--:|--:|--:|--:|\n";
    for row in models {
        let kind = match row.model {
            Kind::Single => continue,
            Kind::Rounded => "network",
            Kind::Levels => "levels",
        };
        let Some(error) = (compared.model)(row) else { continue };
        let ModelRow { mesh, bytes, .. } = row;
        let _ = write!(table, "| {mesh} | {kind} | {bytes} | {} |", percent(error, compared.digits));
        for rival in &RIVALS {
            let hull = hull(compared, rival, rivals.iter().filter(|r| r.mesh == *mesh));
            let cell = hull.bytes(error).map(|found| found.beside(*bytes)).unwrap_or_default();
            let _ = write!(table, " {cell} |");
        }
        table.push('\n');
    }
    table
}

fn hull<'a>(compared: &Compared, rival: &Rival, rows: impl Iterator<Item = &'a RivalRow>) -> Hull {
    Hull::new(rows.filter(|r| (rival.is_member)(r)).map(|r| (r.bytes as f64, (compared.rival)(r))))
}

/// An error against bytes: of models what was measured, of rivals the hull.
fn plot(
    compared: &Compared,
    mesh: &str,
    models: &[&ModelRow],
    rivals: &[&RivalRow],
) -> Result<String, Box<dyn std::error::Error>> {
    let of_models = |kind: Kind| {
        let rows = models.iter().filter(|row| row.model == kind);
        let points = rows.filter_map(|row| Some((row.bytes as f64, 100.0 * (compared.model)(row)?)));
        points.collect::<Vec<_>>()
    };
    let mut lines = vec![
        ("ndf, levels".to_owned(), of_models(Kind::Levels)),
        ("ndf, network".to_owned(), of_models(Kind::Rounded)),
    ];
    for rival in &RIVALS {
        let hull = hull(compared, rival, rivals.iter().copied());
        let points = hull.corners().map(|(bytes, error)| (bytes, 100.0 * error)).collect();
        lines.push((rival.name.to_owned(), points));
    }
    error_by_bytes(stem(mesh), compared.axis, &lines)
}
