//! Experiments whose results are those of others: the plot of everything, run times and cycle consistency, which are figures of fits,
//! and scalars and ablations, which have commands of their own.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::fits::FitRow;
use super::row::Run;
use super::runs::Runs;
use super::{Experiment, Setup};
use crate::rows::{Row, Rows};
use crate::{ablation, root, scalars};
use ndf_cli::commands::sample::Shape as Built;
use ndf_mesh::io::write_mesh;

/// Writes the files.
pub(super) fn write(setup: &Setup) -> Result<(), String> {
    let mut together = Vec::new();
    for experiment in
        [Experiment::Isosurfacing, Experiment::Winding, Experiment::Compression, Experiment::Draco]
    {
        let of = |run: &Run| Joined { experiment: experiment.name(), ..Joined::from(run) };
        together
            .extend(Runs::open(setup, experiment)?.all().iter().filter(|r| r.left_out.is_empty()).map(of));
    }
    write_rows(&setup.out, Experiment::Plot3d, &together)?;
    let fits: Rows<FitRow> = Rows::open(setup.out.join("fits.csv"))?;
    write_rows(&setup.out, Experiment::Runtimes, fits.all())?;
    let cycles: Vec<&FitRow> = fits.all().iter().filter(|fit| fit.cycle_loss.is_some()).collect();
    write_rows(&setup.out, Experiment::Cycle, &cycles)?;
    let scalars: Rows<scalars::Run> = Rows::open(scalars_folder(setup).join("runs.csv"))?;
    write_rows(&setup.out, Experiment::Scalars, scalars.all())?;
    write_rows(&setup.out, Experiment::Ablations, &ablations(setup)?)
}

/// A point of the plot of everything.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Joined {
    experiment: String,
    shape: String,
    kind: String,
    method: String,
    setting: String,
    bytes: Option<usize>,
    geodesic_share: Option<f64>,
    eigenvalues: Option<f64>,
    seconds_client_geodesics: Option<f64>,
    seconds_client_eigenvalues: Option<f64>,
    load: Option<f64>,
}

impl From<&Run> for Joined {
    fn from(run: &Run) -> Self {
        use super::row::Task;
        Self {
            experiment: String::new(),
            shape: run.shape.clone(),
            kind: run.kind.clone(),
            method: run.method.clone(),
            setting: run.setting.clone(),
            bytes: run.bytes,
            geodesic_share: run.geodesic_share,
            eigenvalues: run.eigenvalues,
            seconds_client_geodesics: run.client_seconds(Task::Geodesics),
            seconds_client_eigenvalues: run.client_seconds(Task::Eigenvalues),
            load: run.load,
        }
    }
}

/// A run of an ablation with what was varied on which mesh.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Ablated {
    pub(super) study: String,
    pub(super) case: String,
    pub(super) rms: f64,
    pub(super) max: f64,
    pub(super) cycle_loss: Option<f64>,
    pub(super) flipped: f64,
    pub(super) epochs: usize,
    pub(super) seconds: f64,
}

/// All runs of ablations: a file is a study.
pub(super) fn ablations(setup: &Setup) -> Result<Vec<Ablated>, String> {
    let mut all = Vec::new();
    for file in files(&ablation_folder(setup), "csv") {
        let study = stem(&file);
        let rows: Rows<ablation::Run> = Rows::open(file)?;
        all.extend(rows.all().iter().map(|run| Ablated {
            study: study.clone(),
            case: run.key(),
            rms: run.rms,
            max: run.max,
            cycle_loss: run.cycle_loss,
            flipped: run.flipped,
            epochs: run.epochs,
            seconds: run.seconds,
        }));
    }
    Ok(all)
}

/// Where runs of scalars are.
pub(super) fn scalars_folder(setup: &Setup) -> PathBuf {
    if setup.scale.is_quick { setup.out.join("scalars-runs") } else { root().join("docs/scalars") }
}

/// Where runs of ablations are.
pub(super) fn ablation_folder(setup: &Setup) -> PathBuf {
    if setup.scale.is_quick { setup.out.join("ablation-runs") } else { root().join("docs/ablation") }
}

/// Files of a folder that end so, in order; none if there is no folder.
pub(super) fn files(folder: &Path, end: &str) -> Vec<PathBuf> {
    let entries =
        fs::read_dir(folder).map_or_else(|_| Vec::new(), |all| all.flatten().map(|e| e.path()).collect());
    let mut files: Vec<PathBuf> =
        entries.into_iter().filter(|path: &PathBuf| path.extension().is_some_and(|e| e == end)).collect();
    files.sort();
    files
}

pub(super) fn stem(file: &Path) -> String {
    file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

fn write_rows<R: Serialize>(folder: &Path, experiment: Experiment, rows: &[R]) -> Result<(), String> {
    let file = folder.join(experiment.name()).with_extension("csv");
    let say = |e: &dyn std::fmt::Display| format!("{}: {e}", file.display());
    let mut writer = csv::Writer::from_path(&file).map_err(|e| say(&e))?;
    rows.iter().try_for_each(|row| writer.serialize(row)).map_err(|e| say(&e))?;
    writer.flush().map_err(|e| say(&e))
}

/// A shape made by code, as a file.
fn trefoil(setup: &Setup) -> Result<PathBuf, String> {
    let file = setup.cache.join("trefoil.ply");
    fs::create_dir_all(&setup.cache).map_err(|e| format!("{}: {e}", setup.cache.display()))?;
    write_mesh(&file, &Built::Trefoil.mesh(None), &[]).map_err(|e| format!("{}: {e}", file.display()))?;
    Ok(file)
}

/// Some encodings of scalars on a shape made by code.
pub(super) fn quick_scalars(setup: &Setup) -> Result<(), String> {
    let only = ["intrinsic, d = 4", "coordinates, 32 neurons", "levels, price 1e-9"];
    scalars::run(&scalars::Options::quick(trefoil(setup)?, &only, scalars_folder(setup)))
}

/// One study on a shape made by code, few epochs.
pub(super) fn quick_ablations(setup: &Setup) -> Result<(), String> {
    ablation::run(&ablation::Options::quick(trefoil(setup)?, 200, ablation_folder(setup)))
}
