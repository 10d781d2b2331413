//! `ndf demo`: the whole pipeline, and a page that shows it.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use ndf::{
    DistanceOptions, EdgeLength, Fitted, ManifoldMesh, ModelExt, NoProgress, Opened, Place, TriangleMesh,
    Triangulated,
};
use ndf_mesh::io::{VertexScalars, atomic_write};
use ndf_mesh::metrics::{MeasureOptions, Measurement, measure, vertex_distances};
use ndf_mesh::{TriangleTree, Vertex};
use ndf_spectral::ModeOptions;
use ndf_viewer::Input;
use serde_json::json;

use super::fit::rounds;
use super::sample::Shape;
use crate::arguments::{PartArguments, Reading, Training, UpArgument};
use crate::context::Context;
use crate::drawn::usual_up;
use crate::files::open;
use crate::interrupt;
use crate::learning::{STAGES, learned};
use crate::output::{Failure, Outcome, grouped, table};
use crate::render::{ColourMap, Style, Up, View, upright};
use crate::report::{Figure, Report, Shot};

/// Longest edge of the mesh shown, in the box [-1.5, 1.5]³.
const EDGE_LENGTH: f64 = 0.02;

/// Cells along the longest side of the isosurface that stands for an input that is no mesh.
const REFERENCE_GRID: u32 = 192;

/// Eigenfunctions computed.
const DEMO_MODES: usize = 20;

/// What is made of the model.
const MADE_OF_MODEL: [&str; 5] = ["surface.ply", "base.ply", "geodesic.ply", "modes.ply", "report.html"];

/// Arguments of `ndf demo`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The surface to learn [default: a built-in shape].
    input: Option<PathBuf>,
    /// The folder to write to.
    #[arg(short, long, value_name = "DIR", default_value = "ndf-demo")]
    output: PathBuf,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    parts: PartArguments,
    /// Faces of the base mesh [default: 4000, or as many as suit --size or --error].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=10_000_000))]
    base_faces: Option<u32>,
    #[command(flatten)]
    up: UpArgument,
    #[command(flatten)]
    training: Training,
}

/// Fits, extracts, measures and pictures.
///
/// # Errors
/// If a stage fails or a file cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    context.expect(&STAGES);
    context.expect(&["extraction", "factoring", "modes", "drawing"]);
    let started = Instant::now();
    let folder = &arguments.output;
    fs::create_dir_all(folder).map_err(|e| Failure::new(format!("cannot make {}: {e}", folder.display())))?;
    let input = match &arguments.input {
        Some(path) => path.clone(),
        None => {
            let path = folder.join("input.ply");
            context.write_mesh(&path, &Shape::default().mesh(None), &[])?;
            path
        }
    };
    let opened = open(&input, &arguments.parts.opening(&arguments.reading)?, context)?;
    let mut fit = arguments.training.fit(&opened, context.seed())?;
    if let Some(faces) = arguments.base_faces {
        fit = fit.base_faces(faces as usize);
    }
    let fitted = learned(fit, &input, None, context)?;
    if interrupt::is_requested() {
        return Err(Failure::new("interrupted"));
    }
    let bytes = fitted.model.to_bytes();
    // What is left of another run would not belong to this model, should the rest be interrupted.
    for file in MADE_OF_MODEL {
        match fs::remove_file(folder.join(file)) {
            Err(e) if e.kind() != ErrorKind::NotFound => {
                return Err(Failure::new(format!("cannot replace {}: {e}", folder.join(file).display())));
            }
            _ => {}
        }
    }
    write(&folder.join("model.ndf"), &bytes)?;

    let before = Instant::now();
    let surface = fitted.model.extract_with(EdgeLength::Relative(EDGE_LENGTH), &context.progress())?.mesh;
    let seconds_extracting = before.elapsed().as_secs_f64();
    let stage = Stage::compared(&opened, &fitted, &surface, arguments.up.up, context)?;
    context.write_mesh(&folder.join("surface.ply"), &surface, std::slice::from_ref(&stage.field_error))?;

    context.write_mesh(&folder.join("base.ply"), &fitted.base, std::slice::from_ref(&stage.base_error))?;

    let triangulated = Triangulated::from(surface.clone());
    let distances = geodesics(&triangulated)?;
    context.write_mesh(&folder.join("geodesic.ply"), &surface, std::slice::from_ref(&distances))?;
    let modes = eigenmodes(&triangulated, context)?;
    context.write_mesh(&folder.join("modes.ply"), &surface, &modes)?;

    let name = input.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let rows = figures(&fitted, &surface, &stage, bytes.len(), seconds_extracting);
    let viewer = Input {
        edge_length: Some(EdgeLength::Relative(EDGE_LENGTH).world(&fitted.model)),
        up: Some(stage.up.name()),
        ..Input::new("model.ndf", &bytes)
    };
    let viewer = viewer.to_html();
    let made = Made { distances: &distances, modes: &modes, viewer: &viewer };
    let page = page(&name, &fitted, &surface, &stage, &made, &rows, context)?;
    write(&folder.join("report.html"), page.as_bytes())?;

    let seconds = started.elapsed().as_secs_f64();
    let report = folder.join("report.html").display().to_string();
    let json = json!({
        "output": folder.display().to_string(),
        "report": report,
        "seconds": seconds,
        "seconds_training": fitted.report.seconds,
        "seconds_extracting": seconds_extracting,
        "model_bytes": bytes.len(),
        "faces": surface.face_count(),
        "base_error": two_sided(&stage.base),
        "field_error": two_sided(&stage.field),
        "flipped_fraction": stage.field.flipped_fraction,
    });
    let mut rows: Vec<(&str, String)> = rows.iter().map(|(label, value)| (*label, value.clone())).collect();
    rows.push(("all of it", format!("{seconds:.1} s")));
    Ok(Outcome::new(json, format!("{report}: open it in a browser\n{}", table(&rows))))
}

/// Exact distances from the vertex farthest to one side.
fn geodesics(surface: &Triangulated) -> Result<VertexScalars, Failure> {
    let mesh = surface.mesh();
    let side = |v: &usize| mesh.positions()[*v].element_sum();
    let source = (0..mesh.vertex_count()).max_by(|a, b| side(a).total_cmp(&side(b))).unwrap_or(0);
    let found =
        surface.distances(&[Place::Vertex(Vertex::new(source))], &DistanceOptions::default(), &NoProgress)?;
    Ok(found.scalars())
}

/// The first eigenfunctions of the Laplacian.
fn eigenmodes(surface: &Triangulated, context: &Context) -> Result<Vec<VertexScalars>, Failure> {
    let count = DEMO_MODES.min(surface.mesh().vertex_count() / 4);
    let options = ModeOptions { count, ..ModeOptions::default() };
    Ok(surface.mode_scalars(&surface.modes(&options, &context.progress())?))
}

/// How far base mesh and learned surface are from the input.
struct Stage {
    reference: TriangleMesh,
    base: Measurement,
    field: Measurement,
    base_error: VertexScalars,
    field_error: VertexScalars,
    /// What points up in pictures.
    up: Up,
}

impl Stage {
    fn compared(
        opened: &Opened,
        fitted: &Fitted,
        surface: &ManifoldMesh,
        up: Option<Up>,
        context: &Context,
    ) -> Result<Self, Failure> {
        let reference = opened.reference(REFERENCE_GRID, &context.progress())?;
        let options = MeasureOptions { seed: context.seed(), ..MeasureOptions::default() };
        let tree = TriangleTree::new(&reference);
        let error = |mesh: &ManifoldMesh| VertexScalars {
            name: "error".to_owned(),
            values: vertex_distances(mesh, &tree).into_iter().map(|d| d as f32).collect(),
        };
        Ok(Self {
            base: measure(&reference, &fitted.base, &options)?,
            field: measure(&reference, surface, &options)?,
            base_error: error(&fitted.base),
            field_error: error(surface),
            up: up.unwrap_or_else(|| upright(&reference, usual_up(opened.kind))),
            reference,
        })
    }
}

/// Mean of the mean distances both ways.
fn two_sided(m: &Measurement) -> f64 {
    f64::midpoint(m.mesh_to_reference.mean, m.reference_to_mesh.mean)
}

fn figures(
    fitted: &Fitted,
    surface: &ManifoldMesh,
    stage: &Stage,
    bytes: usize,
    seconds_extracting: f64,
) -> Vec<(&'static str, String)> {
    let share = |x: f64| format!("{:.4} %", 100.0 * x / stage.field.diagonal);
    let report = &fitted.report;
    let is_farther = stage.field.hausdorff > stage.base.hausdorff;
    let remark = if is_farther { ", more than the base mesh's: see where in the pictures" } else { "" };
    vec![
        ("input", format!("{} faces", grouped(stage.reference.face_count()))),
        ("base mesh", format!("{} faces", grouped(fitted.base.face_count()))),
        ("model file", format!("{} bytes", grouped(bytes))),
        (
            "extracted surface",
            format!("{} faces in {seconds_extracting:.2} s", grouped(surface.face_count())),
        ),
        ("training", format!("{} in {:.1} s", rounds(fitted), report.seconds)),
        ("mean distance, base mesh", format!("{} of the diagonal", share(two_sided(&stage.base)))),
        ("mean distance, learned", format!("{} of the diagonal", share(two_sided(&stage.field)))),
        ("largest distance, base mesh", format!("{} of the diagonal", share(stage.base.hausdorff))),
        ("largest distance, learned", format!("{} of the diagonal{remark}", share(stage.field.hausdorff))),
        ("faces turned against the input", format!("{:.3} %", 100.0 * stage.field.flipped_fraction)),
    ]
}

/// What was made of the learned surface.
struct Made<'a> {
    distances: &'a VertexScalars,
    modes: &'a [VertexScalars],
    /// A page to turn it.
    viewer: &'a str,
}

fn page(
    name: &str,
    fitted: &Fitted,
    surface: &ManifoldMesh,
    stage: &Stage,
    made: &Made<'_>,
    rows: &[(&'static str, String)],
    context: &Context,
) -> Result<String, Failure> {
    let progress = context.progress();
    let plain = Shot { view: View { up: stage.up, ..View::default() }, ..Shot::default() };
    let wired = Shot { style: Style { wireframe: true, flat: true, ..Style::default() }, ..plain };
    let base = &fitted.base;
    let learned = &surface;
    let pictures = [
        Figure::of_mesh(&stage.reference, None, "The input", &plain, &progress)?,
        Figure::of_mesh(base, None, "Its base mesh, from which the field is learned", &wired, &progress)?,
        Figure::of_mesh(learned, None, "The learned surface", &plain, &progress)?,
    ];
    // One scale for both, so that colours compare.
    let map = ColourMap::of(&[stage.base_error.values.as_slice(), &stage.field_error.values].concat());
    let (base_error, error) = (Some((&stage.base_error, map)), Some((&stage.field_error, map)));
    let errors = [
        Figure::of_mesh(base, base_error, "Distance of the base mesh to the input", &plain, &progress)?,
        Figure::of_mesh(learned, error, "Distance of the learned surface to the input", &plain, &progress)?,
    ];
    let lined = Shot { style: Style { isolines: 24, ..Style::default() }, ..plain };
    let painted = |scalar: &VertexScalars, caption: &str, shot: &Shot| {
        let values = &scalar.values;
        Figure::of_mesh(learned, Some((scalar, ColourMap::of(values))), caption, shot, &progress)
    };
    let mut computed = vec![painted(made.distances, "Exact geodesic distance from one point", &lined)?];
    for (number, mode) in [(2, made.modes.get(1)), (8, made.modes.get(7))] {
        if let Some(mode) = mode {
            computed.push(painted(mode, &format!("Eigenfunction {number} of the Laplacian"), &plain)?);
        }
    }
    let rows: Vec<Vec<String>> =
        rows.iter().map(|(label, value)| vec![(*label).to_owned(), value.clone()]).collect();
    let shown = format!("ndf extract model.ndf -o mesh.ply --relative-edge-length {EDGE_LENGTH}");
    let how = match fitted.model.field.levels() {
        None => {
            "A small network maps the base mesh onto the input. Base mesh, features and network are the model file; \
             from it a mesh of any resolution is extracted."
        }
        Some(_) => {
            "The base mesh controls a smooth surface, and displacements along its normal, level by level, lead to \
             the input. Control vertices and displacements are the model file; from it a mesh of any resolution is \
             extracted."
        }
    };
    Ok(Report::new(&format!("A neural displacement field of {name}"))
        .paragraph(how)
        .figures(&pictures)
        .table("What came out", &["", ""], &rows)
        .heading("The model, to turn and to compute on")
        .viewer(
            "The edge length is chosen with the slider; a click shows exact distances from there",
            made.viewer,
        )
        .heading("Where it is how far from the input")
        .figures(&errors)
        .heading("What it is for")
        .figures(&computed)
        .heading("To go on")
        .code(&shown)
        .to_html())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    atomic_write(path, |out| out.write_all(bytes))
        .map_err(|e| Failure::new(format!("cannot write {}: {e}", path.display())))
}
