//! The table of docs/representations.md: what the default preset makes of inputs of every kind.

use std::fs;
use std::path::Path;
use std::time::Instant;

use ndf_cli::commands::extract::{EdgeLength, extracted};
use ndf_cli::commands::fit::{Fitted, Job, Training, fit_file};
use ndf_cli::context::{Context, Options};
use ndf_cli::input::Reading;
use ndf_cli::report::{Figure, Shot};
use ndf_core::io::read_mesh;
use ndf_core::metrics::{MeasureOptions, measure};
use ndf_core::{NoProgress, TriangleMesh};

use crate::shell::root;

const BASE_FACES: u32 = 4000;

/// Longest edge of the extracted mesh, in the box [-1.5, 1.5]³.
const EDGE_LENGTH: f64 = 0.01;

/// Cells along the longest side of the marching cubes that the learned surface is compared with.
const GRID: u32 = 256;

/// Size of the pictures.
const PICTURE: (usize, usize) = (240, 180);

/// Where the rows go.
const TABLE: [&str; 2] =
    ["<!-- table: cargo xtask representations FILE [--truth MESH] -->\n", "<!-- end of table -->"];

/// Where the rows of cached fields go.
const CACHES: [&str; 2] = ["<!-- caches: cargo xtask representations FILE -->\n", "<!-- end of caches -->"];

/// Fits a file and puts its row into the table, in the place of an earlier one of the same file.
pub(crate) fn run(file: &Path, truth: Option<&Path>) -> Result<(), String> {
    let context = Context::new(Options { quiet: true, ..Options::default() });
    let name = file.file_name().ok_or("the file has no name")?.to_string_lossy().into_owned();
    let say = |e: &dyn std::fmt::Display| format!("{name}: {e}");
    let reading = Reading::default();
    let job = Job::new(file, &reading, BASE_FACES, Training::default());
    let (fitted, _) = fit_file(&job, &context).map_err(|e| say(&e))?;
    let started = Instant::now();
    let (surface, _) = extracted(&fitted.model, EdgeLength::relative(EDGE_LENGTH)).map_err(|e| say(&e))?;
    let seconds_extracting = started.elapsed().as_secs_f64();
    let picture = format!("images/representations/{name}.png");
    write_picture(surface.as_triangle_mesh(), &root().join("docs").join(&picture)).map_err(|e| say(&e))?;
    let truth = match truth {
        Some(path) => distances(&fitted, surface.as_triangle_mesh(), path).map_err(|e| say(&e))?,
        None => "".to_owned(),
    };
    let report = &fitted.report;
    let diagonal = surface.as_triangle_mesh().bounds().diagonal();
    let share = |x: f64| 100.0 * fitted.model.similarity.length_to_world(x) / diagonal;
    let row = format!(
        "| {name} | {} | {:.1} | {:.1} | {:.0} | {:.0} | {:.1} | {:.3} / {:.2} % | {truth} | ![{name}]({picture}) |\n",
        fitted.input.kind,
        fitted.seconds_reading,
        fitted.base_report["seconds"].as_f64().unwrap_or(0.0),
        report.seconds,
        report.seconds_projecting,
        seconds_extracting,
        share(report.projection_rms),
        share(report.projection_max),
    );
    eprint!("{row}");
    put(&name, &row, TABLE)?;
    let Some(band) = &fitted.band else { return Ok(()) };
    let figures = band.json(&fitted.model.similarity);
    let number = |key: &str| figures[key].as_f64().unwrap_or(0.0);
    let row = format!(
        "| {name} | {:.0} | {:.3} | {:.0} | {:.1} | {:.4} / {:.4} |\n",
        number("cubes"),
        share(number("finest")),
        100.0 * number("unresolved"),
        number("seconds"),
        share(number("projection_error_median")),
        share(number("projection_error_rms")),
    );
    eprint!("{row}");
    put(&name, &row, CACHES)
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
