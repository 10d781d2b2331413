//! `ndf spectrum`: eigenmodes of the Laplace–Beltrami operator.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use ndf::Triangles;
use ndf_mesh::io::format_to_write;
use ndf_spectral::{Inversion, ModeOptions, OperatorOptions, SpectralError};
use serde_json::json;

use crate::arguments::{Boundary, TriangulationArguments, length};
use crate::context::Context;
use crate::output::{Failure, Outcome, check_output, grouped, readable, table};
use crate::streams::output_file;
use crate::triangulation::read_triangulation;

/// Arguments of `ndf spectrum`.
#[derive(Args, Debug)]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    /// The mesh to write, with a scalar for every mode (.ply, .glb; other formats hold no scalars).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    output: PathBuf,
    /// Number of modes, the constant one included.
    #[arg(long, value_name = "K", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    modes: u32,
    /// Shift of the operator that is factored; the eigenvalues do not depend on it.
    #[arg(long, value_name = "S", default_value_t = 1e-3, allow_negative_numbers = true, value_parser = length)]
    shift: f64,
    /// Use the triangles as they are, without flips to the intrinsic Delaunay triangulation.
    #[arg(long)]
    no_flips: bool,
    /// Invert the operator by multigrid instead of a factorisation: some ten times slower, in less memory, and without the proof
    /// that no mode is missing.
    #[arg(long)]
    multigrid: bool,
    /// What functions are at a boundary.
    #[arg(long, value_enum, default_value_t)]
    boundary: Boundary,
}

/// Computes the modes with the smallest eigenvalues.
///
/// # Errors
/// If the input is no usable triangulation, the modes are not found, or the mesh cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    format_to_write(&arguments.output)?;
    check_output(&arguments.output, &[&arguments.triangulation.input])?;
    let name = arguments.triangulation.input.display();
    context.expect(&["extraction", "factoring", "modes"]);
    let found_on = read_triangulation(&arguments.triangulation, None, context)?;
    let triangulated = &found_on.surface;
    if let Triangles::Soup { reason, mesh } = &triangulated.triangles
        && mesh.face_count() > 0
    {
        context.warn(&format!("{name} is {reason}; its modes are those of its tufted cover"));
    }
    let started = Instant::now();
    let operator = OperatorOptions { delaunay: !arguments.no_flips, ..OperatorOptions::default() };
    let (count, shift) = (arguments.modes as usize, arguments.shift);
    let inversion = if arguments.multigrid { Inversion::Multigrid } else { Inversion::Factorisation };
    let options = ModeOptions { count, shift, inversion, operator, ..ModeOptions::default() };
    let found = match arguments.boundary {
        Boundary::Neumann => triangulated.modes(&options, &context.progress()),
        Boundary::Dirichlet => triangulated.modes_with_held_boundary(&options, &context.progress()),
    };
    let found = found.map_err(|error| {
        let failure = Failure::new(format!("{name}: {error}"));
        match error {
            SpectralError::TooManyModes { vertices, .. } => {
                failure.try_instead(&format!("ask for at most {vertices}, or subdivide the mesh"))
            }
            SpectralError::SolveNotConverged(_) if arguments.multigrid => {
                failure.try_instead("without --multigrid the operator is factored")
            }
            SpectralError::OutOfMemory(_) => failure.try_instead("--multigrid needs less memory"),
            _ => failure,
        }
    })?;
    let mesh = triangulated.mesh();
    let seconds = started.elapsed().as_secs_f64();
    context.write_mesh(&arguments.output, mesh, &triangulated.mode_scalars(&found))?;
    let mut json = json!({
        "seconds": seconds,
        "eigenvalues": found.eigenvalues,
        "residual_max": found.max_residual(),
        "verified": found.verified,
        "vertices": mesh.vertex_count(),
        "unused_vertices": triangulated.unused_vertices(),
        "area_left_out": triangulated.area_left_out,
    });
    let shown: Vec<String> = found.eigenvalues.iter().take(8).map(|&x| readable(x)).collect();
    let more = if found.eigenvalues.len() > 8 { ", …" } else { "" };
    let mut rows = vec![
        ("vertices", grouped(mesh.vertex_count())),
        ("eigenvalues", format!("{}{more}", shown.join(", "))),
        ("largest residual", readable(found.max_residual())),
        ("time", format!("{seconds:.2} s")),
    ];
    found_on.tell_metric(|factors| factors.operators, &mut json, &mut rows);
    found_on.tell(&arguments.triangulation, &mut json, &mut rows);
    if !found.verified && !arguments.multigrid {
        context.warn(&format!(
            "{name}: the eigenvalues were not proven to be complete, since they lie too close together to be counted; a few \
             more with --modes may settle it"
        ));
    }
    let output = arguments.output.display();
    Ok(Outcome::new(json, format!("{output}: {} modes\n{}", found.eigenvalues.len(), table(&rows))))
}
