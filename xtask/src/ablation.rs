//! The ablations of the paper's supplement (Fig. 1, Fig. 2) and our own, as CSV files and a page of plots.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use ndf_core::network::Activation;
use ndf_core::progress::NoProgress;
use ndf_core::{ManifoldMesh, Surface, mesh::repair};
use ndf_meshing::{BaseMeshOptions, MarchingCubesOptions, base_mesh_of_manifold, marching_cubes};
use ndf_surfaces::MeshSurface;
use ndf_train::{FitReport, Hooks, LogRecord, ReverseMap, Settings, Trainer, train};
use plotters::prelude::*;

use crate::shell::root;

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
    /// Cases to run of these studies, by their names in the tables [default: all]
    #[arg(long, num_args = 1..)]
    case: Vec<String>,
    /// Epochs of every run but those of the presets [default: the default preset's]
    #[arg(long)]
    epochs: Option<usize>,
    /// Where the CSV files and the page go
    #[arg(long, default_value = "docs/ablation")]
    out: PathBuf,
}

/// One run of a study.
struct Case {
    label: String,
    settings: Settings,
    /// Cells along the longest side of the grid from which the surface is copied, where it is not itself.
    grid: Option<u32>,
}

/// Projection loss at an epoch.
type Curve = Vec<(usize, f64)>;

fn cases(study: Study, start: &Settings) -> Vec<Case> {
    let case = |label: String, change: &dyn Fn(&mut Settings)| {
        let mut settings = start.clone();
        change(&mut settings);
        Case { label, settings, grid: None }
    };
    match study {
        Study::Features => [2, 4, 8, 16].map(|d| case(format!("d = {d}"), &|s| s.field.features = d)).into(),
        Study::Neurons => {
            [16, 32, 64].map(|n| case(format!("{n} neurons"), &|s| s.field.hidden = vec![n; 2])).into()
        }
        Study::Samples => {
            [1 << 11, 1 << 13, 1 << 15].map(|n| case(format!("{n} samples"), &|s| s.samples = n)).into()
        }
        Study::Activations => {
            Activation::ALL.map(|a| case(format!("{a:?}"), &|s| s.field.activation = a)).into()
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
            .map(|octaves| case(format!("{octaves} octaves"), &|s| s.field.octaves = octaves))
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

/// Runs the studies.
pub(crate) fn run(options: &Options) -> Result<(), String> {
    let out = root().join(&options.out);
    fs::create_dir_all(&out).map_err(|e| format!("{}: {e}", out.display()))?;
    let mut start = Settings::default();
    start.epochs = options.epochs.unwrap_or(start.epochs);
    let studies =
        if options.studies.is_empty() { Study::value_variants() } else { options.studies.as_slice() };
    for path in &options.mesh {
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let say = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let file = ndf_core::io::read_mesh(path).map_err(|e| say(&e))?;
        let mesh = repair::mended(&file.mesh).map_err(|e| say(&e))?.mesh;
        let surface = MeshSurface::new(mesh.as_triangle_mesh()).map_err(|e| say(&e))?;
        let base = BaseMeshOptions { faces: options.base_faces, ..BaseMeshOptions::default() };
        let base =
            base_mesh_of_manifold(&mesh, Some(&surface), &base, &NoProgress).map_err(|e| say(&e))?.mesh;
        for &study in studies {
            let title = study.name();
            let (mut curves, mut summary) = (Vec::new(), String::from(HEADER));
            let wanted = |case: &Case| options.case.is_empty() || options.case.contains(&case.label);
            for case in cases(study, &start).into_iter().filter(wanted) {
                let copy = case.grid.map(|cells| copied(&surface, cells)).transpose()?;
                let seen = copy.as_ref().unwrap_or(&surface);
                let (curve, report) = learn(seen, &surface, &base, &case.settings).map_err(|e| say(&e))?;
                let row = row(&case.label, &report);
                eprint!("{name}, {title}: {row}");
                summary += &row;
                curves.push((case.label, curve));
            }
            let file = out.join(format!("{name}-{title}"));
            write(&file.with_extension("csv"), &summary)?;
            write(&file.with_extension("svg"), &plot(&format!("{name}: {title}"), &curves)?)?;
        }
    }
    write(&out.join("index.html"), &page(&out)?)
}

const HEADER: &str = "case,rms,max,cycle loss,flipped,epochs,seconds,of these projecting\n";

fn row(label: &str, r: &FitReport) -> String {
    let cycle_loss = r.cycle_loss.map_or_else(String::new, |loss| format!("{loss:.2e}"));
    format!(
        "\"{label}\",{:.3e},{:.3e},{cycle_loss},{:.5},{},{:.1},{:.1}\n",
        r.projection_rms, r.projection_max, r.flipped_fraction, r.epochs, r.seconds, r.seconds_projecting
    )
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
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
    let mut hooks = Hooks { progress: &NoProgress, log: Some(&mut log) };
    let (fit, _) = train(&mut trainer, &mut hooks).map_err(|e| e.to_string())?;
    Ok((curve, fit.report))
}

/// The surface as marching cubes see it on a grid.
fn copied(surface: &MeshSurface, cells: u32) -> Result<MeshSurface, String> {
    let field = surface.as_field().ok_or("the surface has no field")?;
    let options = MarchingCubesOptions { grid: cells, ..MarchingCubesOptions::default() };
    let copy = marching_cubes(field, &options, &NoProgress).map_err(|e| e.to_string())?;
    MeshSurface::new(copy.mesh.as_triangle_mesh()).map_err(|e| e.to_string())
}

/// Projection loss by epoch, logarithmically.
fn plot(title: &str, curves: &[(String, Curve)]) -> Result<String, String> {
    let points = || curves.iter().flat_map(|(_, curve)| curve);
    let last = points().map(|p| p.0).max().unwrap_or(1);
    let (least, most) = points().fold((f64::MAX, f64::MIN_POSITIVE), |(l, m), p| (l.min(p.1), m.max(p.1)));
    let mut svg = String::new();
    let draw = |svg: &mut String| -> Result<(), Box<dyn std::error::Error>> {
        let area = SVGBackend::with_string(svg, (720, 420)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(64)
            .build_cartesian_2d(0..last, (0.7 * least..1.4 * most).log_scale())?;
        let format = |y: &f64| format!("{y:.0e}");
        chart.configure_mesh().x_desc("epoch").y_desc("projection loss").y_label_formatter(&format).draw()?;
        for (k, (label, curve)) in curves.iter().enumerate() {
            let colour = Palette99::pick(k).to_rgba();
            chart
                .draw_series(LineSeries::new(curve.iter().copied(), colour.stroke_width(2)))?
                .label(label)
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], colour));
        }
        chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK).draw()?;
        area.present()?;
        Ok(())
    };
    draw(&mut svg).map_err(|e| e.to_string())?;
    Ok(svg)
}

/// A page of all studies in the folder.
fn page(folder: &Path) -> Result<String, String> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .map_err(|e| format!("{}: {e}", folder.display()))?
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|path| path.extension().is_some_and(|e| e == "csv"))
        .collect();
    files.sort();
    let mut html = String::from(
        "<!doctype html><meta charset=\"utf-8\"><title>Ablations</title>\
         <style>body{font:14px sans-serif;margin:2em}td,th{padding:.1em .8em;text-align:right}</style>\
         <h1>Ablations</h1><p>Distances in the box of side 3. Made by <code>cargo xtask ablation</code>.</p>\n",
    );
    let read = |path: &Path| fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()));
    let tables = files.iter().map(|file| read(file)).collect::<Result<Vec<_>, _>>()?;
    for study in Study::value_variants() {
        let ending = format!("-{}.csv", study.name());
        let of_study = files.iter().zip(&tables).filter(|(f, _)| f.to_string_lossy().ends_with(&ending));
        let tables: Vec<&str> = of_study.map(|(_, table)| table.as_str()).collect();
        let means = means(&tables);
        if !means.is_empty() {
            let _ = write!(html, "<h2>{}, mean over {} meshes</h2>", study.name(), tables.len());
            html += &html_table(HEADER.lines().map(str::to_owned).chain(means));
        }
    }
    for (file, table) in files.iter().zip(&tables) {
        html += &read(&file.with_extension("svg"))?;
        html += &html_table(table.lines().map(str::to_owned));
    }
    Ok(html)
}

/// Means over tables of several meshes, of the cases that all of them have.
fn means(tables: &[&str]) -> Vec<String> {
    let [first, _, ..] = tables else { return Vec::new() };
    let of_case = |label: &str| -> Option<String> {
        let rows: Option<Vec<Vec<f64>>> = tables
            .iter()
            .map(|table| {
                let (_, rest) = table.lines().map(cells).find(|(found, _)| *found == label)?;
                rest.split(',').map(|cell| cell.parse().ok()).collect()
            })
            .collect();
        let rows = rows?;
        let mean = |k: usize| rows.iter().map(|row| row[k]).sum::<f64>() / rows.len() as f64;
        let columns: Vec<String> = (0..rows[0].len()).map(|k| format!("{:.3e}", mean(k))).collect();
        Some(format!("\"{label}\",{}", columns.join(",")))
    };
    first.lines().skip(1).filter_map(|line| of_case(cells(line).0)).collect()
}

/// The label of a line, and what follows.
fn cells(line: &str) -> (&str, &str) {
    match line.strip_prefix('"').and_then(|l| l.split_once("\",")) {
        Some(quoted) => quoted,
        None => line.split_once(',').unwrap_or((line, "")),
    }
}

/// A table of lines of CSV, the first of which is its head.
fn html_table(lines: impl Iterator<Item = String>) -> String {
    let mut html = String::from("<table>");
    for (i, line) in lines.enumerate() {
        let tag = if i == 0 { "th" } else { "td" };
        let (label, rest) = cells(&line);
        html += "<tr>";
        for cell in std::iter::once(label).chain(rest.split(',')) {
            let _ = write!(html, "<{tag}>{cell}</{tag}>");
        }
        html += "</tr>";
    }
    html + "</table>\n"
}
