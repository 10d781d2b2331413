//! What models weigh and what that costs, beside decimated meshes compressed by Draco or not at all.

mod page;
mod reference;
mod rivals;

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use ndf::{EdgeLength, Fit, ModelExt, OpenOptions, Settings};
use ndf_mesh::io::read_mesh;
use ndf_model::file::SectionSizes;
use serde::{Deserialize, Serialize};

use crate::root;
use crate::rows::{Row, Rows};
use reference::{Errors, Reference};

const MESHES: &[&str] = &[
    "armadillo_86k.obj",
    "skull_100k.obj",
    "rind_wide_g7.ply",
    "rocker-arm.obj",
    "fertility_9k.off",
    "bunny_7k.off",
    "casting.off",
    "spot.obj",
];

/// What to measure.
#[derive(Args)]
pub(crate) struct Options {
    /// The folder with the meshes
    #[arg(long, default_value = "../shared/data/mesh")]
    data: PathBuf,
    /// Meshes of the folder [default: eight]
    #[arg(long = "mesh")]
    meshes: Vec<String>,
    /// Faces of the base meshes; those of more faces than the mesh has are left out
    #[arg(long, value_delimiter = ',', default_values_t = [500, 1_000, 2_000, 4_000, 8_000, 16_000, 32_000])]
    base_faces: Vec<u32>,
    /// How numbers are kept
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Numbers::Rounded, Numbers::Single])]
    numbers: Vec<Numbers>,
    /// A Python interpreter with numpy and DracoPy (see experiments/peers/draco.py); without it, meshes are not
    /// measured beside models
    #[arg(long)]
    python: Option<PathBuf>,
    /// Relative edge length of the meshes on which models are measured; with another than the default, rows are printed
    /// and not kept
    #[arg(long, default_value_t = EDGE_LENGTH)]
    edge_length: f64,
    /// Leave out what was measured before
    #[arg(long)]
    missing: bool,
}

/// How a model keeps its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Numbers {
    /// In single precision
    Single,
    /// As the default preset
    Rounded,
}

impl Numbers {
    fn set(self, settings: &mut Settings) {
        if self == Self::Single {
            settings.precision = None;
        }
    }
}

/// Relative edge length of the meshes of the rows that are kept.
const EDGE_LENGTH: f64 = 0.005;

/// A model: bytes of its parts, and errors as shares of 1.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct ModelRow {
    mesh: String,
    base_faces: u32,
    numbers: Numbers,
    base: usize,
    features: usize,
    network: usize,
    bytes: usize,
    mean: f64,
    max: f64,
    geodesic: f64,
    eigenvalues: f64,
}

impl Row for ModelRow {
    fn key(&self) -> String {
        model_key(&self.mesh, self.base_faces, self.numbers)
    }
}

fn model_key(mesh: &str, base_faces: u32, numbers: Numbers) -> String {
    format!("{mesh} {base_faces} {numbers:?}")
}

/// A decimated mesh: its sizes and errors.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct RivalRow {
    mesh: String,
    faces: usize,
    edgebreaker: usize,
    sequential: usize,
    plain: usize,
    mean: f64,
    max: f64,
    geodesic: f64,
    eigenvalues: f64,
}

impl Row for RivalRow {
    fn key(&self) -> String {
        rivals::key(&self.mesh, self.faces)
    }
}

/// Measures what is asked for and makes docs/compression.md again.
pub(crate) fn run(options: &Options) -> Result<(), String> {
    let folder = root().join("docs/compression");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut models: Rows<ModelRow> = Rows::open(folder.join("models.csv"))?;
    let mut rivals: Rows<RivalRow> = Rows::open(folder.join("decimated.csv"))?;
    let all: Vec<String> = MESHES.iter().map(|&m| m.to_owned()).collect();
    for name in if options.meshes.is_empty() { &all } else { &options.meshes } {
        let path = root().join(&options.data).join(name);
        let say = |e: &dyn std::fmt::Display| format!("{name}: {e}");
        let mesh = read_mesh(&path).map_err(|e| say(&e))?.mesh;
        let faces = mesh.face_count();
        let mut jobs: Vec<(u32, Numbers)> = Vec::new();
        for &numbers in &options.numbers {
            let sizes = options.base_faces.iter().filter(|&&base_faces| (base_faces as usize) < faces);
            jobs.extend(sizes.map(|&base_faces| (base_faces, numbers)));
        }
        jobs.retain(|&(f, n)| !(options.missing && models.contains(&model_key(name, f, n))));
        if jobs.is_empty() && options.python.is_none() {
            continue;
        }
        let reference = Reference::new(mesh).map_err(|e| say(&e))?;
        if let Some(python) = &options.python {
            rivals::measured(name, &reference, python, options.missing, &mut rivals).map_err(|e| say(&e))?;
        }
        for (base_faces, numbers) in jobs {
            let row = model(name, &path, &reference, base_faces, numbers, options.edge_length)
                .map_err(|e| say(&e))?;
            eprintln!("{row:?}");
            if options.edge_length == EDGE_LENGTH {
                models.put(row)?;
            }
        }
        page::write(&folder, models.all(), rivals.all())?;
    }
    page::write(&folder, models.all(), rivals.all())
}

fn model(
    name: &str,
    path: &Path,
    reference: &Reference,
    base_faces: u32,
    numbers: Numbers,
    edge_length: f64,
) -> Result<ModelRow, String> {
    let opened = ndf::open(path, &OpenOptions::default()).map_err(|e| e.to_string())?;
    let fit = Fit::new(&opened).base_faces(base_faces as usize).with(|settings| numbers.set(settings));
    let model = fit.run().map_err(|e| e.to_string())?.model;
    let surface = model.extract(EdgeLength::Relative(edge_length)).map_err(|e| e.to_string())?.mesh;
    let Errors { mean, max, geodesic, eigenvalues } = reference.errors(&surface)?;
    let SectionSizes { base, features, network, total: bytes, .. } = model.section_sizes();
    let mesh = name.to_owned();
    Ok(ModelRow {
        mesh,
        base_faces,
        numbers,
        base,
        features,
        network,
        bytes,
        mean,
        max,
        geodesic,
        eigenvalues,
    })
}
