//! Scalar fields stored by different encodings: error against bytes (supplement, §2.6 and Fig. 21).
//!
//! Every run leaves a line in a CSV file, in the place of an earlier run of the same name; the page's table and the plots
//! are made from that file, so that runs can be made a few at a time.

mod page;

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use ndf::analysis::mode_scalars;
use ndf::{EdgeLength, Field, Fit, ModelExt, OpenOptions};
use ndf_core::progress::NoProgress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::TriangleMesh;
use ndf_mesh::io::VertexScalars;
use ndf_model::Model;
use ndf_model::scalars::ScalarShape;
use ndf_model::{ChannelIndex, NetworkShape};
use ndf_spectral::{LaplaceBeltrami, ModeOptions, OperatorOptions};
use ndf_train::scalars::{ScalarBudget, ScalarFit, ScalarLevelOptions, ScalarSettings, fit, fit_levels};
use serde::{Deserialize, Serialize};

use crate::root;
use crate::rows::{Row, Rows};

/// Edge length of the mesh whose eigenfunctions are learned, in the box of side 3.
const EDGE_LENGTH: f64 = 0.02;
/// Eigenfunctions learned: those after the constant one.
const FUNCTIONS: usize = 10;
/// Octaves of the baseline.
const OCTAVES: usize = 8;

/// How to train.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Preset {
    /// The default settings
    Default,
    /// The supplement's training
    Paper,
}

/// What to run.
#[derive(Args)]
pub(crate) struct Options {
    /// Meshes whose eigenfunctions are learned; none to make the page again from earlier runs
    #[arg(long, num_args = 0..)]
    mesh: Vec<PathBuf>,
    /// How to train
    #[arg(long, value_enum, default_value = "default")]
    preset: Preset,
    /// Only the encodings whose names contain one of these
    #[arg(long)]
    only: Vec<String>,
    /// Bits of the features, not those of the settings
    #[arg(long)]
    bits: Option<u32>,
    /// Keep numbers in single precision
    #[arg(long)]
    lossless: bool,
    /// Where runs and plots go; the table of docs/scalars.md is of the default folder
    #[arg(long, default_value = FOLDER)]
    out: PathBuf,
}

/// The folder of the runs that are kept.
const FOLDER: &str = "docs/scalars";

impl Options {
    /// Some encodings on one mesh, elsewhere than in the documentation.
    pub(crate) fn quick(mesh: PathBuf, only: &[&str], out: PathBuf) -> Self {
        let only = only.iter().map(|&name| name.to_owned()).collect();
        Self { mesh: vec![mesh], preset: Preset::Default, only, bits: None, lossless: false, out }
    }
}

/// An encoding to be tried.
struct Case {
    label: String,
    form: Form,
}

/// How fields are stored.
enum Form {
    Network(ScalarSettings),
    Levels(ScalarLevelOptions),
}

/// Prices of a bit, in squares of the range; the third is the default.
const PRICES: [f64; 5] = [1e-7, 1e-8, 1e-9, 2e-10, 4e-11];

fn cases(preset: Preset) -> Vec<Case> {
    let start = match preset {
        Preset::Default => ScalarSettings::default(),
        Preset::Paper => ScalarSettings::paper(),
    };
    let case = |label: String, change: &dyn Fn(&mut ScalarShape)| {
        let mut settings = start.clone();
        change(&mut settings.shape);
        Case { label, form: Form::Network(settings) }
    };
    let intrinsic =
        |d: usize| case(format!("intrinsic, d = {d}"), &|s| (s.network.features, s.network.octaves) = (d, 0));
    let both = |d: usize| case(format!("intrinsic with octaves, d = {d}"), &|s| s.network.features = d);
    let coordinates = |width: usize| {
        case(format!("coordinates, {width} neurons"), &|s| {
            let activation = s.network.activation;
            s.network = NetworkShape { features: 0, octaves: OCTAVES, hidden: vec![width; 2], activation };
        })
    };
    let mut all: Vec<Case> = [2, 4, 8].map(intrinsic).into();
    match preset {
        Preset::Paper => all.push(coordinates(32)),
        Preset::Default => {
            all.extend([1, 2, 4, 8].map(both));
            all.extend([16, 32, 64, 96, 128].map(coordinates));
            for mut case in [intrinsic(4), coordinates(32)] {
                if let Form::Network(settings) = &mut case.form {
                    settings.shape.index = ChannelIndex::Input;
                }
                case.label += ", index as input";
                all.push(case);
            }
            all.extend(PRICES.map(|price| {
                let budget = ScalarBudget::Price(price);
                let options = ScalarLevelOptions { budget, ..ScalarLevelOptions::default() };
                Case { label: format!("levels, price {price:.0e}"), form: Form::Levels(options) }
            }));
        }
    }
    all
}

/// A line of the file.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Run {
    pub(crate) mesh: String,
    training: String,
    pub(crate) encoding: String,
    /// How numbers are kept.
    numbers: String,
    /// In the model file.
    pub(crate) bytes: usize,
    /// Root of the mean squared error, as a share of the functions' ranges.
    pub(crate) rms: f64,
    /// The largest error.
    max: f64,
    epochs: usize,
    seconds: f64,
}

impl Row for Run {
    fn key(&self) -> String {
        let Self { mesh, training, encoding, numbers, .. } = self;
        format!("{mesh}; {training}; {encoding}; {numbers}")
    }
}

/// Makes the runs that are asked for, and the page.
pub(crate) fn run(options: &Options) -> Result<(), String> {
    let folder = root().join(&options.out);
    let say = |e: std::io::Error| format!("{}: {e}", folder.display());
    fs::create_dir_all(&folder).map_err(say)?;
    let mut runs: Rows<Run> = Rows::open(folder.join("runs.csv"))?;
    let training = options.preset.to_possible_value().map_or_else(String::new, |v| v.get_name().into());
    for path in &options.mesh {
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let (model, mesh, functions) = eigenfunctions(path, &name)?;
        for Case { label, form } in cases(options.preset) {
            if !options.only.is_empty() && !options.only.iter().any(|only| label.contains(only)) {
                continue;
            }
            let (found, numbers) = match form {
                Form::Network(mut settings) => {
                    settings.bits = if options.lossless { None } else { options.bits.or(settings.bits) };
                    let numbers = settings.bits.map_or("single".into(), |bits| format!("{bits} bits"));
                    (fit(&model, &mesh, &functions, &settings, &NoProgress), numbers)
                }
                Form::Levels(options) => {
                    (fit_levels(&model, &mesh, &functions, &options, &NoProgress), "integers".into())
                }
            };
            let ScalarFit { fields, report } = found.map_err(|e| format!("{name}: {e}"))?;
            let overall = report.overall();
            let run = Run {
                mesh: name.clone(),
                training: training.clone(),
                encoding: label,
                numbers,
                bytes: fields.stored_bytes(),
                rms: overall.rms,
                max: overall.max,
                epochs: report.epochs,
                seconds: report.seconds,
            };
            eprintln!("{run:?}");
            runs.put(run)?;
            page::write(&folder, runs.all())?;
        }
    }
    page::write(&folder, runs.all())?;
    if options.out == Path::new(FOLDER) { page::write_table(runs.all()) } else { Ok(()) }
}

/// A model of a mesh, with default settings, and the first eigenfunctions on a mesh extracted from it. The model is kept
/// beside the build for later runs.
fn eigenfunctions(path: &Path, name: &str) -> Result<(Model, TriangleMesh, Vec<VertexScalars>), String> {
    let say = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let folder = root().join("target/experiments/scalars");
    let kept = folder.join(name).with_extension("ndf");
    let model = match Model::read(&kept) {
        Ok(model) => model,
        Err(_) => {
            let opened = ndf::open(path, &OpenOptions::default()).map_err(|e| say(&e))?;
            let model = Fit::new(&opened).field(Field::Network).run().map_err(|e| say(&e))?.model;
            fs::create_dir_all(&folder).map_err(|e| say(&e))?;
            fs::write(&kept, model.to_bytes()).map_err(|e| say(&e))?;
            model
        }
    };
    let mesh = model.extract(EdgeLength::Relative(EDGE_LENGTH)).map_err(|e| say(&e))?.mesh;
    let laplacian = LaplaceBeltrami::new(&IntrinsicMesh::from_mesh(&mesh), OperatorOptions::default());
    let options = ModeOptions { count: FUNCTIONS + 1, ..ModeOptions::default() };
    let modes = laplacian.and_then(|l| l.modes(&options, &NoProgress)).map_err(|e| say(&e))?;
    let functions = mode_scalars(&modes).split_off(1);
    Ok((model, mesh.into_triangle_mesh(), functions))
}
