//! The ablations of the paper's supplement (Fig. 1, Fig. 2) and our own, as CSV files and a page of plots.
//!
//! Every run leaves a line in the file of its mesh and study, in the place of an earlier run of the same case, so that runs
//! can be made a few at a time; plots and page are made from these files.

mod page;

use std::fs;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use ndf_core::Surface;
use ndf_core::progress::NoProgress;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::repair::{self, RepairOptions};
use ndf_meshing::{BaseMeshOptions, MarchingCubesOptions, base_mesh_of_manifold, marching_cubes};
use ndf_network::Activation;
use ndf_surfaces::MeshSurface;
use ndf_train::{FitReport, LogRecord, ReverseMap, Settings, Trainer, train};
use serde::{Deserialize, Serialize};

use crate::root;
use crate::rows::{Row, Rows};

/// What is varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Study {
    /// Features a base vertex (Fig. 1)
    Features,
    /// Neurons of the hidden layers (Fig. 1)
    Neurons,
    /// Samples of an epoch (Fig. 1)
    Samples,
    /// Activation functions (Fig. 1)
    Activations,
    /// Quality of the projection: epochs a foot is kept, and closest points of coarser copies of the surface (Fig. 2)
    Projection,
    /// Form of the reverse map and weight of the cycle loss
    Cycle,
    /// Weight of the Dirichlet energy
    Smoothness,
    /// Positional encoding of x in g
    Octaves,
    /// The features' learning rate as a multiple of the networks'
    FeatureRate,
    /// The two presets, and the paper's with the reverse map of the other
    Presets,
}

/// What to run.
#[derive(Args)]
pub(crate) struct Options {
    /// What is varied; all if none is named
    studies: Vec<Study>,
    /// Meshes to learn
    #[arg(long, required = true, num_args = 1..)]
    mesh: Vec<PathBuf>,
    /// Faces of the base mesh
    #[arg(long, default_value_t = 4000)]
    base_faces: usize,
    /// Cases to run of these studies, by their names in the tables; the others stay as they are [default: all]
    #[arg(long, num_args = 1..)]
    case: Vec<String>,
    /// Epochs of every run but those of the presets [default: the default preset's]
    #[arg(long)]
    epochs: Option<usize>,
    /// Where the CSV files and the page go
    #[arg(long, default_value = "docs/ablation")]
    out: PathBuf,
}

impl Options {
    /// One study on one mesh, with few epochs.
    pub(crate) fn quick(mesh: PathBuf, epochs: usize, out: PathBuf) -> Self {
        let studies = vec![Study::Features];
        Self { studies, mesh: vec![mesh], base_faces: 1000, case: Vec::new(), epochs: Some(epochs), out }
    }
}

/// One run of a study.
struct Case {
    label: String,
    settings: Settings,
    /// Cells along the longest side of the grid from which the surface is copied, where it is not itself.
    grid: Option<u32>,
}

/// A line of a study's file: what came of a case.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Run {
    case: String,
    /// Distances to the surface, in the box of side 3.
    pub(crate) rms: f64,
    pub(crate) max: f64,
    #[serde(rename = "cycle loss")]
    pub(crate) cycle_loss: Option<f64>,
    /// Share of samples whose normals oppose the surface's.
    pub(crate) flipped: f64,
    pub(crate) epochs: usize,
    pub(crate) seconds: f64,
    #[serde(rename = "of these projecting")]
    seconds_projecting: f64,
    /// Projection losses along the way; empty in files of before they were kept.
    #[serde(default, rename = "epoch:projection loss")]
    curve: Curve,
}

impl Row for Run {
    fn key(&self) -> String {
        self.case.clone()
    }
}

/// Projection loss at an epoch, written as `30:1.2e-5 60:8e-6`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
struct Curve(Vec<(usize, f64)>);

impl From<Curve> for String {
    fn from(Curve(points): Curve) -> Self {
        let words: Vec<String> = points.iter().map(|(epoch, loss)| format!("{epoch}:{loss:.3e}")).collect();
        words.join(" ")
    }
}

impl TryFrom<String> for Curve {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let point = |word: &str| {
            let (epoch, loss) = word.split_once(':')?;
            Some((epoch.parse().ok()?, loss.parse().ok()?))
        };
        let points = text.split_whitespace().map(|word| point(word).ok_or(format!("{word} is no loss")));
        points.collect::<Result<_, _>>().map(Self)
    }
}

fn cases(study: Study, start: &Settings) -> Vec<Case> {
    let case = |label: String, change: &dyn Fn(&mut Settings)| {
        let mut settings = start.clone();
        change(&mut settings);
        Case { label, settings, grid: None }
    };
    match study {
        Study::Features => {
            [2, 4, 8, 16].map(|d| case(format!("d = {d}"), &|s| s.field.network.features = d)).into()
        }
        Study::Neurons => [16, 32, 64]
            .map(|n| case(format!("{n} neurons"), &|s| s.field.network.hidden = vec![n; 2]))
            .into(),
        Study::Samples => {
            [1 << 11, 1 << 13, 1 << 15].map(|n| case(format!("{n} samples"), &|s| s.samples = n)).into()
        }
        Study::Activations => {
            Activation::ALL.map(|a| case(format!("{a:?}"), &|s| s.field.network.activation = a)).into()
        }
        Study::Projection => {
            let kept = [1, 5, 10, 50].map(|epochs| {
                case(format!("kept {epochs} epochs"), &|s| {
                    s.project_every = epochs;
                    s.resample_every = s.resample_every.max(epochs);
                })
            });
            let copies = [32, 64, 128]
                .map(|grid| Case { grid: Some(grid), ..case(format!("copy of {grid} cells"), &|_| {}) });
            kept.into_iter().chain(copies).collect()
        }
        Study::Cycle => {
            let maps = [
                ReverseMap::Plain,
                ReverseMap::Residual,
                ReverseMap::ClosestPoint,
                ReverseMap::Encoding,
                ReverseMap::Inverse,
            ];
            let weights = [1e2, 1e3, 1e4];
            let pairs = maps.into_iter().flat_map(|map| weights.map(|weight| (map, weight)));
            std::iter::once(case("none".into(), &|s| s.lambda_c = 0.0))
                .chain(pairs.map(|(map, weight)| {
                    case(format!("{map:?}, {weight:.0e}"), &|s| {
                        (s.reverse_map, s.lambda_c) = (map, weight);
                    })
                }))
                .collect()
        }
        Study::Smoothness => [0.0, 0.1, 1.0, 10.0]
            .map(|weight| case(format!("λ_D = {weight}"), &|s| s.lambda_d = weight))
            .into(),
        Study::Octaves => [0, 2, 4, 8]
            .map(|octaves| case(format!("{octaves} octaves"), &|s| s.field.network.octaves = octaves))
            .into(),
        Study::FeatureRate => [1.0, 10.0, 50.0, 100.0]
            .map(|rate| case(format!("{rate} times"), &|s| s.feature_rate = rate))
            .into(),
        Study::Presets => {
            let inverse = Settings { reverse_map: ReverseMap::Inverse, ..Settings::paper() };
            let presets = [
                ("default", Settings::default()),
                ("paper", Settings::paper()),
                ("paper with the inverse", inverse),
            ];
            presets.map(|(name, settings)| Case { label: name.into(), settings, grid: None }).into()
        }
    }
}

impl Study {
    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |v| v.get_name().into())
    }
}

/// The cases to be run of every study; studies without any are left out.
fn wanted(options: &Options, start: &Settings) -> Result<Vec<(Study, Vec<Case>)>, String> {
    let studies =
        if options.studies.is_empty() { Study::value_variants() } else { options.studies.as_slice() };
    let all: Vec<(Study, Vec<Case>)> = studies.iter().map(|&study| (study, cases(study, start))).collect();
    let is_known = |name: &String| all.iter().flat_map(|(_, cases)| cases).any(|case| case.label == *name);
    if let Some(unknown) = options.case.iter().find(|name| !is_known(name)) {
        let mut message = format!("there is no case {unknown:?}; known are");
        for (study, cases) in &all {
            let labels: Vec<String> = cases.iter().map(|case| format!("{:?}", case.label)).collect();
            message += &format!("\n  {}: {}", study.name(), labels.join(", "));
        }
        return Err(message);
    }
    let is_wanted = |case: &Case| options.case.is_empty() || options.case.contains(&case.label);
    let chosen = all.into_iter().map(|(study, cases)| (study, cases.into_iter().filter(is_wanted).collect()));
    Ok(chosen.filter(|(_, cases): &(_, Vec<Case>)| !cases.is_empty()).collect())
}

/// Runs the studies.
pub(crate) fn run(options: &Options) -> Result<(), String> {
    let out = root().join(&options.out);
    fs::create_dir_all(&out).map_err(|e| format!("{}: {e}", out.display()))?;
    let mut start = Settings::default();
    start.epochs = options.epochs.unwrap_or(start.epochs);
    let wanted = wanted(options, &start)?;
    for path in &options.mesh {
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let say = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let file = ndf_mesh::io::read_mesh(path).map_err(|e| say(&e))?;
        let mesh = repair::repaired(&file.mesh, &RepairOptions::LARGEST).map_err(|e| say(&e))?.mesh;
        let surface = MeshSurface::new(&mesh).map_err(|e| say(&e))?;
        let base = BaseMeshOptions { faces: options.base_faces, ..BaseMeshOptions::default() };
        let base =
            base_mesh_of_manifold(&mesh, Some(&surface), &base, &NoProgress).map_err(|e| say(&e))?.mesh;
        for (study, cases) in &wanted {
            let title = study.name();
            let file = out.join(format!("{name}-{title}.csv"));
            let mut runs: Rows<Run> = Rows::open(file.clone())?;
            for case in cases {
                let copy = case.grid.map(|cells| copied(&surface, cells)).transpose()?;
                let seen = copy.as_ref().unwrap_or(&surface);
                let (curve, report) = learn(seen, &surface, &base, &case.settings).map_err(|e| say(&e))?;
                eprintln!("{name}, {title}, {}: {report:?}", case.label);
                runs.put(Run::new(&case.label, &report, curve))?;
            }
            page::plot(&file.with_extension("svg"), &format!("{name}: {title}"), runs.all())?;
        }
    }
    page::write(&out)
}

impl Run {
    fn new(case: &str, report: &FitReport, curve: Curve) -> Self {
        Self {
            case: case.to_owned(),
            rms: report.projection_rms,
            max: report.projection_max,
            cycle_loss: report.cycle_loss,
            flipped: report.flipped_fraction,
            epochs: report.epochs,
            seconds: report.seconds,
            seconds_projecting: report.seconds_projecting,
            curve,
        }
    }
}

/// Learns `seen` and measures against `truth`.
fn learn(
    seen: &dyn Surface,
    truth: &dyn Surface,
    base: &ManifoldMesh,
    settings: &Settings,
) -> Result<(Curve, FitReport), String> {
    let mut curve = Vec::new();
    let every = (settings.epochs / 200).max(1);
    let mut log = |record: &LogRecord<'_>| {
        let epoch = record.losses.epoch;
        if epoch / every > curve.last().map_or(0, |&(last, _): &(usize, f64)| last / every) {
            curve.push((epoch, record.losses.projection));
        }
    };
    let mut trainer = Trainer::new(seen, base, settings).map_err(|e| e.to_string())?.finished_on(truth, 0);
    let (fit, _) = train(&mut trainer, Some(&mut log), &NoProgress).map_err(|e| e.to_string())?;
    Ok((Curve(curve), fit.report))
}

/// The surface as marching cubes see it on a grid.
fn copied(surface: &MeshSurface, cells: u32) -> Result<MeshSurface, String> {
    let field = surface.as_field().ok_or("the surface has no field")?;
    let options = MarchingCubesOptions { grid: cells, ..MarchingCubesOptions::default() };
    let copy = marching_cubes(field, &options, &NoProgress).map_err(|e| e.to_string())?;
    MeshSurface::new(&copy.mesh).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(studies: &[Study], case: &[&str]) -> Options {
        Options {
            studies: studies.into(),
            mesh: Vec::new(),
            base_faces: 4,
            case: case.iter().map(|&name| name.to_owned()).collect(),
            epochs: None,
            out: PathBuf::new(),
        }
    }

    #[test]
    fn cases_are_found_and_unknown_ones_refused() {
        let found = |studies: &[Study], case: &[&str]| wanted(&options(studies, case), &Settings::default());
        let names = |found: Vec<(Study, Vec<Case>)>| -> Vec<(Study, Vec<String>)> {
            let labels = |cases: Vec<Case>| cases.into_iter().map(|case| case.label).collect();
            found.into_iter().map(|(study, cases)| (study, labels(cases))).collect()
        };
        assert_eq!(found(&[], &[]).map(|all| all.len()), Ok(Study::value_variants().len()));
        let one = found(&[], &["d = 4"]).map(names);
        assert_eq!(one, Ok(vec![(Study::Features, vec!["d = 4".to_owned()])]));
        let unknown = found(&[Study::Cycle, Study::Octaves], &["none", "d = 4"]).map(names).unwrap_err();
        assert!(
            unknown.contains("no case \"d = 4\"") && unknown.contains("octaves: \"0 octaves\""),
            "{unknown}"
        );
        assert!(!unknown.contains("neurons"), "{unknown}");
    }

    #[test]
    fn a_case_takes_its_own_place_in_a_file_of_before() {
        let file = std::env::temp_dir().join(format!("ndf-ablation-{}.csv", std::process::id()));
        let head = "case,rms,max,cycle loss,flipped,epochs,seconds,of these projecting\n";
        let line = |label: &str| format!("\"{label}\",1.139e-3,1.520e-2,,0.00151,2000,10.8,3.5\n");
        fs::write(&file, format!("{head}{}{}", line("Plain, 1e2"), line("none"))).unwrap();
        let mut runs: Rows<Run> = Rows::open(file.clone()).unwrap();
        let curve = Curve(vec![(30, 1.5e-3), (60, 0.0)]);
        let again = Run { rms: 0.5, curve: curve.clone(), ..runs.all()[0].clone() };
        runs.put(again).unwrap();
        let read: Rows<Run> = Rows::open(file.clone()).unwrap();
        fs::remove_file(&file).unwrap();
        let [plain, none] = read.all() else { panic!("{:?}", read.all()) };
        assert_eq!((plain.case.as_str(), plain.rms, &plain.curve), ("Plain, 1e2", 0.5, &curve));
        assert_eq!((none.case.as_str(), none.rms, none.cycle_loss), ("none", 1.139e-3, None));
        assert!(none.curve.0.is_empty());
    }
}
