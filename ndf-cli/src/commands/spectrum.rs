//! `ndf spectrum`: eigenmodes of the Laplace–Beltrami operator.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::TriangleMesh;
use ndf_mesh::io::{VertexScalars, format_to_write, write_mesh};
use ndf_spectral::{LaplaceBeltrami, ModeOptions, Modes, OperatorOptions};
use serde_json::json;

use super::extract::length;
use crate::context::Context;
use crate::output::{Failure, Outcome, check_place, grouped, readable, table};
use crate::triangulation::{Triangles, TriangulationArguments};

/// Arguments of `ndf spectrum`.
#[derive(Args, Debug)]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    /// The mesh to write, with a scalar for every mode (.ply; other formats hold no scalars).
    #[arg(short, long, value_name = "MESH")]
    output: PathBuf,
    /// Number of modes, the constant one included.
    #[arg(long, value_name = "K", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    modes: u32,
    /// Shift of the operator that is factored; the eigenvalues do not depend on it.
    #[arg(long, value_name = "S", default_value_t = 1e-3, allow_negative_numbers = true, value_parser = length)]
    shift: f64,
    /// Take the triangles as they are, without flips to the intrinsic Delaunay triangulation.
    #[arg(long)]
    no_flips: bool,
}

/// Computes the modes with the smallest eigenvalues.
///
/// # Errors
/// If the input is no usable triangulation, the modes are not found, or the mesh cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    format_to_write(&arguments.output)?;
    check_place(&arguments.output)?;
    let name = arguments.triangulation.input.display();
    let triangles = arguments.triangulation.read_triangles(context)?;
    if let Triangles::Other(_, defects) = &triangles {
        context.warn(&format!("{name}: {defects}; its modes are those of its tufted cover"));
    }
    let started = Instant::now();
    let operator = OperatorOptions { delaunay: !arguments.no_flips, ..OperatorOptions::default() };
    let options =
        ModeOptions { count: arguments.modes as usize, shift: arguments.shift, ..ModeOptions::default() };
    let (mesh, laplacian): (&TriangleMesh, _) = match &triangles {
        Triangles::Manifold(mesh) => (mesh, LaplaceBeltrami::new(&IntrinsicMesh::of_mesh(mesh), operator)),
        Triangles::Other(mesh, _) => (mesh, LaplaceBeltrami::from_triangle_mesh(mesh, operator)),
    };
    let found = laplacian
        .and_then(|laplacian| laplacian.modes(&options, &context.progress()))
        .map_err(|e| Failure::new(format!("{name}: {e}")))?;
    let seconds = started.elapsed().as_secs_f64();
    write_mesh(&arguments.output, mesh, &scalars(&found))?;
    let json = json!({
        "seconds": seconds,
        "eigenvalues": found.eigenvalues,
        "residual_max": found.max_residual(),
        "verified": found.verified,
        "vertices": mesh.vertex_count(),
    });
    let shown: Vec<String> = found.eigenvalues.iter().take(8).map(|&x| readable(x)).collect();
    let more = if found.eigenvalues.len() > 8 { ", …" } else { "" };
    let rows = [
        ("vertices", grouped(mesh.vertex_count())),
        ("eigenvalues", format!("{}{more}", shown.join(", "))),
        ("largest residual", readable(found.max_residual())),
        ("time", format!("{seconds:.2} s")),
    ];
    let output = arguments.output.display();
    Ok(Outcome::new(json, format!("{output}: {} modes\n{}", found.eigenvalues.len(), table(&rows))))
}

/// The modes as scalars `mode_00`, `mode_01`, …
pub fn scalars(modes: &Modes) -> Vec<VertexScalars> {
    let scalar = |k: usize| VertexScalars {
        name: format!("mode_{k:02}"),
        values: modes.mode(k).iter().map(|&x| x as f32).collect(),
    };
    (0..modes.len()).map(scalar).collect()
}
