//! What models weigh and what that costs, beside coarse meshes in few bytes.

mod hull;
mod models;
mod page;
mod reference;
mod rivals;

use std::fs;
use std::path::PathBuf;

use clap::Args;
use ndf::{BaseSource, OpenOptions, Opened};
use ndf_cli::commands::sample::Shape;
use ndf_mesh::ManifoldMesh;

use crate::root;
use crate::rows::Rows;
use models::{Kind, ModelRow};
use reference::Reference;
use rivals::RivalRow;

const MESHES: &[&str] = &[
    "armadillo_86k.obj",
    "skull_100k.obj",
    "rind_wide_g7.ply",
    "rocker-arm.obj",
    "fertility_9k.off",
    "bunny_7k.off",
    "casting.off",
    "spot.obj",
    TREFOIL,
    CUBE,
];

/// Meshes that no file holds: those of `ndf sample mesh --shape`.
const TREFOIL: &str = "trefoil";
const CUBE: &str = "cube";

/// What to measure.
#[derive(Args)]
pub(crate) struct Options {
    /// The folder with the meshes
    #[arg(long, default_value = "../shared/data/mesh")]
    data: PathBuf,
    /// Meshes of the folder, trefoil or cube [default: eight, and these two]
    #[arg(long = "mesh")]
    meshes: Vec<String>,
    /// Models; none without a value
    #[arg(long, value_enum, value_delimiter = ',', num_args = 0.., default_values_t = [Kind::Rounded, Kind::Single, Kind::Levels])]
    models: Vec<Kind>,
    /// Faces of the base meshes of networks; those of more faces than the mesh has are left out
    #[arg(long, value_delimiter = ',', default_values_t = [500, 1_000, 2_000, 4_000, 8_000, 16_000, 32_000])]
    base_faces: Vec<usize>,
    /// Bytes of models of levels
    #[arg(long, value_delimiter = ',', default_values_t = [3_000, 4_500, 6_500, 9_000, 13_000, 17_500, 26_000])]
    sizes: Vec<usize>,
    /// A Python interpreter with numpy, DracoPy and fast-simplification (see experiments/peers/draco.py); without it,
    /// meshes are not measured beside models
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

/// Relative edge length of the meshes of the rows that are kept.
const EDGE_LENGTH: f64 = 0.005;

/// Measures what is asked for and makes docs/compression.md again.
pub(crate) fn run(options: &Options) -> Result<(), String> {
    let folder = root().join("docs/compression");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut models: Rows<ModelRow> = Rows::open(folder.join("models.csv"))?;
    let mut rivals: Rows<RivalRow> = Rows::open(folder.join("rivals.csv"))?;
    let all: Vec<String> = MESHES.iter().map(|&m| m.to_owned()).collect();
    for name in if options.meshes.is_empty() { &all } else { &options.meshes } {
        let say = |e: &dyn std::fmt::Display| format!("{name}: {e}");
        let opened = opened(name, options).map_err(|e| say(&e))?;
        let BaseSource::Manifold(mesh) = &opened.base else { return Err(say(&"it is no clean manifold")) };
        let mut jobs: Vec<(Kind, usize)> = Vec::new();
        for &kind in &options.models {
            let asked = if kind == Kind::Levels { &options.sizes } else { &options.base_faces };
            let fits = |&&asked: &&usize| kind == Kind::Levels || asked < mesh.face_count();
            jobs.extend(asked.iter().filter(fits).map(|&asked| (kind, asked)));
        }
        jobs.retain(|&(kind, asked)| !(options.missing && models.contains(&models::key(name, kind, asked))));
        let mut rival_jobs = if options.python.is_some() { rivals::jobs(name, mesh) } else { Vec::new() };
        rival_jobs.retain(|job| !(options.missing && rivals.contains(&job.key(name))));
        if jobs.is_empty() && rival_jobs.is_empty() {
            continue;
        }
        let reference = Reference::new(ManifoldMesh::clone(mesh)).map_err(|e| say(&e))?;
        if let Some(python) = &options.python {
            rivals::measure(name, &opened, &reference, python, &rival_jobs, &mut rivals)
                .map_err(|e| say(&e))?;
        }
        for job in jobs {
            let row =
                models::measured(name, &opened, &reference, job, options.edge_length).map_err(|e| say(&e))?;
            eprintln!("{row:?}");
            if options.edge_length == EDGE_LENGTH {
                models.put(row)?;
            }
        }
        page::write(&folder, models.all(), rivals.all())?;
    }
    page::write(&folder, models.all(), rivals.all())
}

/// The surface of a name.
fn opened(name: &str, options: &Options) -> Result<Opened, ndf::OpenError> {
    match name {
        TREFOIL => ndf::open_mesh(Shape::Trefoil.mesh(None)),
        CUBE => ndf::open_mesh(Shape::Cube.mesh(None)),
        file => ndf::open(root().join(&options.data).join(file), &OpenOptions::default()),
    }
}
