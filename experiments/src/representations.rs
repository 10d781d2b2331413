//! The table of docs/representations.md: what the default preset makes of inputs of every kind.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use ndf_cli::commands::extract::{EdgeLength, extracted};
use ndf_cli::commands::fit::{Fitted, Job, fit_file};
use ndf_cli::commands::training::Training;
use ndf_cli::context::{Context, Options as ContextOptions};
use ndf_cli::input::Reading;
use ndf_cli::report::{Figure, Shot};
use ndf_core::NoProgress;
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::io::read_mesh;
use ndf_mesh::metrics::{MeasureOptions, measure};
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleMesh};
use ndf_spectral::{ModeOptions, modes};

use crate::root;

/// Faces of the base mesh of which a row says nothing.
const BASE_FACES: u32 = 4000;

/// Longest edge of the extracted mesh, in the box [-1.5, 1.5]³.
const EDGE_LENGTH: f64 = 0.01;

/// Cells along the longest side of the marching cubes that the learned surface is compared with.
const GRID: u32 = 256;

/// Eigenmodes that are found on it.
const MODES: usize = 20;

/// Size of the pictures.
const PICTURE: (usize, usize) = (240, 180);

/// Where the rows go.
const TABLE: [&str; 2] = [
    "<!-- table: cargo xtask representations FILE [--truth MESH] [--base-faces N] -->\n",
    "<!-- end of table -->",
];

/// Where the rows of cached fields go.
const CACHES: [&str; 2] = ["<!-- caches: cargo xtask representations FILE -->\n", "<!-- end of caches -->"];

/// A file and how it is learned.
#[derive(Args)]
pub(crate) struct Options {
    /// The input
    file: PathBuf,
    /// The mesh it was made from, in its coordinates
    #[arg(long)]
    truth: Option<PathBuf>,
    /// Faces of the base mesh
    #[arg(long, default_value_t = BASE_FACES)]
    base_faces: u32,
    #[command(flatten)]
    reading: Reading,
}

/// Fits a file, extracts a mesh, checks that distances and modes can be computed on it, and puts the row into the table, in
/// the place of an earlier one of the same file and base mesh.
pub(crate) fn run(options: &Options) -> Result<(), String> {
    let file = &options.file;
    let context = Context::new(ContextOptions { quiet: true, ..ContextOptions::default() });
    let file_name = file.file_name().ok_or("the file has no name")?.to_string_lossy().into_owned();
    let name = match options.base_faces {
        BASE_FACES => file_name,
        faces => format!("{file_name}, {faces} faces"),
    };
    let say = |e: &dyn std::fmt::Display| format!("{name}: {e}");
    let job = Job::new(file, &options.reading, options.base_faces, Training::default());
    let (fitted, _) = fit_file(&job, &context).map_err(|e| say(&e))?;
    let (surface, _) = extracted(&fitted.model, EdgeLength::relative(EDGE_LENGTH)).map_err(|e| say(&e))?;
    check_analysis(&surface).map_err(|e| say(&e))?;
    let picture = format!("images/representations/{}.png", name.replace(", ", "_").replace(' ', "_"));
    write_picture(&surface, &root().join("docs").join(&picture)).map_err(|e| say(&e))?;
    let truth = match &options.truth {
        Some(path) => distances(&fitted, &surface, path).map_err(|e| say(&e))?,
        None => "".to_owned(),
    };
    let report = &fitted.report;
    let diagonal = surface.bounds().diagonal();
    let share = |x: f64| 100.0 * fitted.model.similarity.length_to_world(x) / diagonal;
    let figures = fitted.band.as_ref().map(|band| band.json(&fitted.model.similarity));
    let number = |key: &str| figures.as_ref().map_or(0.0, |figures| figures[key].as_f64().unwrap_or(0.0));
    let row = format!(
        "| {name} | {} | {:.3} / {:.2} | {truth} | ![{name}]({picture}) |\n",
        fitted.input.kind,
        share(report.projection_rms),
        share(report.projection_max),
    );
    eprint!("{row}");
    put(&name, &row, TABLE)?;
    if figures.is_none() {
        return Ok(());
    }
    let row = format!(
        "| {name} | {:.0} | {:.3} | {:.0} | {:.4} / {:.4} |\n",
        number("cubes"),
        share(number("finest")),
        100.0 * number("unresolved"),
        share(number("projection_error_median")),
        share(number("projection_error_rms")),
    );
    eprint!("{row}");
    put(&name, &row, CACHES)
}

/// Fails unless exact distances from a vertex reach all others and the modes are complete.
fn check_analysis(surface: &ManifoldMesh) -> Result<(), String> {
    let mesh = IntrinsicMesh::of_mesh(surface);
    let found = exact_distances(&mesh, &[SurfacePoint::Vertex(0)], &ExactOptions::default(), &NoProgress)
        .map_err(|e| format!("distances: {e}"))?;
    if let Some(vertex) = found.distances().iter().position(|d| !d.is_finite()) {
        return Err(format!("no distance reaches vertex {vertex}"));
    }
    let options = ModeOptions { count: MODES, ..ModeOptions::default() };
    match modes(&mesh, &options, &NoProgress).map_err(|e| format!("modes: {e}"))? {
        found if found.verified => Ok(()),
        _ => Err("some modes may be missing".to_owned()),
    }
}

/// Mean distances to the true mesh, there and back, of the learned surface and of marching cubes of the input, in
/// per cent of its diagonal.
fn distances(fitted: &Fitted, surface: &TriangleMesh, truth: &Path) -> Result<String, String> {
    let truth = read_mesh(truth).map_err(|e| e.to_string())?.mesh;
    let cubes = fitted.input.reference(GRID, &NoProgress).map_err(|e| e.to_string())?;
    let error = |mesh: &TriangleMesh| {
        let m = measure(&truth, mesh, &MeasureOptions::default()).map_err(|e| e.to_string())?;
        let share = |x: f64| 100.0 * x / m.diagonal;
        let (there, back) = (share(m.mesh_to_reference.mean), share(m.reference_to_mesh.mean));
        Ok::<_, String>(format!("{there:.4} / {back:.4}"))
    };
    Ok(format!("{} ({GRID}³: {})", error(surface)?, error(&cubes)?))
}

fn write_picture(mesh: &TriangleMesh, path: &Path) -> Result<(), String> {
    let shot = Shot { width: PICTURE.0, height: PICTURE.1, ..Shot::default() };
    let figure = Figure::of_mesh(mesh, None, "", &shot, &NoProgress).map_err(|e| e.to_string())?;
    let folder = path.parent().expect("pictures lie in a folder");
    fs::create_dir_all(folder).and_then(|()| fs::write(path, figure.png)).map_err(|e| e.to_string())
}

/// Puts a row between two marks.
fn put(name: &str, row: &str, [begin, end]: [&str; 2]) -> Result<(), String> {
    let page = root().join("docs/representations.md");
    let text = fs::read_to_string(&page).map_err(|e| format!("{}: {e}", page.display()))?;
    let missing = "docs/representations.md has no place for the table";
    let (before, rest) = text.split_once(begin).ok_or(missing)?;
    let (table, after) = rest.split_once(end).ok_or(missing)?;
    let key = format!("| {name} |");
    let mut rows: Vec<String> = table.lines().map(|line| format!("{line}\n")).collect();
    match rows.iter().position(|line| line.starts_with(&key)) {
        Some(place) => rows[place] = row.to_owned(),
        None => rows.push(row.to_owned()),
    }
    fs::write(&page, format!("{before}{begin}{}{end}{after}", rows.concat())).map_err(|e| e.to_string())
}
