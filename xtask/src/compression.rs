//! What models weigh and what that costs, beside decimated meshes compressed by Draco or not at all.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use ndf_cli::commands::extract::{EdgeLength, extracted};
use ndf_cli::commands::fit::{Job, fit_file};
use ndf_cli::commands::geodesic::closest;
use ndf_cli::commands::training::Training;
use ndf_cli::context::{Context, Options as ContextOptions};
use ndf_cli::input::Reading;
use ndf_core::io::read_mesh;
use ndf_core::metrics::{MeasureOptions, measure};
use ndf_core::model::SectionSizes;
use ndf_core::{DVec3, ManifoldMesh, NoProgress, SurfacePoint, TriangleMesh, TriangleTree};
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_meshing::{DecimationOptions, decimate};
use ndf_spectral::{ModeOptions, modes};
use serde_json::Value;

use crate::document::replace_table;
use crate::performance::process::{PythonPeer, Scratch};
use crate::shell::root;

const MESHES: &[&str] = &[
    "spot.obj",
    "armadillo_86k.obj",
    "fertility_9k.off",
    "skull_100k.obj",
    "rocker-arm.obj",
    "bunny_7k.off",
    "cactus.off",
    "casting.off",
];
/// Relative edge length of the meshes on which models are measured.
const EDGE_LENGTH: f64 = 0.01;
/// Faces of the decimated meshes.
const DECIMATED: [usize; 6] = [1_000, 2_000, 4_000, 8_000, 16_000, 32_000];
/// Points to which distances are compared.
const TARGETS: usize = 2_000;

/// What to measure.
#[derive(Args)]
pub(crate) struct Options {
    /// The folder with the meshes
    #[arg(long, default_value = "../shared/data/mesh")]
    data: PathBuf,
    /// Only these meshes of the folder
    #[arg(long = "mesh")]
    meshes: Vec<String>,
    /// Faces of the base meshes
    #[arg(long, value_delimiter = ',', default_values_t = [2_000, 4_000, 8_000, 16_000, 32_000])]
    base_faces: Vec<u32>,
    /// A Python interpreter with numpy and DracoPy (see xtask/peers/draco.py)
    #[arg(long)]
    python: Option<PathBuf>,
}

/// How far a mesh is from the reference.
struct Errors {
    /// Of the diagonal: the larger of the means of both ways, and of the largest distances.
    mean: f64,
    max: f64,
    /// Mean relative error of geodesic distances from one vertex.
    geodesic: f64,
    /// Mean relative error of the 20 smallest eigenvalues, the zero aside.
    eigenvalues: f64,
}

/// A mesh with what others are compared to.
struct Reference {
    mesh: ManifoldMesh,
    source: DVec3,
    targets: Vec<(DVec3, f64)>,
    eigenvalues: Vec<f64>,
}

/// Measures all meshes and rewrites the tables of docs/compression.md.
pub(crate) fn run(options: &Options) -> Result<(), String> {
    let context = Context::new(ContextOptions { quiet: true, ..ContextOptions::default() });
    let (mut models, mut rivals) = (models_header(), rivals_header());
    for &file in MESHES.iter().filter(|m| options.meshes.is_empty() || options.meshes.iter().any(|n| n == *m))
    {
        let path = root().join(&options.data).join(file);
        let (more_models, more_rivals) =
            of_mesh(file, &path, options, &context).map_err(|e| format!("{file}: {e}"))?;
        eprint!("{more_models}{more_rivals}");
        models += &more_models;
        rivals += &more_rivals;
    }
    let document = root().join("docs/compression.md");
    replace_table(&document, "cargo xtask compression, models", &models)?;
    replace_table(&document, "cargo xtask compression, rivals", &rivals)
}

fn models_header() -> String {
    "| mesh | base faces | numbers | base | features | network | file | mean | largest | geodesics | eigenvalues |\n\
     |---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|\n"
        .to_owned()
}

fn rivals_header() -> String {
    "| mesh | base faces | model | geodesics | edgebreaker | sequential | plain mesh |\n\
     |---|--:|--:|--:|--:|--:|--:|\n"
        .to_owned()
}

/// Rows of one mesh in both tables.
fn of_mesh(
    name: &str,
    path: &Path,
    options: &Options,
    context: &Context,
) -> Result<(String, String), String> {
    let reference = Reference::new(read_mesh(path).map_err(|e| e.to_string())?.mesh)?;
    let rivals = decimated(&reference, options.python.as_deref())?;
    let (mut models, mut beside) = (String::new(), String::new());
    for &faces in &options.base_faces {
        for (numbers, training) in
            [("single", Training::default().lossless()), ("rounded", Training::default())]
        {
            let reading = Reading::default();
            let job = Job::new(path, &reading, faces, training);
            let (fitted, _) = fit_file(&job, context).map_err(|e| e.to_string())?;
            let (surface, _) = extracted(&fitted.model, EdgeLength::relative(EDGE_LENGTH))?;
            let Errors { mean, max, geodesic, eigenvalues } = reference.errors(&surface)?;
            let SectionSizes { base, features, network, total, .. } = fitted.model.section_sizes();
            writeln!(
                models,
                "| {name} | {faces} | {numbers} | {base} | {features} | {network} | {total} | {:.5} % | {:.3} % | {:.4} % | {:.4} % |",
                100.0 * mean,
                100.0 * max,
                100.0 * geodesic,
                100.0 * eigenvalues,
            )
            .expect("writing to a string does not fail");
            if numbers == "rounded" {
                let equal = |bytes: fn(&Rival) -> Option<f64>| at_equal_error(&rivals, geodesic, bytes);
                writeln!(
                    beside,
                    "| {name} | {faces} | {total} | {:.4} % | {} | {} | {} |",
                    100.0 * geodesic,
                    equal(|r| r.edgebreaker),
                    equal(|r| r.sequential),
                    equal(|r| Some(r.plain)),
                )
                .expect("writing to a string does not fail");
            }
        }
    }
    Ok((models, beside))
}

impl Reference {
    fn new(mesh: TriangleMesh) -> Result<Self, String> {
        let mesh = ManifoldMesh::try_from(mesh).map_err(|e| e.to_string())?;
        let intrinsic = IntrinsicMesh::of_mesh(&mesh);
        let distances = exact_distances(&intrinsic, &[SurfacePoint::Vertex(0)], &ExactOptions::default())
            .map_err(|e| e.to_string())?;
        let stride = (mesh.vertex_count() / TARGETS).max(1);
        let targets = mesh.positions().iter().copied().zip(distances.distances().iter().copied());
        let targets = targets.step_by(stride).filter(|(_, d)| d.is_finite() && *d > 0.0).collect();
        let eigenvalues = eigenvalues(&intrinsic)?;
        Ok(Self { source: mesh.positions()[0], targets, eigenvalues, mesh })
    }

    fn errors(&self, mesh: &ManifoldMesh) -> Result<Errors, String> {
        let there =
            measure(self.mesh.as_triangle_mesh(), mesh.as_triangle_mesh(), &MeasureOptions::default())
                .map_err(|e| e.to_string())?;
        let tree = TriangleTree::new(mesh.as_triangle_mesh());
        let closest = |p: DVec3| closest(mesh, &tree, p).map_err(|e| e.to_string());
        let intrinsic = IntrinsicMesh::of_mesh(mesh);
        let source = [closest(self.source)?];
        let geodesics =
            exact_distances(&intrinsic, &source, &ExactOptions::with_windows()).map_err(|e| e.to_string())?;
        let mut sum = 0.0;
        for &(target, truth) in &self.targets {
            let found = geodesics.distance_at(closest(target)?).map_err(|e| e.to_string())?;
            sum += (found - truth).abs() / truth;
        }
        let eigenvalues = eigenvalues(&intrinsic)?;
        let pairs = self.eigenvalues.iter().zip(&eigenvalues).skip(1);
        let relative: Vec<f64> = pairs.map(|(truth, found)| (found - truth).abs() / truth).collect();
        Ok(Errors {
            mean: there.mesh_to_reference.mean.max(there.reference_to_mesh.mean) / there.diagonal,
            max: there.hausdorff / there.diagonal,
            geodesic: sum / self.targets.len() as f64,
            eigenvalues: relative.iter().sum::<f64>() / relative.len() as f64,
        })
    }
}

fn eigenvalues(mesh: &IntrinsicMesh) -> Result<Vec<f64>, String> {
    let modes = modes(mesh, &ModeOptions::default(), &NoProgress).map_err(|e| e.to_string())?;
    Ok(modes.eigenvalues.iter().copied().collect())
}

/// A decimated mesh: its error and its sizes.
struct Rival {
    geodesic: f64,
    edgebreaker: Option<f64>,
    sequential: Option<f64>,
    plain: f64,
}

fn decimated(reference: &Reference, python: Option<&Path>) -> Result<Vec<Rival>, String> {
    let scratch = Scratch::new()?;
    let mut draco = python
        .map(|python| PythonPeer::start(python, "draco.py", &[scratch.path().display().to_string()]))
        .transpose()?;
    let mut rivals = Vec::new();
    for faces in DECIMATED.into_iter().filter(|&faces| faces < reference.mesh.face_count()) {
        let mesh = decimate(&reference.mesh, &DecimationOptions::to_faces(faces), &NoProgress).mesh;
        let (vertices, faces) = (mesh.vertex_count() as f64, mesh.face_count() as f64);
        // The supplement's formula.
        let plain = (32.0 * 3.0 * vertices + 3.0 * faces * vertices.log2()) / 8.0;
        let Some(draco) = &mut draco else {
            let geodesic = reference.errors(&mesh)?.geodesic;
            rivals.push(Rival { geodesic, edgebreaker: None, sequential: None, plain });
            continue;
        };
        scratch.write("mesh.f64", mesh.positions().iter().flat_map(DVec3::to_array).map(f64::to_le_bytes))?;
        scratch.write("mesh.u32", mesh.faces().iter().flatten().map(|v| v.to_le_bytes()))?;
        let sizes = draco.ask("mesh")?;
        let size = |key: &str| sizes.get(key).and_then(Value::as_f64);
        // What is compared is what comes out of the compressor, where that is still a manifold.
        let decoded = read_raw(scratch.path()).and_then(|mesh| ManifoldMesh::try_from(mesh).ok());
        let geodesic = reference.errors(decoded.as_ref().unwrap_or(&mesh))?.geodesic;
        rivals.push(Rival {
            geodesic,
            edgebreaker: size("edgebreaker"),
            sequential: size("sequential"),
            plain,
        });
    }
    Ok(rivals)
}

fn read_raw(folder: &Path) -> Option<TriangleMesh> {
    let numbers = |name: &str| fs::read(folder.join(name)).ok();
    let positions = numbers("mesh.decoded.f64")?;
    let positions: Vec<f64> = positions.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    let faces = numbers("mesh.decoded.u32")?;
    let faces: Vec<u32> = faces.as_chunks().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
    let positions = positions.as_chunks().0.iter().map(|p: &[f64; 3]| DVec3::from_array(*p)).collect();
    TriangleMesh::new(positions, faces.as_chunks().0.to_vec()).ok()
}

/// The bytes of a decimated mesh with this error, between those measured on straight lines of logarithms.
fn at_equal_error(rivals: &[Rival], error: f64, bytes: fn(&Rival) -> Option<f64>) -> String {
    let known: Vec<(f64, f64)> = rivals.iter().filter_map(|r| Some((r.geodesic, bytes(r)?))).collect();
    let Some((&(_, smallest), &(_, largest))) = known.first().zip(known.last()) else { return String::new() };
    for pair in known.windows(2) {
        let ((coarse, few), (fine, many)) = (pair[0], pair[1]);
        if coarse >= error && error >= fine && coarse > fine {
            let t = (coarse / error).ln() / (coarse / fine).ln();
            return format!("{:.0}", few * (many / few).powf(t));
        }
    }
    if known.iter().all(|(e, _)| *e > error) { format!("> {largest:.0}") } else { format!("< {smallest:.0}") }
}
