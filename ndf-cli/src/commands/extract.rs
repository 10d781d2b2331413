//! `ndf extract`: a mesh of a model, as fine as is asked for.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use ndf_intrinsic::extraction::tessellation::tessellate;
use ndf_intrinsic::{Extraction, ExtractionOptions, ExtractionReport, extract};
use ndf_mesh::io::{format_to_write, write_mesh};
use ndf_mesh::quality::Quality;
use ndf_mesh::{ManifoldMesh, ValidationReport};
use ndf_model::{Model, Similarity};
use serde_json::{Value, json};

use crate::context::Context;
use crate::input::read_model;
use crate::output::{Failure, Outcome, check_place, grouped, readable, table};

/// More triangles than this are refused: their file would have over a gigabyte.
const MOST_FACES: usize = 50_000_000;

/// Arguments of `ndf extract`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The model.
    model: PathBuf,
    /// The mesh to write; the extension tells its format (.ply, .obj, .stl).
    #[arg(short, long, value_name = "MESH")]
    output: PathBuf,
    #[command(flatten)]
    edge_length: EdgeLength,
    /// Only cut the base faces; do not improve the triangles.
    #[arg(long)]
    no_refine: bool,
}

/// The edge length wanted.
#[derive(Args, Clone, Copy, Debug)]
#[group(required = true, multiple = false)]
pub struct EdgeLength {
    /// Length of edges, in the input's units: about this, or at most this with `--no-refine`.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length)]
    edge_length: Option<f64>,
    /// The same where the base mesh fills the box [-1.5, 1.5]³.
    #[arg(long, value_name = "H", allow_negative_numbers = true, value_parser = length)]
    relative_edge_length: Option<f64>,
}

impl EdgeLength {
    /// A length relative to the box.
    pub fn relative(length: f64) -> Self {
        Self { edge_length: None, relative_edge_length: Some(length) }
    }

    /// The one of two lengths that is given.
    pub fn of(edge_length: Option<f64>, relative_edge_length: Option<f64>) -> Option<Self> {
        edge_length.or(relative_edge_length).map(|_| Self { edge_length, relative_edge_length })
    }

    /// The length in the box.
    pub fn normalised(&self, similarity: &Similarity) -> f64 {
        match (self.edge_length, self.relative_edge_length) {
            (Some(world), _) => similarity.length_to_normalised(world),
            (None, Some(relative)) => relative,
            (None, None) => unreachable!("the group of arguments is required"),
        }
    }
}

/// Writes a mesh of a model.
///
/// # Errors
/// If the model cannot be read, the edge length asks for too much, or the mesh cannot be written.
pub fn run(arguments: &Arguments, _context: &Context) -> Result<Outcome, Failure> {
    format_to_write(&arguments.output)?;
    check_place(&arguments.output)?;
    let model = read_model(&arguments.model)?;
    let started = Instant::now();
    let failed = |e: String| Failure::new(format!("{}: {e}", arguments.model.display()));
    let (mesh, report) = if arguments.no_refine {
        (tessellated(&model, arguments.edge_length).map_err(failed)?, None)
    } else {
        let (mesh, report) = extracted(&model, arguments.edge_length).map_err(failed)?;
        (mesh, Some(report))
    };
    let seconds = started.elapsed().as_secs_f64();
    write_mesh(&arguments.output, &mesh, &[])?;
    let path = arguments.output.display().to_string();
    let (json, rows) = figures(&mesh, report.as_ref(), seconds);
    Ok(Outcome::new(json, format!("{path}: {} faces\n{}", grouped(mesh.face_count()), table(&rows))))
}

/// The Delaunay mesh of a model, in the input's units, and what is true of it.
///
/// # Errors
/// If the edge length asks for too much, or the field is not finite.
pub fn extracted(model: &Model, edge_length: EdgeLength) -> Result<(ManifoldMesh, ExtractionReport), String> {
    let extraction = extraction(model, edge_length)?;
    Ok((to_world(&extraction.mesh, &model.similarity), extraction.report))
}

/// The Delaunay mesh of a model in the normalised box, and where its vertices lie on the base mesh.
///
/// # Errors
/// As [`extracted`].
pub fn extraction(model: &Model, edge_length: EdgeLength) -> Result<Extraction, String> {
    let length = edge_length.normalised(&model.similarity);
    let options = ExtractionOptions { most_faces: MOST_FACES, ..ExtractionOptions::new(length) };
    extract(&model.field, &options).map_err(|e| e.to_string())
}

/// The base faces of a model cut until they are small, in the input's units.
fn tessellated(model: &Model, edge_length: EdgeLength) -> Result<ManifoldMesh, String> {
    let length = edge_length.normalised(&model.similarity);
    let tessellation = tessellate(&model.field, length, MOST_FACES).map_err(|e| e.to_string())?;
    Ok(to_world(&tessellation.mesh, &model.similarity))
}

/// A mesh in the normalised box, in the input's units.
pub fn to_world(mesh: &ManifoldMesh, similarity: &Similarity) -> ManifoldMesh {
    mesh.with_positions(mesh.positions().iter().map(|&p| similarity.to_world(p)).collect())
}

fn figures(
    mesh: &ManifoldMesh,
    extraction: Option<&ExtractionReport>,
    seconds: f64,
) -> (Value, Vec<(&'static str, String)>) {
    let report = ValidationReport::of(mesh);
    let quality = Quality::of(mesh);
    let (length, angle) = (quality.edge_length, quality.min_angle_deg);
    let json = json!({
        "seconds": seconds,
        "vertices": report.vertices,
        "faces": report.faces,
        "components": report.components,
        "euler_characteristic": report.euler_characteristic,
        "boundary_edges": report.boundary_edges,
        "manifold": report.is_manifold(),
        "oriented": report.inconsistent_edges.count == 0,
        // A plain tessellation's own metric is the embedded one.
        "delaunay_intrinsic": extraction.map_or(quality.is_delaunay(), |e| e.delaunay_intrinsic),
        "delaunay_embedded_fraction": quality.delaunay_fraction,
        "edge_length": {"min": length.min, "mean": length.mean, "max": length.max},
        "min_angle_deg": {"min": angle.min, "p5": angle.p5, "median": angle.median},
    });
    let rows = vec![
        ("vertices", grouped(report.vertices)),
        (
            "topology",
            format!(
                "{} component{}, Euler characteristic {}, {} boundary edges",
                report.components,
                if report.components == 1 { "" } else { "s" },
                report.euler_characteristic,
                grouped(report.boundary_edges)
            ),
        ),
        (
            "edge length",
            format!("{} to {}, mean {}", readable(length.min), readable(length.max), readable(length.mean)),
        ),
        (
            "smallest angles",
            format!("{:.1}° at least, {:.1}° for all but 5 % of the faces", angle.min, angle.p5),
        ),
        ("Delaunay edges", format!("{:.2} %", 100.0 * quality.delaunay_fraction)),
        ("time", format!("{seconds:.3} s")),
    ];
    (json, rows)
}

/// A positive length.
pub fn length(text: &str) -> Result<f64, String> {
    let x: f64 = text.parse().map_err(|_| "a number is expected".to_owned())?;
    if x.is_finite() && x > 0.0 { Ok(x) } else { Err("a positive number is expected".to_owned()) }
}
