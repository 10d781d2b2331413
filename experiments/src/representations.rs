//! The table of docs/representations.md: what the default preset makes of inputs of every kind.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use ndf::{EdgeLength, Field, Fit, ModelExt, Opened};
use ndf_cli::arguments::Reading;
use ndf_cli::drawn::usual_up;
use ndf_cli::render::{View, upright};
use ndf_cli::report::{Figure, Shot};
use ndf_core::NoProgress;
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::io::read_mesh;
use ndf_mesh::metrics::{MeasureOptions, measure};
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleMesh, Vertex};
use ndf_spectral::{ModeOptions, modes};

use crate::root;

/// Faces of the base mesh of which a row says nothing.
const BASE_FACES: usize = 4000;

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
    base_faces: usize,
    #[command(flatten)]
    reading: Reading,
}

/// Fits a file, extracts a mesh, checks that distances and modes can be computed on it, and puts the row into the table, in
/// the place of an earlier one of the same file and base mesh.
pub(crate) fn run(options: &Options) -> Result<(), String> {
    let file = &options.file;
    let file_name = file.file_name().ok_or("the file has no name")?.to_string_lossy().into_owned();
    let name = match options.base_faces {
        BASE_FACES => file_name,
        faces => format!("{file_name}, {faces} faces"),
    };
    let say = |e: &dyn std::fmt::Display| format!("{name}: {e}");
    let reading = options.reading.options().map_err(|e| say(&e))?;
    let opened = ndf::open(file, &reading).map_err(|e| say(&e))?;
    let fitted =
        Fit::new(&opened).field(Field::Network).base_faces(options.base_faces).run().map_err(|e| say(&e))?;
    let surface = fitted.model.extract(EdgeLength::Relative(EDGE_LENGTH)).map_err(|e| say(&e))?.mesh;
    check_analysis(&surface).map_err(|e| say(&e))?;
    let picture = format!("images/representations/{}.png", name.replace(", ", "_").replace(' ', "_"));
    let view = View { up: upright(&surface, usual_up(opened.kind)), ..View::default() };
    write_picture(&surface, view, &root().join("docs").join(&picture)).map_err(|e| say(&e))?;
    let truth = match &options.truth {
        Some(path) => distances(&opened, &surface, path).map_err(|e| say(&e))?,
        None => "".to_owned(),
    };
    let report = &fitted.report;
    let diagonal = surface.bounds().diagonal();
    let share = |x: f64| 100.0 * fitted.model.similarity.length_to_world(x) / diagonal;
    let figures = fitted.figures();
    let row = format!(
        "| {name} | {} | {:.3} / {:.2} | {truth} | ![{name}]({picture}) |\n",
        fitted.kind,
        share(report.projection_rms),
        share(report.projection_max),
    );
    eprint!("{row}");
    put(&name, &row, TABLE)?;
    let Some(cache) = figures.cache else { return Ok(()) };
    let row = format!(
        "| {name} | {} | {:.3} | {:.0} | {:.4} / {:.4} |\n",
        cache.cubes,
        share(cache.finest),
        100.0 * cache.unresolved,
        share(cache.projection_error_median),
        share(cache.projection_error_rms),
    );
    eprint!("{row}");
    put(&name, &row, CACHES)
}

/// Fails unless exact distances from a vertex reach all others and the modes are complete.
fn check_analysis(surface: &ManifoldMesh) -> Result<(), String> {
    let mesh = IntrinsicMesh::from_mesh(surface);
    let found =
        exact_distances(&mesh, &[SurfacePoint::Vertex(Vertex(0))], &ExactOptions::default(), &NoProgress)
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
fn distances(opened: &Opened, surface: &TriangleMesh, truth: &Path) -> Result<String, String> {
    let truth = read_mesh(truth).map_err(|e| e.to_string())?.mesh;
    let cubes = opened.reference(GRID, &NoProgress).map_err(|e| e.to_string())?;
    let error = |mesh: &TriangleMesh| {
        let m = measure(&truth, mesh, &MeasureOptions::default()).map_err(|e| e.to_string())?;
        let share = |x: f64| 100.0 * x / m.diagonal;
        let (there, back) = (share(m.mesh_to_reference.mean), share(m.reference_to_mesh.mean));
        Ok::<_, String>(format!("{there:.4} / {back:.4}"))
    };
    Ok(format!("{} ({GRID}³: {})", error(surface)?, error(&cubes)?))
}

fn write_picture(mesh: &TriangleMesh, view: View, path: &Path) -> Result<(), String> {
    let shot = Shot { view, width: PICTURE.0, height: PICTURE.1, ..Shot::default() };
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
